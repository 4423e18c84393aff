"""Which touches a person makes: sites spread over the surface, and the paths of the tip at each. Lengths
mm.

A press set depends on the shape, the protocol and its own number only, never on the seed of a recording:
solved curves are shared between recordings of one press set.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.errors import OptionError, SceneError
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.phantoms import Phantom


@dataclass(frozen=True)
class Protocol:
    """How much a person explores: numbers of sites and of further touches, depths in mm.

    thickness: no press is deeper than this share of the object's height. complete: the bare support is
    pressed, the tool waved and the base traced once more after the touches.
    """

    sites: int
    repeats: int
    obliques: int
    drags: int
    least_depth: float
    greatest_depth: float
    thickness: float = 0.2
    complete: bool = False


PROTOCOLS = {
    "brief": Protocol(6, 3, 1, 1, 3.0, 6.0),
    "sparse": Protocol(14, 4, 2, 1, 3.0, 7.0),
    "ordinary": Protocol(24, 9, 4, 3, 2.5, 8.0),
    "dense": Protocol(46, 18, 8, 6, 1.5, 9.0),
    "deep": Protocol(14, 4, 2, 1, 10.5, 12.0, 0.25),
    "complete": Protocol(24, 9, 4, 3, 2.5, 8.0, complete=True),
}
"""Named protocols; `brief` to `dense` differ in the number of touches, `deep` passes 10 mm at every place,
`complete` is `ordinary` and what tells the instrument and a move of the object."""

RIM_MM, FLOOR_MM = 9.0, 13.0
"""Rims are not touched within this distance, and sites lie at least this high above the support."""


@dataclass(frozen=True)
class PlannedTouch:
    """One touch: site number, point and normal (object frame), and the tip's travel from first touch.

    kind: "press" (straight along -n), "oblique" (straight, tilted), "drag" (along -n, then sideways).
    depth: greatest travel of the way in, mm. direction: unit vector of the way in. side: (3,) mm, sideways
    travel of a drag. slow: the person holds or presses slowly here. repeat: how often this site was
    touched before. reach: mm, as deep as its path is solved where that is deeper than `depth`, so that
    presses of unlike depths share a solved path. speed: mm/s, mean, of the way in; hold: s, at depth; None
    is left to the hand.
    """

    site: int
    point: np.ndarray
    normal: np.ndarray
    kind: str
    depth: float
    direction: np.ndarray
    side: np.ndarray
    repeat: int = 0
    reach: float = 0.0
    speed: float | None = None
    hold: float | None = None


def sites(phantom: Phantom, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """(points (k, 3), outward normals (k, 3)): spread by farthest-point sampling over what a hand reaches."""
    surface = TriangleSurface(phantom.vertices * 1e3, phantom.faces)
    centres, normals = surface.corners.mean(axis=1), surface.face_normals
    bottom, top = FLOOR_MM, centres[:, 2].max()
    reachable = (centres[:, 2] > bottom) & (normals[:, 2] > -0.25)
    rims = _rims(surface)
    if len(rims):
        distance = cKDTree(rims).query(centres)[0]
        reachable &= distance > RIM_MM
    if not reachable.any():
        raise SceneError(
            f"'{phantom.name}' has no place to touch {bottom:g} mm above its support and {RIM_MM:g} "
            f"mm from every rim "
            f"(it is {top:.0f} mm high): choose a larger object"
        )
    candidates = np.flatnonzero(reachable)
    weights = surface.areas[candidates] / surface.areas[candidates].sum()
    candidates = rng.choice(candidates, size=min(4000, 6 * len(candidates)), p=weights)
    points = centres[candidates]
    chosen = [int(rng.integers(len(points)))]
    nearest = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < count and nearest.max() > 4.0:
        # a hand spaces its touches roughly: any of the farther places will do
        far = np.flatnonzero(nearest > 0.8 * nearest.max())
        chosen.append(int(rng.choice(far)))
        nearest = np.minimum(nearest, np.linalg.norm(points - points[chosen[-1]], axis=1))
    on, _, _ = surface.nearest(points[chosen])
    return on, surface.normals(on)


def _rims(surface: TriangleSurface) -> np.ndarray:
    """Points along edges where the surface turns by more than 25 degrees."""
    faces = surface.faces
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    pair = (edges[:-1] == edges[1:]).all(axis=1)
    turn = (surface.face_normals[owner[:-1]] * surface.face_normals[owner[1:]]).sum(axis=1)
    sharp = pair & (turn < np.cos(np.radians(25)))
    return surface.vertices[edges[:-1][sharp]].mean(axis=1)


def press_set(phantom: Phantom, protocol: str, number: int) -> list[PlannedTouch]:
    """The touches of one exploration, in the order in which they are made.

    Raises OptionError for an unknown protocol.
    """
    if protocol not in PROTOCOLS:
        raise OptionError(f"protocol '{protocol}' is unknown; allowed are {', '.join(PROTOCOLS)}")
    plan = PROTOCOLS[protocol]
    rng = np.random.default_rng([number, plan.sites])
    points, normals = sites(phantom, plan.sites, rng)
    points, normals = np.round(points, 3), normals / np.linalg.norm(normals, axis=1)[:, None]
    thickest = plan.thickness * 1e3 * phantom.height_m
    greatest = min(plan.greatest_depth, thickest)
    depths = np.round(rng.uniform(min(plan.least_depth, greatest), greatest, len(points)) * 4) / 4
    touches: list[PlannedTouch] = []
    for k in range(len(points)):
        touches.append(_touch(k, points[k], normals[k], "press", depths[k], rng))
        share = rng.random()
        if share < plan.repeats / plan.sites * 0.6:
            touches.append(_touch(k, points[k], normals[k], "press", _shallower(depths[k], rng), rng, 1))
            if share < 0.12:
                touches.append(_touch(k, points[k], normals[k], "press", _shallower(depths[k], rng), rng, 2))
    extra = rng.permutation(len(points))
    for kind, amount in (("oblique", plan.obliques), ("drag", plan.drags)):
        for k in extra[:amount]:
            spot = max(i for i, t in enumerate(touches) if t.site == k) + 1
            visits = sum(t.site == k for t in touches)
            touches.insert(
                spot, _touch(int(k), points[k], normals[k], kind, min(depths[k], 6.0), rng, visits)
            )
        extra = np.roll(extra, -amount)
    late = max(0, plan.repeats - sum(t.repeat > 0 and t.kind == "press" for t in touches))
    for k in rng.permutation(len(points))[:late]:
        visits = sum(t.site == k for t in touches)
        touches.append(
            _touch(int(k), points[k], normals[k], "press", _shallower(depths[k], rng), rng, visits)
        )
    return touches


def _shallower(depth: float, rng: np.random.Generator) -> float:
    return max(1.0, round(depth * rng.uniform(0.65, 1.0) * 4) / 4)


def _touch(
    site: int,
    point: np.ndarray,
    normal: np.ndarray,
    kind: str,
    depth: float,
    rng: np.random.Generator,
    repeat: int = 0,
) -> PlannedTouch:
    across = rng.normal(size=3)
    across -= (across @ normal) * normal
    across /= np.linalg.norm(across)
    direction, side = -normal, np.zeros(3)
    if kind == "oblique":
        tilt = np.radians(rng.uniform(15, 32))
        direction = -np.cos(tilt) * normal + np.sin(tilt) * across
    if kind == "drag":
        side = round(rng.uniform(1.75, 3.5) * 4) / 4 * across
    return PlannedTouch(site, point, normal, kind, float(depth), direction, side, repeat)
