"""The tool's own weight and inertia in the force readings, found in free motion.

In free air a sensor reads f = c + d t + R(q) b - m a(t - s): c the weight in the device frame and the sensor's
bias, d its drift, b what taring took off, fixed in the tool's frame, m a the inertia of the moving mass, s how
late the force reads. A good part of an exploration is free air: the model whose nearer residuals are least is
that of free air (least quantile of residuals, Rousseeuw 1984), whatever the presses do. Without quaternions
the tool is taken to keep its orientation.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from mechanics.recording import Recording
from reconstruct.filtering import low_pass_at
from reconstruct.free_noise import crowd_scale

_SUBSAMPLE = 1500
_TRIALS = 500
_SHARE = 0.25
"""At least so much of an exploration is free motion."""
_INSIDE = 3.5
_LATE_S = np.arange(-0.010, 0.0651, 0.005)
_RIDGE = 1e-4


def tool_weight(
    recording: Recording, filtered: np.ndarray, cutoff_hz: float
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) N on the tool that bias, weight and inertia make in `filtered` force (n, 3), and of that the
    inertia's part.
    """
    t = recording.t
    rows = np.linspace(0, len(t) - 1, min(_SUBSAMPLE, len(t))).astype(int)
    hand = low_pass_at(t, recording.position, recording.sample_rate_hz, cutoff_hz, derivative=2)
    fixed = [np.broadcast_to(np.eye(3), (len(t), 3, 3))]
    if recording.quaternion is not None:
        fixed.append(Rotation.from_quat(recording.quaternion[:, [1, 2, 3, 0]]).as_matrix())
    drift = ((t - t.mean()) / np.ptp(t))[:, None, None] * np.eye(3)

    def columns(late_s: float, at: np.ndarray) -> np.ndarray:
        """(k, 3, p): constant, tool frame, inertia, drift, of samples `at`."""
        late = np.column_stack([np.interp(t[at] - late_s, t, hand[:, a]) for a in range(3)])
        return np.concatenate([*(f[at] for f in fixed), -late[:, :, None], drift[at]], axis=2)

    model, force = columns(0.0, rows), filtered[rows]
    guess = np.zeros(model.shape[2])
    guess[:-3] = _least_quantile(model[:, :, :-3], force)
    found, spread = _refined(model, force, guess)
    late_s = 0.0
    mass = len(guess) - 4
    if np.sqrt(np.mean((model[:, :, mass] * found[mass]) ** 2)) > spread / 3:
        tried = [(*_refined(columns(s, rows), force, found), s) for s in _LATE_S]
        found, _, late_s = min(tried, key=lambda entry: entry[1])
    whole = columns(late_s, np.arange(len(t)))
    return whole @ found, whole[:, :, mass] * found[mass]


def _solved(model: np.ndarray, force: np.ndarray) -> np.ndarray:
    a = model.reshape(-1, model.shape[2])
    return np.linalg.solve(a.T @ a + _RIDGE * np.eye(a.shape[1]), a.T @ force.ravel())


def _least_quantile(model: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(p,): of parameters that three samples tell, those whose quarter of least residuals is nearest."""
    random = np.random.default_rng(0)
    best, least, kept = np.zeros(model.shape[2]), np.inf, int(_SHARE * len(force))
    for _ in range(_TRIALS):
        found = _solved(*(x[random.integers(0, len(force), 3)] for x in (model, force)))
        size = np.linalg.norm(model @ found - force, axis=1)
        score = float(np.partition(size, kept)[kept])
        if score < least:
            best, least = found, score
    return best


def _refined(model: np.ndarray, force: np.ndarray, found: np.ndarray) -> tuple[np.ndarray, float]:
    """(parameters, spread N an axis): fitted to the samples that crowd about them."""
    spread = 0.0
    for _ in range(6):
        size = np.linalg.norm(model @ found - force, axis=1)
        spread = crowd_scale(size)
        inside = size < _INSIDE * spread
        if inside.sum() < 20:
            break
        found = _solved(model[inside], force[inside])
    return found, spread
