"""The tool's own weight and inertia in the force readings, found in free motion.

In free air a sensor reads f = c + d t + R(q) b - m a, s later: c the weight in the device frame and the
sensor's bias, d its drift, b what taring took off, fixed in the tool's frame, m a the inertia of the moving
mass, s how late the force reads. Where a hand moves most briskly it is mostly in free air: the model whose
nearer residuals are least there is that of free air (least quantile of residuals, Rousseeuw 1984), whatever
the presses do. Without quaternions the tool is taken to keep its orientation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.spatial.transform import Rotation

from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.steps.s1_filter.noise import crowd_scale, low_pass_at

_SUBSAMPLE = 1200
_TRIALS = 200
_MOVING = 0.4
"""Share of the samples, those about the greatest accelerations, by which weight and inertia are found: there
inertia is loudest, and a hand that presses moves evenly."""
_SHARE = 0.35
"""At least so much of them is free motion."""
_INSIDE = 3.5
_LATE_S = np.arange(-0.010, 0.0651, 0.005)
_COARSE = slice(0, None, 3)
_RIDGE = 1e-4


@dataclass(frozen=True)
class ToolWeight:
    """force: (n, 3) N on the tool that bias, weight and inertia make; inertia: (n, 3) N, its part of that.

    found: (p,) constant, tool frame, inertia, drift over the recording; late_s: by how much the force reads
    late.
    """

    force: np.ndarray
    inertia: np.ndarray
    found: np.ndarray
    late_s: float


def tool_weight(
    recording: Recording,
    filtered: np.ndarray,
    cutoff_hz: float,
    *,
    touched: np.ndarray | None = None,
    near: ToolWeight | None = None,
) -> ToolWeight:
    """What the tool makes in `filtered` force (n, 3) N. touched: (n,) bool, where something is touched for
    certain: no free motion is sought there. near: of a beginning of the recording: the search starts there.
    """
    t = recording.t
    hand = low_pass_at(t, recording.position, recording.sample_rate_hz, cutoff_hz, derivative=2)
    rows = _moving(hand, round(_LATE_S[-1] * recording.sample_rate_hz), touched)
    turned = np.zeros((len(t), 3, 0))
    if recording.quaternion is not None:
        turned = Rotation.from_quat(recording.quaternion[:, [1, 2, 3, 0]]).as_matrix()
    drift = ((t - t.mean()) / np.ptp(t))[:, None, None] * np.eye(3)

    def columns(late_s: float, at: np.ndarray) -> np.ndarray:
        """(k, 3, p): constant, tool frame, inertia, drift, of samples `at`."""
        then = np.clip(np.searchsorted(t, t[at] - late_s), 0, len(t) - 1)
        constant = np.broadcast_to(np.eye(3), (len(at), 3, 3))
        return np.concatenate([constant, turned[then], -hand[then, :, None], drift[at]], axis=2)

    force = filtered[rows]

    def fitted(late_s: float, found: np.ndarray | None) -> tuple[float, np.ndarray, float]:
        model = columns(late_s, rows)
        if found is None:
            found = np.append(_least_quantile(model[:, :, :-3], force), np.zeros(3))
        found = _refined(model, force, found)
        return _near(np.linalg.norm(model @ found - force, axis=1)), found, late_s

    if near is None:
        _, start, about = min((fitted(s, None) for s in _LATE_S[_COARSE]), key=lambda entry: entry[0])
    else:
        start, about = near.found, near.late_s
    close = _LATE_S[np.abs(_LATE_S - about) < 0.011]
    _, found, late_s = min((fitted(s, start) for s in close), key=lambda entry: entry[0])
    mass = len(found) - 4
    whole = columns(late_s, np.arange(len(t)))
    return ToolWeight(whole @ found, whole[:, :, mass] * found[mass], found, late_s)


def _moving(hand: np.ndarray, aside: int, touched: np.ndarray | None) -> np.ndarray:
    """Indices of samples with the greatest accelerations (n, 3) at most `aside` samples away, but `touched`
    ones."""
    most = maximum_filter1d(np.linalg.norm(hand, axis=1), 2 * aside + 1)
    open_ = np.ones(len(most), dtype=bool) if touched is None else ~touched
    rows = np.flatnonzero(open_ & (most >= np.quantile(most[open_], 1 - _MOVING)))
    return rows[np.linspace(0, len(rows) - 1, min(_SUBSAMPLE, len(rows))).astype(int)]


def _near(size: np.ndarray) -> float:
    """The length within which the nearer residuals lie."""
    kept = int(_SHARE * len(size))
    return float(np.partition(size, kept)[kept])


def _solved(model: np.ndarray, force: np.ndarray) -> np.ndarray:
    a = model.reshape(-1, model.shape[2])
    return np.linalg.solve(a.T @ a + _RIDGE * np.eye(a.shape[1]), a.T @ force.ravel())


def _least_quantile(model: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(p,): of parameters that three samples tell, those whose nearer residuals are least."""
    random = np.random.default_rng(0)
    best, least = np.zeros(model.shape[2]), np.inf
    for _ in range(_TRIALS):
        found = _solved(*(x[random.integers(0, len(force), 3)] for x in (model, force)))
        score = _near(np.linalg.norm(model @ found - force, axis=1))
        if score < least:
            best, least = found, score
    return best


def _refined(model: np.ndarray, force: np.ndarray, found: np.ndarray) -> np.ndarray:
    """The parameters fitted to the samples that crowd about them."""
    for _ in range(6):
        size = np.linalg.norm(model @ found - force, axis=1)
        inside = size < _INSIDE * crowd_scale(size)
        if inside.sum() < 20:
            break
        found = _solved(model[inside], force[inside])
    return found
