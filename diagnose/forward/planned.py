"""Presses that were not made: every known press done over in another way, for a prediction."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.side_of_play import sides

DEEPEST_M = 0.009
CLEARANCE_M = 2e-3
STEP_S = 0.01


@dataclass(frozen=True)
class Plan:
    """One way of pressing. depth: of the greatest so far, 1. speed: m/s. hold: s. drag: m. times: 1 or 2."""

    depth: float
    speed: float
    hold: float
    drag: float
    times: int

    def depth_m(self, touches: Presses) -> float:
        """m, over presses that were made."""
        return self.depth * float(touches.deepest.max())


def pressed(forward: Forward, plan: Plan) -> Presses:
    """Every known press done over by a plan, each a site of its own."""
    t = forward.touches
    into, along = _path(min(plan.depth_m(t), DEEPEST_M), plan)
    n, p = len(into), len(t)
    local = np.column_stack([into, along, np.zeros(n)])
    clock = STEP_S * np.arange(n)
    contact = np.flatnonzero(into > 0)
    centre = t.point + forward.tip_radius * t.normal
    position = (centre[:, None] - np.einsum("pij,ni->pnj", t.frame, local)).reshape(-1, 3)
    each_way = [sides(clock, position[i * n : (i + 1) * n]) for i in range(p)]
    lead, unsure = (np.concatenate(each) for each in zip(*each_way, strict=True))
    turned = None if t.quaternion is None else np.repeat(t.quaternion[t.starts[:-1]], n, axis=0)
    none = np.zeros_like(position)
    return dataclasses.replace(
        t,
        starts=n * np.arange(p + 1),
        t=np.tile(clock, p),
        position=position,
        force=none,
        free_air=none,
        quaternion=turned,
        columns={"lead": lead, "unsure": unsure},
        site=np.arange(p),
        onset_s=np.full(p, clock[contact[0]]),
        peak_s=np.full(p, clock[int(np.argmax(into))]),
        end_s=np.full(p, clock[contact[-1]]),
    )


def _path(depth: float, plan: Plan) -> tuple[np.ndarray, np.ndarray]:
    """(n,) m travel into the object and sideways, from the air to the air."""
    times, into, side = [0.0], [-CLEARANCE_M], [0.0]

    def go(seconds: float, to: float, across: float) -> None:
        times.append(times[-1] + seconds)
        into.append(to)
        side.append(across)

    way = (depth + CLEARANCE_M) / plan.speed
    for _ in range(plan.times):
        go(way, depth, 0.0)
        go(plan.hold, depth, plan.drag)
        go(way, -CLEARANCE_M, plan.drag)
        go(0.3, -CLEARANCE_M, 0.0)
    clock = np.arange(0.0, times[-1], STEP_S)
    return np.interp(clock, times, into), np.interp(clock, times, side)
