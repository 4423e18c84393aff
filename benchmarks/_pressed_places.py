"""Straight presses of a tip of 5 mm into places of known shapes, normal force over the modulus: as rendered
on a mesh, and by the virtual laboratory. Solved forces are kept in the user's cache."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

from benchmarks._known_shapes import KnownShape
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.flat_foot import Standing
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.reconstruction.shapes.drawing import decimated
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions, fill
from palpate.render.base import Renderer
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import place_numbers
from palpate.render.options import RenderOptions
from palpate.render.registry import create
from palpate.scenes.laboratory.mesh import laboratory_cache
from palpate.scenes.laboratory.specimen import Fineness, Specimen, build
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.phantoms import Phantom

TIP_M, MODULUS_PA, NU = 0.005, 20e3, 0.49
DEPTHS_M = (0.001, 0.003, 0.006)
_UP = np.array([0.0, 0.0, 1.0])
FINENESS = Fineness(2.0, 6.0, 0.5)
"""Of the laboratory's mesh."""
_LONGEST_M = 2.5e-4
"""Of the laboratory's load steps: a sticking tip is held aside by what it meets in a longer one, and pushed
back less. Steps of 0.1 mm give 0.04 % more at 3 mm, steps of 1 mm 0.2 % less (dome, apex)."""


class Given(Protocol):
    """A closed surface: vertices (n, 3) m, triangles (m, 3) outward."""

    @property
    def vertices(self) -> np.ndarray: ...
    @property
    def triangles(self) -> np.ndarray: ...


def meshed(shape: Given, size_m: float) -> TetMesh:
    """A mesh of the shape's file."""
    stood = Standing(shape.vertices, shape.triangles, np.zeros(3), _UP)
    surface = Surface(
        vertices=stood.vertices, triangles=stood.triangles, uncertainty_m=np.zeros(len(stood.vertices)),
        support_point=stood.support_point, support_normal=_UP, method="known", reason="the shape is given",
        redraw=lambda edge_m: decimated(stood, edge_m), shape=TrueShape(stood.vertices, stood.triangles),
    )  # fmt: skip
    return fill(surface, MeshingOptions(mesh_size_m=size_m))


def forces(mesh: TetMesh, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(places, depths) N along the normal, straight presses from outside to each depth below the points."""
    renderer = create("fem", standing(mesh), on_demand=True)
    return straight_in(renderer, points, normals, np.array(DEPTHS_M))


def standing(mesh: TetMesh, nu: float = NU, dent_law: str = "linear") -> Model:
    """The model of a mesh that stands on z = 0."""
    return Model(
        mesh=mesh.quadratic(), material=ObjectMaterial(MODULUS_PA, nu, dent_law=dent_law),
        support=Support(np.zeros(3), _UP), tool=Tool(TIP_M), mesh_size_m=0.01,
    )  # fmt: skip


def straight_in(
    renderer: Renderer, points: np.ndarray, normals: np.ndarray, depths_m: np.ndarray
) -> np.ndarray:
    """(places, depths) N along the normal as rendered, the tip coming from outside."""
    way = np.linspace(-0.002, depths_m[-1], 101)
    result = np.empty((len(points), len(depths_m)))
    for row, point, normal in zip(result, points, normals, strict=True):
        path = point + (TIP_M - way)[:, None] * normal
        force = renderer.follow(renderer.start([TIP_M]), path[:, None], np.full(len(way), 10.0))[:, 0]
        row[:] = np.interp(depths_m, way, force @ normal)
    return result


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
    at = TriangleSurface(1e3 * shape.vertices, shape.triangles).nearest(1e3 * point)[0][0]
    radius, force = 1e3 * TIP_M, np.full(len(depths_m), np.nan)
    specimen = Specimen(poisson_ratio, radius, finite=True, friction=friction)
    problem = build(thing, specimen, at, travel=0.0, fineness=fineness)
    state = problem.rest(at + radius * normal)
    before = 0.0
    for k, depth in enumerate(depths_m):
        steps = int(np.ceil((depth - before) / _LONGEST_M - 1e-9))
        try:
            for down in np.linspace(before, depth, steps + 1)[1:]:
                state = problem.advance(state, at + (radius - 1e3 * down) * normal)
        except PalpateError:
            break
        before = depth
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
