"""What a rendered force may be off by: the law itself, the felt shape, where the first touch lay.

Half widths of 95 % intervals, N. The law's own share of the force (mechanics.law_errors.Bound) grows with the
depth, on curved ground, beside rims and above the base, and where a push along the normal also moves the
surface sideways.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.compliance.coarse_table import CoarseCompliance
from palpate.mechanics.compliance.near_field import contact_width
from palpate.mechanics.compliance.patch import usual_width
from palpate.mechanics.compliance.sites import (
    contact_curvature,
    patch_width,
    surface_edge,
    uneven_curvature,
)
from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.contact.edges import ends_within, foot_within, nearness
from palpate.mechanics.contact.touch import TouchedPlaces, touch_forces
from palpate.mechanics.law_errors import Bound
from palpate.mechanics.model.model import Model
from palpate.mechanics.plausible import USUAL_POISSON_RATIO
from palpate.mechanics.shape.nearest import facings, first_hits
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.render.base import Renderer
from palpate.render.effects import rendered_touch
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.render.surface.bvh import STACK, closest_triangle
from palpate.render.surface.felt_surface import felt_surface
from palpate.render.surface.snapping import ONSET_NOISE_M, is_given
from palpate.render.surface.walking import foot

SURE = 1.96
COARSE_DEPTH, _STEPS = 0.6, 7
"""Of the press by which a coarse table's error is stated, in tip radii; and its steps."""
_SAGITTA = 0.05
"""Tip radii: what is as near is the surface itself, or the support."""
_BESIDE_RIM = 0.01
"""How near a rim is (mechanics.contact.edges.nearness) within whose strip a normal may turn."""
_BETWEEN = 1 - np.sqrt(0.5)
"""What the normal between the faces of a right-angled rim is turned by, as one less a cosine."""
_STEEPNESS = 1.4
"""d ln force / d ln depth of a press: 1.5 for a small dent, 1 where the object gives."""


@dataclass(frozen=True)
class ForceErrors:
    """95 % half widths, N, a sample each (n,): of the law (mesh and tables), of the modulus, of the shape's
    uncertainty, of the first touches that it was drawn through."""

    law_n: np.ndarray
    modulus_n: np.ndarray
    shape_n: np.ndarray
    first_touch_n: np.ndarray


def force_errors(
    renderer: Renderer, position: np.ndarray, force: np.ndarray, tip_radius_m: float
) -> ForceErrors | None:
    """For tip centres (n, 3) m and forces (n, 3) N on the tool; None for a renderer other than the
    finite-element one: the 1D models know nothing between their presses."""
    if not isinstance(renderer, FemRenderer):
        return None
    surface = renderer.contact.arrays
    touchable = np.unique(surface.triangles[surface.free > 0])
    near = touchable[cKDTree(surface.vertices[touchable]).query(position)[1]]
    size = np.linalg.norm(force, axis=1)
    above = np.einsum("nc,nc->n", position - surface.vertices[near], surface.normals[near])
    depth = np.where(size > 0, np.maximum(tip_radius_m - above, 0.02 * tip_radius_m), 0.02 * tip_radius_m)
    steepness = _STEEPNESS * size / depth
    vertices, row = np.unique(near, return_inverse=True)
    numbers = place_numbers(renderer, tip_radius_m, vertices)[:, row.ravel()]
    shares = rendered_share(renderer, depth / tip_radius_m, numbers)
    uncertain = felt_surface(renderer.model).uncertainty_m
    sd = uncertain[near] if len(uncertain) == len(surface.vertices) else np.zeros(len(size))
    measured = len(renderer.model.presses) and not is_given(renderer.model)
    onset = ONSET_NOISE_M if measured else 0.0
    law = np.hypot(shares * size, _on_rims(renderer, position, size, numbers[2], near, tip_radius_m))
    return ForceErrors(
        law,
        modulus_share(renderer.model) * size,
        SURE * sd * steepness,
        SURE * onset * steepness,
    )


def modulus_share(model: Model) -> float:
    """Half width of the modulus's 95 % interval over it; 0 of one that is stated and not measured."""
    low, high = model.material.young_modulus_ci95_pa
    return 0.5 * (high - low) / model.material.young_modulus_pa if np.isfinite([low, high]).all() else 0.0


def _on_rims(
    renderer: FemRenderer,
    position: np.ndarray,
    size: np.ndarray,
    rim: np.ndarray,
    vertex: np.ndarray,
    tip_radius_m: float,
) -> np.ndarray:
    """(n,) N by which forces size (n,) N may be off on and beside sharp rims, how near they are (n,);
    vertex: (n,) of the surface, nearest to each.

    The contact normal turns within a strip (render.surface.shaped), so a tip beside a rim is felt when it
    overlaps the object already, and one on it is felt as on plane ground. What is felt too late is no more
    than the object's own stiffness makes of that way.
    """
    surface, material = renderer.contact.arrays, renderer.model.material
    beside = np.flatnonzero(rim > _BESIDE_RIM)
    off = np.zeros(len(size))
    if not len(beside):
        return off
    far = renderer.far_at(vertex[beside])
    near, felt, turned, give = np.zeros((4, len(beside)))
    weights, stack = np.zeros(3), np.zeros(STACK, dtype=np.int64)
    point, normal, move = np.zeros((3, 3))
    for k, tip in enumerate(position[beside]):
        triangle, distance = closest_triangle(
            surface.bvh, surface.vertices, surface.triangles, tip, tip_radius_m, weights, stack
        )
        if triangle >= 0 and surface.free[triangle]:
            near[k] = tip_radius_m - distance
            away = (tip - weights @ surface.vertices[surface.triangles[triangle]]) / distance
            give[k] = away @ far[k] @ away
            triangle, height = foot(surface, triangle, weights, tip, point, normal, move)
            felt[k] = tip_radius_m - height
            facing = facings(surface.vertices, surface.triangles[triangle][None])[0][0]
            turned[k] = (1 - normal @ facing / np.linalg.norm(facing)) / _BETWEEN
    felt = np.clip(felt, 0.0, near)
    given = (material.young_modulus_pa, material.poisson_ratio, tip_radius_m)
    hertz = dent_law("hertz")
    late = Bound.late.value * (hertz.force(near, *given) - hertz.force(felt, *given))
    most = material.young_modulus_pa * (near - felt) / np.maximum(give, 1e-12)
    late = np.minimum(late, np.where(give > 0, most, np.inf))
    edge = Bound.edge.value * turned * np.exp(-felt / (Bound.dented.value * tip_radius_m))
    off[beside] = np.hypot(late, edge * size[beside])
    return off


def error_figures(errors: ForceErrors | None) -> dict[str, float]:
    """Keys of `--json`: rms over the samples; nothing where nothing is known."""
    if errors is None:
        return {}
    parts = {"force_error_n": errors.law_n, "modulus_error_n": errors.modulus_n}
    parts |= {"shape_error_n": errors.shape_n, "first_touch_error_n": errors.first_touch_n}
    return {key: float(np.sqrt(np.mean(np.square(part)))) for key, part in parts.items()}


def said(figures: dict[str, float], *, from_touch: bool = False) -> str:
    """The figures in words; '' for none. from_touch: the depth counts from first touch, wherever it lay."""
    if not figures:
        return ""
    law, modulus, shape, touch = (1e3 * value for value in figures.values())
    ours, whole = np.hypot(law, modulus), np.linalg.norm([law, modulus, shape, touch])
    named = "for the law and the modulus" if modulus else "for the law"
    if whole == ours:
        return f"may be off (95 %) by {ours:.3g} mN {named}"
    if from_touch:
        return (
            f"may be off (95 %) by {ours:.3g} mN {named}, this deep from first touch; by {whole:.3g} mN at "
            "this very position, as its surface may lie elsewhere"
        )
    return (
        f"may be off (95 %) by {whole:.3g} mN: {ours:.3g} {named}, {shape:.3g} for where its surface lies, "
        f"{touch:.3g} for its first touches (squares add up)"
    )


def coarse_error(model: Model, compliance: CoarseCompliance, options: RenderOptions) -> tuple[float, float]:
    """(N, m): within which the force of a straight press of this depth stays, at 95 % of places, for that
    some are not solved: at each of the first places against what the others alone tell of it; and for that
    its elements are rough.

    Farther from its neighbours than any place between them, one that is left out says more than the error.
    """
    first = compliance.first
    points, normals = compliance.own_points[first], compliance.own_normals[first]
    tip, depth = model.tool.tip_radius_m, COARSE_DEPTH * model.tool.tip_radius_m
    curvature = contact_curvature(model.mesh, points, normals, tip)
    law = rendered_touch(model, options).law_of_dent(model.material.poisson_ratio)
    steps = np.linspace(0.0, depth, _STEPS)
    path = (-steps[None, :, None] * normals[:, None]).reshape(-1, 3)
    solved, told = (
        touch_forces(
            path,
            _STEPS * np.arange(len(first) + 1),
            TouchedPlaces(normals, far, curvature),
            young_modulus_pa=model.material.young_modulus_pa,
            poisson_ratio=model.material.poisson_ratio,
            tip_radius_m=tip,
            law=law,
        )[_STEPS - 1 :: _STEPS]
        for far in compliance.left_out()
    )
    missed = np.hypot(*(np.linalg.norm(each, axis=1) for each in (told - solved, compliance.rough * solved)))
    return float(np.quantile(missed, 0.95)), depth


def place_numbers(
    renderer: FemRenderer, tip_radius_m: float, vertices: np.ndarray | slice = slice(None)
) -> np.ndarray:
    """(8, k) at k vertices of the contact surface, all unless some are asked for: |curvature| times the tip's
    radius; how far a push along the normal moves the surface sideways (`way_aside`); how near a rim and how
    near the base it is (mechanics.contact.edges.nearness); `uneven_curvature` times the tip's radius; how
    wide a contact is beside a wall (`_through`); how much of a patch that is too wide reaches over rims
    (`_coarsely`); how much of one would lie below the base's outline, times the tip's radius over the patch's
    width."""
    surface, mesh, parameters = renderer.contact.arrays, renderer.model.mesh, renderer.parameters
    points, normals, far = surface.vertices[vertices], surface.normals[vertices], renderer.far_at(vertices)
    along = np.einsum("vab,vb->va", far, normals)
    give = np.einsum("va,va->v", along, normals)
    sideways = np.linalg.norm(along - give[:, None] * normals, axis=1)
    bent = np.abs(parameters.curvature[vertices])
    rim, base = nearness(mesh, points, normals)
    uneven = uneven_curvature(mesh, points, normals, tip_radius_m) * tip_radius_m
    wall = _through(renderer.model, points, normals, tip_radius_m)
    coarse = _coarsely(renderer, points, tip_radius_m)
    aside = way_aside(give, sideways, tip_radius_m)
    foot = foot_within(mesh, points) * tip_radius_m / usual_width(mesh)
    return np.stack([bent * tip_radius_m, aside, rim, base, uneven, wall, coarse, foot])


def thickness_under(
    shape: TrueShape, points: np.ndarray, normals: np.ndarray, tip_radius_m: float
) -> np.ndarray:
    """(k,) m of a known shape below its places; infinite where nothing lies behind."""
    # rays meet the triangles, which lie a little beside the curved shape's places
    beyond = _SAGITTA * tip_radius_m
    return first_hits(shape.vertices, shape.triangles, points, -normals, beyond=beyond, leaving=True)[0]


def _through(model: Model, points: np.ndarray, normals: np.ndarray, tip_radius_m: float) -> np.ndarray:
    """(k,) squared, the width of a contact over the thickness of a known shape's wall with air behind it; 0
    over the support, or where no shape is known."""
    shape, width = model.mesh.shape, contact_width(tip_radius_m)
    if shape is None or not len(points):
        return np.zeros(len(points))
    thick = thickness_under(shape, points, normals, tip_radius_m)
    free = np.isfinite(thick)
    behind = points[free] - thick[free, None] * normals[free]
    free[free] = model.support.height(behind) > _SAGITTA * tip_radius_m
    return np.where(free, np.square(width / np.where(free, thick, 1.0)), 0.0)


def _coarsely(renderer: FemRenderer, points: np.ndarray, tip_radius_m: float) -> np.ndarray:
    """(k,) rims within a patch's reach, times the tip's radius over the patch's width; none where elements
    are as fine as touches ask for: there rims are made up for (mechanics.contact.edges)."""
    mesh, width = renderer.model.mesh, float(renderer.compliance.own_width_m[0])
    excess = max(0.0, 1 - patch_width(mesh, surface_edge(mesh)) / width)
    return (
        excess * tip_radius_m / width * ends_within(mesh, points, width) if excess else np.zeros(len(points))
    )


def way_aside(give: np.ndarray, sideways: np.ndarray, tip_radius_m: float | np.ndarray) -> np.ndarray:
    """(k,) how far a push moves the surface sideways beside what gives way to it: about the dent on a compact
    object, the object itself where it bends, which is solved as such.

    give, sideways: (k,) 1/m, compliance along the normal and across it, unit modulus.
    """
    return sideways * tip_radius_m / np.maximum(give * tip_radius_m, 1.0)


def rendered_share(renderer: FemRenderer, depth: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """`law_share` at the renderer's own Poisson's ratio and friction. numbers: (8, ...), place_numbers."""
    given = renderer.parameters
    nu, mu = float(given.poisson_ratio[0]), float(given.friction[0])
    return law_share(depth, *numbers, poisson_ratio=nu, friction=mu)


def law_share(
    depth: np.ndarray,
    bent: np.ndarray,
    sideways: np.ndarray,
    rim: np.ndarray,
    base: np.ndarray,
    uneven: np.ndarray | float = 0.0,
    wall: np.ndarray | float = 0.0,
    coarse: np.ndarray | float = 0.0,
    foot: np.ndarray | float = 0.0,
    *,
    poisson_ratio: float = USUAL_POISSON_RATIO,
    friction: float = np.inf,
) -> np.ndarray:
    """Half width of the law's 95 % interval over the force; depth in tip radii, then eight place_numbers;
    friction: Coulomb's coefficient."""
    terms = (
        Bound.floor.value,
        Bound.deep.value * depth,
        Bound.bent.value * bent * depth,
        Bound.sideways.value * sideways,
        Bound.rim.value * rim,
        Bound.base.value * base,
        Bound.uneven.value * uneven,
        Bound.wall.value * wall,
        Bound.coarse.value * coarse * np.sqrt(depth),
        Bound.foot.value * foot * np.sqrt(depth),
        Bound.ratio.value * max(USUAL_POISSON_RATIO - poisson_ratio, 0.0),
        Bound.slip.value * np.exp(-friction / Bound.slippery.value) * depth,
    )
    return np.sqrt(sum(np.square(term) for term in terms))
