"""The floor under a loose part of the base: it carries what presses on it and lets go of what lifts.

What is loose slips and lifts freely in the solver; where a touch presses it down, the floor pushes back. For
a press in one direction the nodes that rest on the floor do not depend on its strength (the problem is
homogeneous), so each place has a compliance of its own: that of a press straight into it.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve
from scipy.spatial import cKDTree

from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.elastic.held_base import base_triangles
from palpate.mechanics.elastic.solver import Solver

_ROUNDS = 12
_COLUMNS = 96
_SMALL = 1e-3  # of the greatest pressure or motion: as good as none
_NEAR = 12  # places among which one that is solved already gives the guess


def carried_by_floor(
    solver: Solver, points: np.ndarray, normals: np.ndarray, patch_width_m: float
) -> np.ndarray:
    """(k, 3, 3) 1/m that the floor takes off the compliance of patches at points (k, 3) m, unit modulus.

    solver: its base bonded in part. normals: (k, 3) outward at the points.
    """
    mesh = solver.mesh
    nodes = _loose_corners(solver)
    result = np.zeros((len(points), 3, 3))
    if solver.hold is None or not len(nodes):
        return result
    up = solver.hold.normal
    average = PatchSampler(mesh, patch_width_m).matrix(points)
    compliance = np.empty((len(nodes), len(nodes)))
    reach = np.empty((len(points), 3, len(nodes)))
    for start in range(0, len(nodes), _COLUMNS):
        some = nodes[start : start + _COLUMNS]
        loads = np.zeros((len(mesh.points), 3, len(some)))
        loads[some, :, np.arange(len(some))] = up
        moved = solver.solve(loads)
        part = slice(start, start + len(some))
        compliance[:, part] = np.einsum("bxc,x->bc", moved[nodes], up)
        means = average @ moved.reshape(len(mesh.points), -1)
        reach[:, :, part] = means.reshape(len(points), 3, len(some))
    compliance = 0.5 * (compliance + compliance.T)
    near = cKDTree(points).query(points, k=min(_NEAR, len(points)))[1].reshape(len(points), -1)
    known: dict[int, np.ndarray] = {}
    for k, normal in enumerate(normals):
        guess = next((known[j] for j in near[k] if j in known), None)
        held = known[k] = resting(compliance, -normal @ reach[k], guess)
        if held.any():
            own = reach[k][:, held]
            result[k] = own @ solve(compliance[np.ix_(held, held)], own.T, assume_a="pos")
    return result


def resting(compliance: np.ndarray, motion: np.ndarray, guess: np.ndarray | None = None) -> np.ndarray:
    """(b,) bool: nodes that rest on the floor, where their motion (b,) upward without it may not go down.

    compliance: (b, b), motion a unit push of the floor. guess: (b,) bool, to begin with. Complementarity by
    switching the wrong ones until none is left, or a few rounds are over.
    """
    held = (motion < 0) if guess is None else guess.copy()
    for _ in range(_ROUNDS):
        pressure = np.zeros(len(motion))
        if held.any():
            pressure[held] = solve(compliance[np.ix_(held, held)], -motion[held], assume_a="pos")
        gap = motion + compliance @ pressure
        pulls = pressure < -_SMALL * np.abs(pressure).max()
        wrong = (held & pulls) | (~held & (gap < -_SMALL * np.abs(motion).max()))
        if not wrong.any():
            break
        held ^= wrong
    return held


def _loose_corners(solver: Solver) -> np.ndarray:
    """Corner nodes of the base that no held triangle has."""
    hold = solver.hold
    if hold is None or hold.bonded_fraction >= 1:
        return np.zeros(0, dtype=np.int64)
    corners = np.unique(base_triangles(solver.mesh)[:, :3])
    return np.setdiff1d(corners, np.unique(hold.held_triangles(solver.mesh)))
