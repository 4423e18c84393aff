"""The sensor's noise as it is: white, and slow beside it. Free air says how much of each; a filter makes it
white.

The slow part is a first-order Gauss-Markov process: three scatters that are measured in free air (a sample,
the mean over a step, the mean over ten steps) give its variance and its time. A Kalman filter's innovations
of such a process, over their standard deviations, are white; being linear, it filters residuals and
sensitivities alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from mechanics.presses import STEP_S, Noise, Presses

_TIMES_S = np.geomspace(2e-3, 3.0, 60)
_STEPS = 10


@dataclass(frozen=True)
class Coloured:
    """Of one force component of a thinned row. white, slow: N^2. time_s: s, the slow part's."""

    white: float
    slow: float
    time_s: float


def _kept(span: np.ndarray) -> np.ndarray:
    """Share of a Gauss-Markov process's variance that a mean over `span` of its times keeps."""
    x = np.maximum(span, 1e-6)
    return 2 * (x - 1 + np.exp(-x)) / x**2


def coloured(noise: Noise, sample_rate_hz: float) -> Coloured:
    """What the three scatters of free air say. Where no slow part fits, all of a step's noise is white."""
    block = max(1.0, STEP_S * sample_rate_hz)
    raw, step = noise.raw_n**2, noise.step_n**2
    long = noise.variance_inflation * step / _STEPS
    one, ten = _kept(STEP_S / _TIMES_S), _kept(_STEPS * STEP_S / _TIMES_S)
    slow = np.clip((step - raw / block) / np.maximum(one - 1 / block, 1e-3), 0.0, raw)
    white = np.maximum(step - slow * one, 0.0)
    missed = np.abs(np.log((white / _STEPS + slow * ten) / long))
    best = int(np.argmin(missed))
    if noise.variance_inflation <= 1.0 or slow[best] <= 0.0:
        return Coloured(step, 0.0, STEP_S)
    own = slow[best] * one[best]
    return Coloured(max(step - own, 0.05 * step), float(min(own, 0.95 * step)), float(_TIMES_S[best]))


def whitened(t: Presses, rows: np.ndarray, x: np.ndarray, noise: Coloured) -> np.ndarray:
    """(m, c) columns (m, c) at `rows` (m,) of the table, press by press: of noise, of variance 1 and
    white."""
    out = np.empty_like(x)
    again = np.concatenate([[True], np.diff(t.press[rows]) != 0])
    _innovations(again, t.t[rows], x, noise.white, noise.slow, noise.time_s, out)
    return out


@njit(cache=True)
def _innovations(again, t, x, white, slow, time_s, out):
    mean = np.zeros(x.shape[1])
    spread = slow
    for i in range(x.shape[0]):
        if again[i]:
            mean[:] = 0.0
            spread = slow
        else:
            fades = np.exp(-(t[i] - t[i - 1]) / time_s)
            mean *= fades
            spread = fades * fades * spread + (1.0 - fades * fades) * slow
        total = spread + white
        gain = spread / total
        scale = 1.0 / np.sqrt(total)
        for c in range(x.shape[1]):
            new = x[i, c] - mean[c]
            out[i, c] = new * scale
            mean[c] += gain * new
        spread *= 1.0 - gain
