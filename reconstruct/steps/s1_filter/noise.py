"""How loud free motion is, and how far above it a touch must stand. Forces as low-passed, N.

Zero-phase low-pass filtering of forces and positions (paper, section 2.1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.optimize import brentq
from scipy.signal import butter, savgol_filter, sosfiltfilt

from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import option
from palpate.mechanics.statistics import are_read, spread

_FALSE_PER_S = 1e-3
"""False touches in free motion, at most so often."""
_ROUNDS, _SETTLED = 60, 1e-4
_ENOUGH = 20_000
"""Samples that tell a scale to within half a percent; of more, an even choice is taken."""
_BRISK = 0.8


def crowd_scale(size: np.ndarray) -> float:
    """Standard deviation an axis of the crowd about zero, from the lengths (n,) of 3-vectors.

    The crowd's lengths follow Maxwell's distribution, what is no free motion an exponential one; their
    mixture is fitted by expectation and maximisation.
    """
    size = np.asarray(size, dtype=float)
    size = np.maximum(size[:: max(1, len(size) // _ENOUGH)], 1e-12)
    scale = float(np.quantile(size, 0.2)) / 1.538  # Maxwell's median, where two fifths are free
    rest, share = float(size.mean()), 0.5
    for _ in range(_ROUNDS):
        crowd = share * np.sqrt(2 / np.pi) * size**2 / scale**3 * np.exp(-0.5 * (size / scale) ** 2)
        other = (1 - share) * np.exp(-size / rest) / rest
        weight = crowd / np.maximum(crowd + other, 1e-300)
        total = float(weight.sum())
        if total < 3 or len(size) - total < 1e-6:
            break
        share = total / len(size)
        before, scale = scale, max(float(np.sqrt((weight * size**2).sum() / (3 * total))), 1e-9)
        rest = float(((1 - weight) * size).sum() / (len(size) - total))
        if abs(scale - before) < _SETTLED * scale:
            break
    return scale


def moving_spread(size: np.ndarray, inertia: np.ndarray, spread: float, samples: int) -> np.ndarray:
    """(n,) N an axis: the spread of what is left in free motion, where some of the inertia is left too.

    size: (n,) length of what is left; inertia: (n, 3) what was taken off. spread: of the whole. The share of
    the inertia that is left is found where most was taken off. samples: it may lie so far aside.
    """
    taken = maximum_filter1d(np.linalg.norm(inertia, axis=1), 2 * samples + 1)
    most = taken >= np.quantile(taken, _BRISK)  # the greatest may be one value for long
    left = max(crowd_scale(size[most]) ** 2 - spread**2, 0.0) / max(float(np.mean(taken[most] ** 2)), 1e-300)
    return np.sqrt(spread**2 + min(left, 1.0) * taken**2)


def least_contrast(rate_hz: float, cutoff_hz: float, false_per_s: float = _FALSE_PER_S) -> float:
    """How many standard deviations (an axis) the length of a low-passed 3-vector must reach, so that white
    noise alone does so less than `false_per_s` times a second.

    The rate of up-crossings of Gaussian noise follows from the spread of its slope (Rice 1945).
    """
    count = int(20 * rate_hz / cutoff_hz) | 1
    impulse = np.zeros(count)
    impulse[count // 2] = 1.0
    passed = low_pass(impulse, rate_hz, cutoff_hz)
    slope = np.linalg.norm(np.diff(passed)) * rate_hz / np.linalg.norm(passed)

    def crossings(level: float) -> float:
        density = np.sqrt(2 / np.pi) * level**2 * np.exp(-0.5 * level**2)
        return float(np.log(slope / np.sqrt(2 * np.pi) * density / false_per_s))

    return float(brentq(crossings, 2.0, 12.0))


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
    values = np.atleast_2d(values.T).T
    columns = values[:, are_read(values)]
    if not columns.size:
        return 0.0
    second = np.diff(columns, n=2, axis=0)
    return float(np.median(spread(second, axis=0) / np.sqrt(6.0)))
