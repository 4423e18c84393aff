"""The base traced once more: how far the object, or the frame that it is read in, moved in between.

A surface that is fitted to the presses hides a move: it stands where it was pressed. Two tracings of one base
do not: the first, moved as the object was, must lie on the second, in height as well as around the foot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from palpate.diagnosis.instrument.jackknife import all_but_one, covariance
from palpate.diagnosis.instrument.support_readings import KINDS, on_support
from palpate.mechanics.frames import tangents
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording

GROUPS = 10
"""Stretches of either tracing that are left out in turn for standard errors."""
AROUND_M = 0.01
"""Of a place on the first tracing, whose points say how the outline runs there."""
LEAST_BLOCKS = 30
ROUNDS = 30
TURNED, OFF_M = 0.03, 0.5e-3
"""rad, m: how far an object turns on its base, where that is round and shows nothing of it, against how far
the outline is off over a stretch."""
STRETCH = 6
"""Blocks of a stretch: a hand leans in and out once or twice a second."""


@dataclass(frozen=True)
class Move:
    """What carries the first tracing onto the second: a turn, a rotation vector (3,) rad about `centre`, and
    a shift (3,) m, device frame. error: (6, 6) covariance of both, shift first."""

    shift: np.ndarray
    turn: np.ndarray
    centre: np.ndarray
    error: np.ndarray

    def along(self, point: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """((p,) m by which places (p, 3) on the object went along their normals, (p, p) covariance)."""
        arm = np.cross(point - self.centre, normal)
        columns = np.hstack([normal, arm])
        return columns @ np.concatenate([self.shift, self.turn]), columns @ self.error @ columns.T


def move_of(recording: Recording, presses: Presses, normal: np.ndarray, centre: np.ndarray) -> Move | None:
    """Read the move off the two tracings; None where one of them is missing or too short.

    normal: (3,) of the support, outward. centre: (3,) m, what a turn is about.
    """
    rows = on_support(recording, presses, normal)
    if rows is None:
        return None
    first, again = (rows.place[rows.kind == KINDS.index(k)] - centre for k in ("trace", "retrace"))
    if min(len(first), len(again)) < LEAST_BLOCKS:
        return None
    axes = np.vstack([*tangents(normal), normal])
    first, again = first @ axes.T, again @ axes.T
    found = _carried(first, again)
    without_first = [_carried(first[p], again, found) for p in all_but_one(len(first), GROUPS)]
    without_again = [_carried(first, again[p], found) for p in all_but_one(len(again), GROUPS)]
    error = covariance(np.array(without_first)) + covariance(np.array(without_again))
    both = np.kron(np.eye(2), axes.T)
    shift, turn = (both @ found).reshape(2, 3)
    return Move(shift, turn, centre, both @ error @ both.T)


def _carried(first: np.ndarray, again: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """(6,) shift and turn that carry points (k, 3) of one tracing onto another's (n, 3), z along the normal:
    iterated closest points on the lines of the outline (Chen and Medioni 1992), without what is far off."""
    tree = cKDTree(first[:, :2])
    across = np.array([_across(first[near, :2]) for near in tree.query_ball_point(first[:, :2], AROUND_M)])
    height = np.linalg.lstsq(np.column_stack([np.ones(len(first)), first[:, :2]]), first[:, 2], rcond=None)[0]
    move = np.zeros(6) if start is None else start.copy()
    if start is None:
        move[:3] = np.median(again, axis=0) - np.median(first, axis=0)
    for k in range(ROUNDS):
        back = Rotation.from_rotvec(move[3:]).inv().apply(again - move[:3])
        _, at = tree.query(back[:, :2])
        flat = ((back[:, :2] - first[at, :2]) * across[at]).sum(axis=1)
        over = back[:, 2] - np.column_stack([np.ones(len(back)), back[:, :2]]) @ height
        side = np.column_stack([across[at], np.zeros(len(at))])
        up = np.broadcast_to([0.0, 0.0, 1.0], back.shape)
        columns = np.vstack([np.hstack([n, np.cross(back, n)]) for n in (side, up)])
        off = np.concatenate([flat, over])
        limit = 4 * max(OFF_M, 1e-3 * (10 - k))
        weight = (np.abs(off) < limit).astype(float)
        system = (columns * weight[:, None]).T @ columns
        held = STRETCH * (OFF_M / TURNED) ** 2
        system[5, 5] += held
        wanted = (columns * weight[:, None]).T @ off
        wanted[5] -= held * move[5]
        step = np.linalg.solve(system, wanted)
        turned = Rotation.from_rotvec(move[3:])
        move[:3] += turned.apply(step[:3])
        move[3:] = (turned * Rotation.from_rotvec(step[3:])).as_rotvec()
        if np.abs(step).max() < 1e-7 and k > 10:
            break
    return move


def _across(near: np.ndarray) -> np.ndarray:
    """(2,) unit vector across the outline through places (k, 2): where they differ least."""
    return np.linalg.svd(near - near.mean(axis=0))[2][-1]
