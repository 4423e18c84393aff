"""Straight presses of a tip of 5 mm into places of known shapes, normal force over the modulus: as rendered
on a mesh, and by the virtual laboratory. Solved forces are kept in the user's cache."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from benchmarks._known_shapes import KnownShape
from benchmarks.felt_surface import NU, TIP_M, standing, straight_in
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import place_numbers
from palpate.render.options import RenderOptions
from palpate.render.registry import create
from palpate.scenes.laboratory.mesh import laboratory_cache
from palpate.scenes.laboratory.specimen import Fineness, Specimen, build
from palpate.scenes.laboratory.surface import Surface
from palpate.scenes.phantoms import Phantom

FINENESS = Fineness(2.0, 6.0, 0.5)
"""Of the laboratory's mesh."""


def kept_force(key: str, solve: Callable[[], np.ndarray]) -> np.ndarray:
    """(d,) m^2 what `solve` answers, from the user's cache where it is there under its content key."""
    path = laboratory_cache() / "presses" / f"{key}.npy"
    if path.is_file():
        return np.load(path)
    force = solve()
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as temporary, temporary.open("wb") as handle:
        np.save(handle, force)
    return force


def in_laboratory(
    shape: KnownShape,
    point: np.ndarray,
    normal: np.ndarray,
    depths_m: np.ndarray,
    *,
    poisson_ratio: float = NU,
    friction: float | None = None,
    fineness: Fineness = FINENESS,
) -> np.ndarray:
    """(d,) m^2 by the laboratory's whole body (finite strain; friction None sticks); NaN from the depth on
    where it finds no equilibrium."""
    thing = Phantom(shape.name, shape.name, shape.vertices, shape.triangles, 1.0, poisson_ratio)
    at = Surface(1e3 * shape.vertices, shape.triangles).nearest(1e3 * point)[0][0]
    radius, force = 1e3 * TIP_M, np.full(len(depths_m), np.nan)
    specimen = Specimen(poisson_ratio, radius, finite=True, friction=friction)
    problem = build(thing, specimen, at, travel=0.0, fineness=fineness)
    state = problem.rest(at + radius * normal)
    for k, depth in enumerate(depths_m):
        try:
            state = problem.advance(state, at + (radius - 1e3 * depth) * normal)
        except PalpateError:
            break
        force[k] = 1e-6 * state.force @ normal
    return force


def rendered(
    mesh: TetMesh,
    points: np.ndarray,
    normals: np.ndarray,
    depths_m: np.ndarray,
    *,
    poisson_ratio: float = NU,
    friction: float | None = None,
    bent: bool = True,
) -> tuple[np.ndarray, np.ndarray]:
    """(places, depths) m^2 as rendered, neo-Hookean; (8, places) numbers of the places (render.force_error).

    friction: None sticks. bent: the dent knows of the surface's curvature, else its effective radius alone.
    """
    model = standing(mesh, poisson_ratio, dent_law="neo-hookean")
    options = RenderOptions(friction=np.inf if friction is None else friction)
    renderer = create("fem", model, options, on_demand=True)
    assert isinstance(renderer, FemRenderer)
    if not bent:
        renderer.parameters.table[:, 3] = 0.0
    near = cKDTree(renderer.contact.arrays.vertices).query(points)[1]
    force = straight_in(renderer, points, normals, depths_m)
    return force / model.material.young_modulus_pa, place_numbers(renderer, TIP_M, near)
