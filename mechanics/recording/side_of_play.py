"""Which side of a play the tip is on, where the reading follows the tip: read off the reading's own steps.

While a reading moves, the tip is half the play ahead of it. While it stands still, the tip is somewhere in
the play: soon after a step still on that side, soon before the next already on the other, between anywhere.
"""

from __future__ import annotations

import numpy as np
from numba import njit

STEP_M = 2e-5
"""A change of the reading that counts as motion: less than a step of a usual encoder."""
MEMORY_S = 0.05
"""How long a hand takes to wander off within the play."""


def leads(t: np.ndarray, position: np.ndarray) -> np.ndarray:
    """(n, 3), -1 to 1: the expected side of the tip in its play for readings (n, 3) m at times (n,) s."""
    return np.clip(_decayed(t, position) + _decayed(-t[::-1], position[::-1])[::-1] * -1.0, -1.0, 1.0)


@njit(cache=True)
def _decayed(t, x):
    """The direction of the last step before each sample, fading with time."""
    out = np.zeros(x.shape)
    for axis in range(x.shape[1]):
        level, at, sign = x[0, axis], t[0], 0.0
        for i in range(len(t)):
            move = x[i, axis] - level
            if abs(move) > STEP_M:
                sign = 1.0 if move > 0.0 else -1.0
                level, at = x[i, axis], t[i]
            out[i, axis] = sign * np.exp(-(t[i] - at) / MEMORY_S)
    return out


@njit(cache=True)
def play(start, y, width, out):
    """Play operator, axis by axis: what follows is dragged once it is width / 2 behind. start: (p + 1,)."""
    half = 0.5 * width
    for p in range(start.shape[0] - 1):
        for k in range(3):
            out[start[p], k] = y[start[p], k]
            for i in range(start[p] + 1, start[p + 1]):
                out[i, k] = min(max(out[i - 1, k], y[i, k] - half), y[i, k] + half)
