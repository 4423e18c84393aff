"""The tool's own weight and inertia in the force readings, found in free air from its orientation.

A sensor tared in one orientation reads, in another, f = c + R(q) b - m a: c the weight in the device frame
(and the sensor's bias), b what taring took off, fixed in the tool's frame, a the acceleration of the moving
mass. Phase II is half free air: the model that most samples share is that of free air (RANSAC), whatever the
presses do.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from mechanics.kinematics import acceleration
from mechanics.recording import Recording

_SUBSAMPLE = 1500
_TRIALS = 400
_LEAST_SHARE = 0.25


def tool_weight(recording: Recording, filtered: np.ndarray, cutoff_hz: float, spread_n: float) -> np.ndarray:
    """(n, 3) N on the tool that weight and inertia make in `filtered` force (n, 3), zero where none is found.

    spread_n: noise of the filtered force, N an axis. None is found without quaternions, where too few samples
    agree, or where it is within the noise.
    """
    none = np.zeros_like(filtered)
    if recording.quaternion is None:
        return none
    q = recording.quaternion
    turned = Rotation.from_quat(q[:, [1, 2, 3, 0]]).as_matrix()
    # fits as wide as the period of the cut-off pass what the filtered force has passed
    hand = acceleration(recording.t, recording.position, width_s=1 / cutoff_hz)
    # rows of the model: constant (3), tool frame (3), minus the acceleration (1)
    model = np.concatenate([np.broadcast_to(np.eye(3), turned.shape), turned, -hand[:, :, None]], axis=2)
    rows = np.linspace(0, len(filtered) - 1, min(_SUBSAMPLE, len(filtered))).astype(int)
    best, inside = _consensus(model[rows], filtered[rows], 6 * spread_n + 0.005)
    if best is None or inside.mean() < _LEAST_SHARE:
        return none
    weight = model @ best
    return none if np.sqrt(np.mean(weight**2)) < 2 * spread_n else weight


def _consensus(model: np.ndarray, force: np.ndarray, reach_n: float) -> tuple[np.ndarray | None, np.ndarray]:
    """The parameters (7,) that most samples agree with within `reach_n`, refined on those; and which
    agree."""
    random = np.random.default_rng(0)
    best, inside = None, np.zeros(len(force), dtype=bool)
    ridge = 1e-4 * np.eye(7)

    def solved(rows: np.ndarray) -> np.ndarray:
        a = model[rows].reshape(-1, 7)
        return np.linalg.solve(a.T @ a + ridge, a.T @ force[rows].ravel())

    for _ in range(_TRIALS):
        found = solved(random.integers(0, len(force), 5))
        agree = np.linalg.norm(model @ found - force, axis=1) < reach_n
        if agree.sum() > inside.sum():
            best, inside = found, agree
    for _ in range(4):
        if inside.sum() < 10:
            return None, inside
        best = solved(np.flatnonzero(inside))
        inside = np.linalg.norm(model @ best - force, axis=1) < reach_n
    return best, inside
