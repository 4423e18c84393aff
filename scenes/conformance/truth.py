"""The true force along a path, and by how much it may be off.

Truth is that of an isotropic elastic solid with E and nu where strains are small: the mean of two laws, whose
distance stands in the bound, so that no simulator is blamed for its own. A half-space's is closed: Hertz's
force, Mindlin's (1949) partial slip, and for two tips each other's Boussinesq displacement. Of the other
bodies the press is solved; a slide is Mindlin's on a body that moves along as the solved one does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.scenes.conformance.cases import (
    BESIDE_M,
    BODIES,
    FRICTION,
    MESH_SHARE,
    POISSON,
    RATE_HZ,
    SHAPE_M,
    SLIP_SHARE,
    STUCK,
    TIP_M,
    YOUNG_PA,
    Body,
    pressed,
    strokes,
)

PLANE_PA = YOUNG_PA / (1 - POISSON**2)
FLOOR_M = 2e-5
"""Depth on a half-space whose force is the least bound."""


@dataclass(frozen=True)
class TipPath:
    """One tip's path. name: of its files; t (n,) s; way (n, 2) m: below first touch, and slid; centre (n, 3)
    m; force (n, 3) N on the tool; bound (n,) N, half width of its length's 95 % interval."""

    name: str
    body: Body
    normal: np.ndarray
    t: np.ndarray
    way: np.ndarray
    centre: np.ndarray
    force: np.ndarray
    bound: np.ndarray


def cases() -> dict[str, list[TipPath]]:
    """The tips of every case: one on each of the six bodies, then two on the half-space."""
    return {**{body.name: [alone(body)] for body in BODIES}, "two-tips": pair(BODIES[0])}


def hertz(depth: np.ndarray) -> np.ndarray:
    """(n,) N for depths (n,) m of the tip in a half-space."""
    return 4 / 3 * PLANE_PA * np.sqrt(TIP_M) * np.maximum(depth, 0.0) ** 1.5


def mindlin(
    push: np.ndarray, depth: np.ndarray, slid: np.ndarray, gives: float = 0.0, gains: float = 0.0
) -> np.ndarray:
    """(n,) N that hold back a tip that slid by (n,) m at constant depth (n,) m, pushed by (n,) N before.

    gives: m/N, by which the body moves along more than a half-space does; gains: N of push for each newton
    that holds the tip back.
    """
    shear = YOUNG_PA / (2 + 2 * POISSON)
    held = 8 * shear * np.sqrt(TIP_M * np.maximum(depth, SHAPE_M)) / (2 - POISSON)
    most = np.maximum(FRICTION * push / (1 - FRICTION * gains), 1e-12)
    low, high = np.zeros_like(push), most.copy()
    for _ in range(60):
        middle = (low + high) / 2
        own = 1.5 * most / held * (1 - (1 - middle / most) ** (2 / 3)) + gives * middle
        low, high = np.where(own < slid, middle, low), np.where(own < slid, high, middle)
    return np.where(slid > 0, low, 0.0)


def alone(body: Body) -> TipPath:
    """One tip on a body."""
    way, solved = strokes(body.depth_m), body.solved
    depth, slid = way.T
    laws = pressed(body, depth)
    force = hertz(depth)[:, None] * solved.normal if body.name == "half-space" else laws.mean(axis=0)
    off = np.linalg.norm(laws - force, axis=2).max(axis=0)
    aside, gives = _aside(body)
    held = mindlin(force @ solved.normal, depth, slid, gives, float(aside @ solved.normal))
    return _tip(body.name, body, solved.place, way, force + held[:, None] * aside, off + SLIP_SHARE * held)


def _aside(body: Body) -> tuple[np.ndarray, float]:
    """((3,) what the force gains for each newton that holds the tip back, m/N by which the body moves along
    more than a half-space), from the solved tip that sticks and is moved sideways."""
    solved = body.solved
    if body.name == "half-space":
        return -solved.along, 0.0
    gained = (solved.force[:, -1] - solved.force[:, -2]).mean(axis=0)
    held = -float(gained @ solved.along)
    shear = YOUNG_PA / (2 + 2 * POISSON)
    own = (2 - POISSON) / (8 * shear * np.sqrt(TIP_M * body.depth_m))
    return gained / held, STUCK * body.depth_m / held - own


def pair(body: Body) -> list[TipPath]:
    """Two tips on the half-space; the second comes while the first rests."""
    ways = [strokes(body.depth_m, slides=False, after_s=wait) for wait in (0.0, 0.06)]
    longest = max(map(len, ways))
    ways = [np.vstack([way, np.repeat(way[-1:], longest - len(way), axis=0)]) for way in ways]
    per_newton = 1 / (np.pi * PLANE_PA * BESIDE_M)
    push = [np.zeros(longest), np.zeros(longest)]
    for _ in range(60):
        push = [hertz(ways[k][:, 0] - per_newton * push[1 - k]) for k in (0, 1)]
    tips = []
    for k, name in enumerate(("two-tips-a", "two-tips-b")):
        place = body.solved.place + k * BESIDE_M * np.array([1.0, 0.0, 0.0])
        force = push[k][:, None] * body.solved.normal
        # as a share of the force the laws differ as they do for one tip; beyond its circle the other's
        # displacement is that of a point to (a / distance)^2 of itself
        single = hertz(ways[k][:, 0])
        laws = pressed(body, ways[k][:, 0])
        off = np.linalg.norm(laws - single[:, None] * body.solved.normal, axis=2).max(axis=0)
        off = off * push[k] / np.maximum(single, 1e-12)
        off = off + np.abs(single - push[k]) * TIP_M * body.depth_m / BESIDE_M**2
        tips.append(_tip(name, body, place, ways[k], force, off))
    return tips


def _tip(
    name: str, body: Body, place: np.ndarray, way: np.ndarray, force: np.ndarray, off: np.ndarray
) -> TipPath:
    normal, along = body.solved.normal, body.solved.along
    centre = place + (TIP_M - way[:, :1]) * normal + way[:, 1:] * along
    size = np.linalg.norm(force, axis=1)
    steep = 1.5 * size / np.maximum(way[:, 0], SHAPE_M)
    bound = off + MESH_SHARE * size + SHAPE_M * steep + hertz(np.array([FLOOR_M]))[0]
    return TipPath(name, body, normal, np.arange(len(way)) / RATE_HZ, way, centre, force, bound)
