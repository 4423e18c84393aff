"""Inclusion: a stiffer (or softer) ball inside. Felt at the places above it.

The energy that lies in the ball under a contact (contact_energies) changes by Eshelby's factor of a spherical
inclusion in an incompressible solid, so that a hard ball does not vanish from the sum: share = 5 (m - 1) /
(2 m + 3). That is first order, which finds a ball; at a fit it is multiplied, place by place, so that it
equals the change that a renderer of the ball has there (`refine`), whose mesh is fine around it, and so does
the bend of the dent's law. Fitting again moves the ball.

A ball lies inside: its radius is at most its centre's depth below the surface. One that broke through would
have the tip touch it, and first order knows nothing of that.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.compliance.contact_energies import contact_energies
from palpate.mechanics.compliance.near_field import BallLaw, depth_law
from palpate.mechanics.compliance.pressed_places import Places
from palpate.mechanics.compliance.sites import LoadPatch, patch_width, touch_sites, touch_solver
from palpate.mechanics.contact.edges import edge_law
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope
from palpate.mechanics.effects.hints import Misfit, SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene
from palpate.mechanics.model.material import BALL, Ball
from palpate.mechanics.model.model import Model
from palpate.mechanics.shape.nearest import closest

RATIO_LIMITS = (0.15, 20.0)
GRID_M = 0.007
RADII_M = (0.006, 0.010, 0.015)
REACH_M = 0.05
"""From the nearest pressed place: a ball of 15 mm so far off changes a contact's compliance by less than a
hundredth of it, as strain energy falls with the fourth power of the distance."""
STARTS = 6
LEAST_M = 1e-3
"""Of a ball that lies inside: what is smaller is not felt."""
_SOLVED = "inclusion, solved"
_SCALE_LIMITS = (0.2, 8.0)
FOUND = "diagnosed"
LOG_RATIOS = (-1.2, -0.5, 0.5, 1.2, 2.2)
_MOST_GONE = 0.8
_MIRROR = 0.4
"""Of a ball's image in the free surface, which weakens a hard one and helps a soft one: with it first order
is 0.83 to 1.22 times what a mesh fine around the ball gives (six balls, 3 to 15 mm below the top of a
cylinder, at all places that feel them; 1.38 without)."""
_KNOWN = 16
"""Balls that are remembered: a fit moves first touches, and other effects, many times beside one ball."""


def softness(ratio: float) -> float:
    """Factor on the compliance of the ball's elements for a modulus ratio (Eshelby, nu = 0.5)."""
    return 1 - 5 * (ratio - 1) / (2 * ratio + 3)


def depths(points: np.ndarray, places: Places) -> np.ndarray:
    """(k,) m, of points (k, 3) below the nearest surface of the object; negative outside."""
    mesh = places.model.mesh
    triangles = mesh.surface[:, :3]
    foot, index, _ = closest(mesh.points, triangles, points)
    a, b, c = np.moveaxis(mesh.points[triangles[index]], 1, 0)
    outwards = np.einsum("kx,kx->k", np.cross(b - a, c - a), points - foot)
    return np.linalg.norm(points - foot, axis=1) * np.where(outwards > 0, -1.0, 1.0)


def _nearness(centres: np.ndarray, radii: np.ndarray, places: Places) -> np.ndarray:
    """(k,) radius of each ball over its centre's distance to the surface that may be touched."""
    mesh = places.model.mesh
    foot = closest(mesh.points, mesh.touchable_surface[:, :3], centres)[0]
    return radii / np.maximum(np.linalg.norm(centres - foot, axis=1), radii)


def inside_object(values: np.ndarray, places: Places) -> np.ndarray:
    """The values with the radius held to what lies inside the object, so (5,)."""
    held = np.array(values, dtype=float)
    held[3] = min(held[3], max(float(depths(held[None, :3], places)[0]), LEAST_M))
    return held


def first_order(values: np.ndarray, places: Places) -> BallLaw:
    """(p, 3, 3) 1/m, change of each press's compliance, and (p,) of its bracing, unit modulus; first order in
    the ball's energy, under contacts of two depths."""
    known: dict[bytes, BallLaw] = places.stage("balls", dict)
    key = values.tobytes()
    if key not in known:
        if len(known) >= _KNOWN:
            del known[next(iter(known))]
        known[key] = _first_order(values, places)
    return known[key]


def _first_order(values: np.ndarray, places: Places) -> BallLaw:
    held = inside_object(values, places)
    far, normal = contact_energies(places).held(held[:3], held[3])
    times = _change_of(held[4], float(_nearness(held[None, :3], held[3:4], places)[0]))
    shallow, deep = times * normal
    model = places.model
    nu, tip = model.material.poisson_ratio, model.tool.tip_radius_m
    whole, bend = depth_law(shallow, deep, np.ones(len(deep)), nu, tip)
    far = times * far
    far[:, 0, 0] += whole - deep
    return BallLaw(far[places.place], bend[places.place] / tip)


def _change_of(log_ratio: float, nearness: float) -> float:
    """The factor on the energy that a ball holds which gives the change of the compliance."""
    change = softness(np.exp(log_ratio)) - 1
    return change / (1 - _MIRROR * change * nearness**3)


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    far, bracing = first_order(values, scene.places)
    known = scene.places.stages.get(_SOLVED)
    if known is not None:
        scale, bent = known
        bracing = bracing * scale + far[:, 0, 0] * bent
        far = far * scale[:, None, None]
    settings.bracing = settings.bracing + bracing
    settings.far = settings.far + far


def _refine(scene: TouchedScene, values: np.ndarray) -> None:
    """Hold how much the ball changes each place, where a mesh fine around it is solved, over what first order
    says: its compliance (p,), and what is left of the bracing, (p,) a unit of that."""
    places = scene.places
    first = first_order(values, places)
    along = first.far[:, 0, 0]
    exact, bracing = (each[places.place] for each in solved_change(ball_of(values, places), places))
    known = np.abs(along) > 1e-3 * np.abs(along).max()
    over = np.where(known, along, 1.0)
    scale = np.clip(np.where(known, exact / over, 1.0), *_SCALE_LIMITS)
    # no more of one than of the other
    share = np.divide(scale * along, exact, out=np.zeros_like(exact), where=known & (exact != 0))
    left = np.clip(share, 0.0, 1.0) * bracing - scale * first.bracing
    places.stages[_SOLVED] = scale, np.where(known, left / over, 0.0)


def solved_change(ball: Ball, places: Places) -> tuple[np.ndarray, np.ndarray]:
    """(q,) 1/m each: change of each place's normal compliance, unit modulus, under the load that a renderer
    takes where there are balls, and of its bracing."""
    model = places.model
    mesh, nu = model.mesh.quadratic(), model.material.poisson_ratio
    ratio, stretch = model.solid_ratio, model.stretch_m
    uniform = np.ptp(ratio) == 0
    solver = touch_solver(mesh, nu, None if uniform else ratio, balls=(ball,), stretch_m=stretch)
    point, normal = places.point[places.first], places.normal[places.first]
    width = patch_width(solver.mesh) if uniform else None
    patch = LoadPatch(width, model.tool.tip_radius_m, balls=True)
    sites = touch_sites(mesh, point, normal, nu, solver=solver, curvature=0.0, patch=patch)
    far, bracing = sites.far, sites.bracing
    if uniform:  # a width that is given leaves edges out
        missed = edge_law(mesh, point, normal)
        far, bracing = far + missed.far, bracing + missed.bracing
    along = np.einsum("qi,qij,qj->q", normal, far, normal)
    return along - places.far[places.first, 0, 0], bracing - places.bracing[places.first]


def ball_of(values: np.ndarray, places: Places) -> Ball:
    """The ball that a fit's values (5,) stand for."""
    x, y, z, radius, log_ratio = map(float, inside_object(values, places))
    return Ball((x, y, z), radius, float(np.exp(log_ratio)))


def _seek(scene: TouchedScene, misfit: Misfit) -> list[np.ndarray]:
    """Balls on a grid inside the object, ranked by how well they explain the places' stiffness, with a free
    common factor: first order, but a place gives way no less than nothing."""
    places = scene.places
    energies = contact_energies(places)
    centres = _centres(energies.point, places.point)
    deep = np.maximum(depths(centres, places), LEAST_M)
    weight = misfit.weight / misfit.weight.sum()
    level = misfit.level - weight @ misfit.level
    found = []
    for radius in RADII_M:
        held = np.minimum(radius, deep)
        for centre, own, close in zip(centres, held, _nearness(centres, held, places), strict=True):
            energy = energies.pushed(centre, own).mean(axis=0)
            for log_ratio in LOG_RATIOS:
                # the share of the give that goes with the ball
                gone = misfit.answer * _change_of(log_ratio, close) * energy[places.place]
                stiffer = gone / (1 - np.minimum(gone, _MOST_GONE))
                stiffer -= weight @ stiffer
                found.append((float(weight @ (level - stiffer) ** 2), (*centre, radius, log_ratio)))
    found.sort(key=lambda item: item[0])
    starts: list[np.ndarray] = []
    for _, start in found:
        if all(np.linalg.norm(np.subtract(start[:3], s[:3])) > 1.5 * GRID_M for s in starts):
            starts.append(np.array(start))
        if len(starts) == STARTS:
            break
    return starts


def _centres(centroid: np.ndarray, pressed: np.ndarray) -> np.ndarray:
    """(c, 3) m, of a grid, those that lie in the object and no farther from all pressed places than is
    felt."""
    low, high = centroid.min(axis=0), centroid.max(axis=0)
    axes = [np.arange(a + GRID_M / 2, b, GRID_M) for a, b in zip(low, high, strict=True)]
    centres = np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1).T
    centres = centres[cKDTree(pressed).query(centres)[0] < REACH_M]
    return centres[cKDTree(centroid).query(centres)[0] < GRID_M]


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    ball = ball_of(values, scene.places)
    return {
        "centre_m": list(ball.centre_m),
        "radius_m": ball.radius_m,
        "modulus_ratio": ball.modulus_ratio,
    }


def _apply(model: Model, keys: Keys) -> Model:
    known = model.material.inclusions
    return model.with_material(inclusions={**known, f"{FOUND}-{len(known) + 1}": Ball(**keys)})


EFFECT = Effect(
    name="inclusion",
    domain="object",
    scope=Scope.PLACES,
    words="a harder or softer lump lies inside",
    parameters=(
        *(Parameter(f"centre_{a}_m", "m", -10.0, 10.0, 0.0, (0.0,), 1e-3) for a in "xyz"),
        Parameter("radius_m", "m", 3e-3, 0.03, 8e-3, (8e-3,), 5e-4, 0.006),
        Parameter(
            "log_ratio", "ln 1", np.log(RATIO_LIMITS[0]), np.log(RATIO_LIMITS[1]), 0.0, (1.0, -0.7), 0.05, 1.5
        ),
    ),
    keys=BALL,
    report=_report,
    change=_change,
    apply=_apply,
    hints=SearchHints(
        seek=_seek,
        refine=_refine,
        few_places=True,
        # a large soft ball and a small hard one look alike
        systematic=(3e-3, 3e-3, 3e-3, 4e-3, 0.7),
        signed=(4,),
    ),
)
