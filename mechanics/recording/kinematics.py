"""Acceleration along a sampled path, by local quadratic fits (Savitzky and Golay, 1964)."""

from __future__ import annotations

import numpy as np

WIDTH_S = 0.05
"""Width of the fits: a hand's movement up to 15 Hz is passed, an encoder's steps are not."""
_EVEN = 1e-3  # of a step: less is rounding of the clock


def acceleration(t: np.ndarray, path: np.ndarray, *, width_s: float = WIDTH_S) -> np.ndarray:
    """Second derivative of path (n, ...) by time t (n,) s, which increases, fitted over `width_s`; exact on
    parabolas.

    A clock that is not even is made so by interpolation. Fewer than three samples give 0.
    """
    from scipy.signal import savgol_filter  # here: it brings scipy.stats, and a touch needs neither

    t, path = np.asarray(t, dtype=float), np.asarray(path, dtype=float)
    count = len(t)
    if count < 3:
        return np.zeros_like(path)
    step = (t[-1] - t[0]) / (count - 1)
    even = t[0] + step * np.arange(count)
    uneven = np.abs(t - even).max() > _EVEN * step
    if uneven:
        step = float(np.median(np.diff(t)))
        even = np.arange(t[0], t[-1] + step / 2, step)
        path = _interpolated(even, t, path)
    samples = max(2 * round(width_s / step / 2) + 1, 5)
    samples = min(samples, len(even) - 1 + len(even) % 2)
    found = savgol_filter(path, samples, 2, deriv=2, delta=step, axis=0, mode="interp")
    return _interpolated(t, even, found) if uneven else found


def _interpolated(wanted: np.ndarray, t: np.ndarray, values: np.ndarray) -> np.ndarray:
    columns = values.reshape(len(values), -1).T
    return np.stack([np.interp(wanted, t, c) for c in columns], axis=-1).reshape(-1, *values.shape[1:])
