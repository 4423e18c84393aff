"""Zero-phase low-pass filtering of forces and positions (paper, section 2.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, savgol_filter, sosfiltfilt

from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import option
from palpate.mechanics.robust import read_columns, spread

_EVEN = 1e-3
"""Of a step: less is rounding of the clock."""
_STENCIL = 7
"""Samples of a derivative of what was smoothed before: exact on polynomials of degree four."""


@dataclass(frozen=True)
class FilterOptions:
    """Cut-off of the zero-phase low-pass; forward and backward second-order Butterworth."""

    cutoff_hz: float = option(25.0, "cut-off of the zero-phase low-pass", unit="Hz", flag="--cutoff")


def low_pass(values: np.ndarray, sample_rate_hz: float, cutoff_hz: float) -> np.ndarray:
    """Values (n,) or (n, k) without phase shift, -6 dB at the cut-off; unchanged where the cut-off is too
    high.

    Raises OptionError where the cut-off is not positive.
    """
    if not cutoff_hz > 0:
        raise OptionError(f"the cut-off is {cutoff_hz} Hz; it must be greater than 0 Hz")
    if cutoff_hz >= 0.45 * sample_rate_hz:
        return np.array(values, dtype=float)
    sections = butter(2, cutoff_hz, fs=sample_rate_hz, output="sos")
    padding = min(len(values) - 1, int(3 * sample_rate_hz / cutoff_hz))
    return sosfiltfilt(sections, values, axis=0, padlen=padding)


def low_pass_at(
    t: np.ndarray, values: np.ndarray, sample_rate_hz: float, cutoff_hz: float, derivative: int = 0
) -> np.ndarray:
    """As `low_pass` of values (n, k) at times t (n,) s, which need not be even, or their time derivative.

    The derivative passes what `low_pass` passes of another signal: an inertia and the acceleration that makes
    it go through the same filter.
    """
    count = len(t)
    step = (t[-1] - t[0]) / (count - 1)
    even = t[0] + step * np.arange(count)
    uneven = bool(np.abs(t - even).max() > _EVEN * step)
    if uneven:
        even = np.arange(t[0], t[-1] + 0.5 / sample_rate_hz, 1 / sample_rate_hz)
        values, step = _columns(even, t, values), 1 / sample_rate_hz
    passed = low_pass(values, sample_rate_hz, cutoff_hz)
    if derivative:
        passed = savgol_filter(passed, _STENCIL, _STENCIL - 3, deriv=derivative, delta=step, axis=0)
    return _columns(t, even, passed) if uneven else passed


def _columns(at: np.ndarray, t: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(at, t, values[:, k]) for k in range(values.shape[1])])


def noise_gain(sample_rate_hz: float, cutoff_hz: float) -> float:
    """Standard deviation of white noise after `low_pass` over that before it."""
    if cutoff_hz >= 0.45 * sample_rate_hz:
        return 1.0
    n = int(20 * sample_rate_hz / cutoff_hz) | 1
    impulse = np.zeros(n)
    impulse[n // 2] = 1.0
    return float(np.linalg.norm(low_pass(impulse, sample_rate_hz, cutoff_hz)))


def white_noise_std(values: np.ndarray) -> float:
    """Standard deviation of white noise an axis in (n, k) samples, from second differences (robust to
    presses); of the axes that are read."""
    columns = read_columns(np.atleast_2d(values.T).T)
    if not columns.size:
        return 0.0
    second = np.diff(columns, n=2, axis=0)
    return float(np.median(spread(second, axis=0) / np.sqrt(6.0)))
