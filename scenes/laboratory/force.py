"""Viscoelasticity solved in the solid: each touch with its own timing, Maxwell branches at every point.

The quasi-linear law of the elastic force carries the samples between the solved states; what the solid
answers beyond it is interpolated in time. Object frame, mm, N.

From a motion and solved touches to the force on the tool: still elastic, still without an instrument. N,
mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numba
import numpy as np

from palpate.scenes.laboratory.curves import PathJob, Solving, curves
from palpate.scenes.laboratory.hand_path import Motion
from palpate.scenes.laboratory.paths import SIDEWAYS, WAY_IN, WAY_OUT, TouchForce
from palpate.scenes.laboratory.presses import PlannedTouch
from palpate.scenes.laboratory.specimen import Specimen
from palpate.scenes.laboratory.tracing import RATE_HZ
from palpate.scenes.phantoms import Phantom


@dataclass(frozen=True)
class Spacing:
    """How far apart solved states lie: whichever comes first, mm of travel or seconds."""

    travel_mm: float
    seconds: float


FINE, COARSE = Spacing(0.15, 0.02), Spacing(0.6, 0.15)
"""For the condensed object, where a state costs milliseconds, and for finite strain."""


def solved_states(
    motion: Motion, number: int, touch: PlannedTouch, spacing: Spacing
) -> tuple[np.ndarray, np.ndarray]:
    """(samples (k,) at which touch `number` is solved, the tip's travel (k, 3) mm there)."""
    rows = np.flatnonzero(motion.touch == number)
    leg, s = motion.leg[rows], motion.s[rows]
    beyond = -4.0 if touch.side.any() else -0.5
    use = np.flatnonzero(((leg == WAY_IN) & (s > 0)) | (leg == SIDEWAYS) | ((leg == WAY_OUT) & (s > beyond)))
    first, last = use[0], use[-1]
    distance = float(np.linalg.norm(touch.side))
    along = np.where(leg == SIDEWAYS, touch.depth, s)[:, None] * touch.direction
    if distance > 0:
        sideways = np.where(leg == SIDEWAYS, s, np.where(leg == WAY_OUT, distance, 0.0))
        along = along + (sideways / distance)[:, None] * touch.side
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(along, axis=0), axis=1))])
    chosen = [max(first - 1, 0)]
    for k in range(first, last + 1):
        far = length[k] - length[chosen[-1]] >= spacing.travel_mm
        turned = leg[k] != leg[k - 1] or k == last
        if far or turned or (k - chosen[-1]) / RATE_HZ >= spacing.seconds:
            chosen.append(k)
    travel = along[chosen]
    travel[0] = 0.0
    return rows[chosen], travel


def beyond_quasilinear(
    phantom: Phantom,
    specimen: Specimen,
    touches: Sequence[PlannedTouch],
    motion: Motion,
    quasilinear: np.ndarray,
    modulus_pa: float,
    solving: Solving,
) -> np.ndarray:
    """(n, 3) N: the solid's force on the tip minus `quasilinear` (n, 3), both without straying.

    specimen: with its Maxwell branches. Raises LabError.
    """
    spacing = COARSE if specimen.finite else FINE
    jobs, samples = [], []
    for number, touch in enumerate(touches):
        at, travel = solved_states(motion, number, touch, spacing)
        samples.append(at)
        times = (at - at[0]) / RATE_HZ
        jobs.append(PathJob(touch.point, touch.normal, travel.round(4), times))
    change = np.zeros_like(quasilinear)
    for at, curve in zip(samples, curves(phantom, specimen, jobs, solving), strict=True):
        rows = np.arange(at[0], at[-1] + 1)
        beyond = 1e-6 * modulus_pa * curve.force - quasilinear[at]
        change[rows] = np.column_stack([np.interp(rows, at, beyond[:, i]) for i in range(3)])
    return change


def elastic_force(motion: Motion, touches: Sequence[TouchForce], modulus_pa: float) -> np.ndarray:
    """(n, 3) N on the tool, object frame: the solved force along each path, and what straying adds.

    Straying pulls through the contact's own stiffness as the solid has it at that depth: increments add up
    while the tip stays, and are let go in proportion as the contact shrinks (the no-slip contact of
    Mindlin & Deresiewicz).
    """
    force = np.zeros_like(motion.position)
    for number, touch in enumerate(touches):
        rows = np.flatnonzero(motion.touch == number)
        if not len(rows):
            continue
        solved, stiffness = touch(motion.leg[rows], motion.s[rows])
        pressed = np.linalg.norm(solved, axis=1) > 0
        extra = _strayed(stiffness, motion.stray[rows], pressed)
        force[rows] = 1e-6 * modulus_pa * (solved + extra)
    return force


@numba.njit(cache=True)
def _strayed(stiffness, stray, pressed):
    out = np.zeros_like(stray)
    q = np.zeros(3)
    size = 0.0
    for k in range(1, len(stray)):
        now = abs(stiffness[k, 0, 0] + stiffness[k, 1, 1] + stiffness[k, 2, 2])
        if not pressed[k]:
            q[:] = 0.0
        else:
            if now < size:
                q *= now / size
            for i in range(3):
                for j in range(3):
                    q[i] += stiffness[k, i, j] * (stray[k, j] - stray[k - 1, j])
        size = now
        out[k] = q
    return out
