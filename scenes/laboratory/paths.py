"""From touches to paths to solve, and from solved curves back to the force of each touch. Object frame, mm, E
mm^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from palpate.scenes.laboratory.curves import EVERY_CORE, LOADING, PathJob, SolvedPath, Solving, curves
from palpate.scenes.laboratory.presses import PlannedTouch
from palpate.scenes.laboratory.specimen import Specimen
from palpate.scenes.phantoms import Phantom

UNLOADING = np.array([0.93, 0.82, 0.68, 0.52, 0.36, 0.22, 0.12, 0.05, 0.0])
"""States of the way out, as shares of the depth; contact may be lost before."""

BEYOND_MM, BEYOND_DRAG_MM = (0.4,), (0.4, 1.0, 1.8, 3.0)
"""States of the way out above the place of first touch: a surface that was dragged along follows the tip for
a while.
"""

WAY_IN, SIDEWAYS, WAY_OUT = 0, 1, 2
"""Legs of a touch."""


class Leg:
    """Force and stiffness along one straight part of a path, at `s` mm from where the leg is measured."""

    def __init__(self, s: np.ndarray, force: np.ndarray, stiffness: np.ndarray, from_touch: bool) -> None:
        order = np.argsort(s)
        s, force, stiffness = s[order], force[order], stiffness[order].reshape(len(s), 9)
        self._from_touch, self._low, self._high = from_touch, float(s[0]), float(s[-1])
        if from_touch:
            # near first touch F ~ s^1.5 and K ~ s^0.5: these ratios are smooth where F and K are not
            use = s > 1e-9
            self._low = float(s[use][0])
            force = force[use] / s[use, None] ** 1.5
            stiffness = stiffness[use] / np.sqrt(s[use, None])
            s = s[use]
        self._force = PchipInterpolator(s, force, axis=0)
        self._stiffness = PchipInterpolator(s, stiffness, axis=0)

    def __call__(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(force (k, 3), stiffness (k, 3, 3)) at distances s (k,); beyond the last state by its stiffness
        alone.
        """
        at = np.clip(s, self._low, self._high)
        force, stiffness = self._force(at), self._stiffness(at)
        if self._from_touch:
            positive = np.maximum(s, 0.0)
            inside = np.minimum(positive, self._high)
            force = force * inside[:, None] ** 1.5
            stiffness = stiffness * np.sqrt(inside)[:, None]
        else:
            gone = s < self._low
            force, stiffness = np.where(gone[:, None], 0.0, force), np.where(gone[:, None], 0.0, stiffness)
        return force, stiffness.reshape(-1, 3, 3)


@dataclass(frozen=True)
class TouchForce:
    """The solved force of one touch, leg by leg. `s` is the depth along the way in, or the
    distance sideways.
    """

    legs: tuple[Leg, Leg | None, Leg]

    def __call__(self, leg: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(force (k, 3), stiffness (k, 3, 3)) of samples on leg numbers (k,) at s (k,) mm."""
        force, stiffness = np.zeros((len(s), 3)), np.zeros((len(s), 3, 3))
        for number, part in enumerate(self.legs):
            use = leg == number
            if part is not None and use.any():
                force[use], stiffness[use] = part(s[use])
        return force, stiffness


def _in_and_out(touch: PlannedTouch) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(travel (k, 3), leg numbers, s) of one touch's whole path, from 0 to beyond separation."""
    way_in = LOADING * touch.depth
    travel, leg, s = [way_in[:, None] * touch.direction], [np.zeros(len(way_in), int)], [way_in]
    distance = float(np.linalg.norm(touch.side))
    if distance > 0:
        steps = np.linspace(0, distance, int(np.ceil(distance / 0.8)) + 1)[1:]
        travel.append(travel[0][-1] + steps[:, None] * touch.side / distance)
        leg.append(np.full(len(steps), SIDEWAYS))
        s.append(steps)
    beyond = BEYOND_DRAG_MM if distance > 0 else BEYOND_MM
    out = np.concatenate([UNLOADING * touch.depth, -np.array(beyond)])
    travel.append(out[:, None] * touch.direction + touch.side)
    leg.append(np.full(len(out), WAY_OUT))
    s.append(out)
    return np.vstack(travel), np.concatenate(leg), np.concatenate(s)


def _touch_force(
    curve: SolvedPath, rows: np.ndarray, leg: np.ndarray, s: np.ndarray, depth: float
) -> TouchForce:
    force, stiffness = curve.force[rows], curve.stiffness[rows]

    def part(number: int) -> Leg:
        use = leg == number
        at, f, k = s[use], force[use], stiffness[use]
        if number != WAY_IN:
            # the leg begins where the one before it ended
            first = np.flatnonzero(use)[0] - 1
            at = np.concatenate([[0.0 if number == SIDEWAYS else depth], at])
            f, k = np.vstack([force[first : first + 1], f]), np.concatenate([stiffness[first : first + 1], k])
        return Leg(at, f, k, from_touch=number == WAY_IN)

    return TouchForce((part(WAY_IN), part(SIDEWAYS) if (leg == SIDEWAYS).any() else None, part(WAY_OUT)))


def touch_forces(
    phantom: Phantom,
    specimen: Specimen,
    touches: Sequence[PlannedTouch],
    solving: Solving = EVERY_CORE,
) -> list[TouchForce]:
    """The force of every touch, for a modulus of 1; solved where the cache does not hold it.

    A reversible specimen's straight presses of one site share one curve; a specimen that remembers is
    driven through all touches of a site in their order.
    """
    if specimen.remembers:
        return _by_site(phantom, specimen, touches, solving)
    jobs: list[PathJob] = []
    places: dict[tuple, int] = {}
    plan: list[tuple[int, bool]] = []
    deepest: dict[int, float] = {}
    for touch in touches:
        if touch.kind == "press":
            deepest[touch.site] = max(deepest.get(touch.site, 0.0), touch.depth, touch.reach)
    for touch in touches:
        shared = specimen.reversible and touch.kind != "drag"
        if shared:
            depth = deepest[touch.site] if touch.kind == "press" else max(touch.depth, touch.reach)
            travel = (LOADING * depth)[:, None] * touch.direction
        else:
            travel = _in_and_out(touch)[0]
        job = PathJob(touch.point, touch.normal, travel)
        name = (touch.site, travel.round(6).tobytes())
        if name not in places:
            places[name] = len(jobs)
            jobs.append(job)
        plan.append((places[name], shared))
    solved = curves(phantom, specimen, jobs, solving)
    forces = []
    for touch, (number, shared) in zip(touches, plan, strict=True):
        curve = solved[number]
        if shared:
            leg = Leg(np.linalg.norm(curve.travel, axis=1), curve.force, curve.stiffness, from_touch=True)
            forces.append(TouchForce((leg, None, leg)))
        else:
            _, leg_numbers, s = _in_and_out(touch)
            forces.append(_touch_force(curve, np.arange(len(s)), leg_numbers, s, touch.depth))
    return forces


def _by_site(
    phantom: Phantom, specimen: Specimen, touches: Sequence[PlannedTouch], solving: Solving
) -> list[TouchForce]:
    jobs, members = [], []
    for site in sorted({t.site for t in touches}):
        mine = [k for k, t in enumerate(touches) if t.site == site]
        paths = [_in_and_out(touches[k]) for k in mine]
        jobs.append(
            PathJob(touches[mine[0]].point, touches[mine[0]].normal, np.vstack([p[0] for p in paths]))
        )
        members.append((mine, paths))
    solved = curves(phantom, specimen, jobs, solving)
    forces: dict[int, TouchForce] = {}
    for curve, (mine, paths) in zip(solved, members, strict=True):
        start = 0
        for k, (travel, leg, s) in zip(mine, paths, strict=True):
            rows = np.arange(start, start + len(travel))
            forces[k] = _touch_force(curve, rows, leg, s, touches[k].depth)
            start += len(travel)
    return [forces[k] for k in range(len(touches))]
