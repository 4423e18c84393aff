"""The pool of objects: a shape, a tip and a Poisson's ratio each, and the places where it is touched.

An object's touches are solved once, as deep as its thickness allows; each recording of it then costs seconds.
Lengths mm in the object frame, as in the laboratory.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from benchmarks.varied.shapes import shape
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import first_hits
from palpate.scenes.laboratory.curves import Solving
from palpate.scenes.laboratory.paths import touch_forces
from palpate.scenes.laboratory.presses import PlannedTouch, sites
from palpate.scenes.laboratory.solver import LabError
from palpate.scenes.laboratory.specimen import Fineness, Specimen
from palpate.scenes.phantoms import Phantom

POOL = 20
"""Objects in the pool: one of every family, its size by chance."""

SITES = 18
"""Places of an object that recordings choose from, in the order of farthest-point sampling."""

DEEPEST_MM, THICKNESS = 10.0, 0.22
"""No press is deeper than this, nor than this share of the object's thickness under it."""

DRAG_MM = 5.0
"""Deepest drag."""

FINENESS = Fineness(finest=1.5)
"""Of the laboratory's elements next to a touch, edges of 1.5 mm: at 3 mm the force on a block bends by 2.4 %
from 0.5 to 6 mm of depth, which looks like a skin; at 2 mm by 0.9 %, at 1.5 mm by 0.5 % (beside 1 mm)."""

OBLIQUE_EVERY, DRAG_EVERY = 3, 6
"""Every so many sites an oblique press, a drag may be made."""


@dataclass(frozen=True)
class Thing:
    """An object of the pool.

    phantom: shape, Poisson's ratio. tip_radius_m: of the tip that explores it. places: at each site the
    press, and the oblique press and the drag where they may be made, as deep as they are ever made.
    """

    number: int
    phantom: Phantom
    tip_radius_m: float
    places: tuple[tuple[PlannedTouch, ...], ...]


@lru_cache(maxsize=4)
def thing(number: int) -> Thing:
    """The `number`-th object: tips of 3 to 6 mm; Poisson's ratio 0.49 in half of them, else 0.40 to 0.495."""
    rng = np.random.default_rng([5, number])
    phantom = shape(number)
    if rng.random() < 0.5:
        phantom = replace(phantom, poisson_ratio=round(float(rng.uniform(0.40, 0.495)), 3))
    tip = round(float(rng.uniform(0.003, 0.006)), 4)
    points, normals = sites(phantom, SITES, rng)
    points = np.round(points, 3)
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    under = thickness(phantom, points, normals)
    places = []
    for k in range(len(points)):
        reach = max(1.5, np.floor(4 * min(DEEPEST_MM, THICKNESS * under[k])) / 4)
        places.append(_touches(k, points[k], normals[k], reach, rng))
    return Thing(number, phantom, tip, tuple(places))


def thickness(phantom: Phantom, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(k,) mm of material under surface points (k, 3) mm along their inward normals (k, 3)."""
    return first_hits(1e3 * phantom.vertices, phantom.faces, points, -normals, beyond=0.5)[0]


def _touches(
    site: int, point: np.ndarray, normal: np.ndarray, reach: float, rng: np.random.Generator
) -> tuple[PlannedTouch, ...]:
    across = rng.normal(size=3)
    across -= (across @ normal) * normal
    across /= np.linalg.norm(across)
    tilt = np.radians(rng.uniform(15, 32))
    tilted = -np.cos(tilt) * normal + np.sin(tilt) * across
    side = round(rng.uniform(1.75, 3.5) * 4) / 4 * across
    none = np.zeros(3)
    found = [PlannedTouch(site, point, normal, "press", reach, -normal, none, reach=reach)]
    if site % OBLIQUE_EVERY == 0:
        found.append(PlannedTouch(site, point, normal, "oblique", reach, tilted, none, reach=reach))
    if site % DRAG_EVERY == 0:
        found.append(PlannedTouch(site, point, normal, "drag", min(reach, DRAG_MM), -normal, side))
    return tuple(found)


def solve(number: int, progress: Progress = silent, workers: int | None = 1) -> None:
    """Solve every touch of the `number`-th object, and keep them (the laboratory's cache)."""
    it = thing(number)
    touches = [touch for place in it.places for touch in place]
    solving = Solving(workers, progress=progress, fineness=FINENESS, label=it.phantom.name)
    touch_forces(it.phantom, specimen(it), touches, solving)


def solved(number: int) -> bool:
    """Whether every touch of the `number`-th object is kept already."""

    def refuse(label: str, share: float) -> None:
        raise LabError("not solved yet")

    try:
        solve(number, refuse)
    except LabError:
        return False
    return True


def specimen(it: Thing) -> Specimen:
    """The object without any effect."""
    return Specimen(poisson_ratio=it.phantom.poisson_ratio, tip_radius=round(1e3 * it.tip_radius_m, 6))
