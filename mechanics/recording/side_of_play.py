"""Which side of a play the tip is on, where the reading follows the tip: read off the reading's own steps.

While a reading moves, the tip is half the play ahead of it. While it stands still, the tip is somewhere in
the play: for a while after a step still on that side, as it left it from a halt, and shortly before the next
already on the other, which it meets in motion; between anywhere. Axis by axis of the device, whatever is
done: tracing, pressing or sliding.
"""

from __future__ import annotations

import numpy as np
from numba import njit

STEP_M = 2e-5
"""A change of the reading that counts as motion: less than a step of a usual encoder."""
AFTER_S, BEFORE_S = 0.13, 0.03
"""How long a hand stays where it stopped, and how long before the next step it is already there: by the true
ways of four simulated hands in plays of 0.29 to 0.41 mm."""
SPREAD = 0.53
"""Standard deviation of the side where nothing is known, from the same."""


def leads(t: np.ndarray, position: np.ndarray) -> np.ndarray:
    """(n, 3), -1 to 1: the expected side of the tip in its play for readings (n, 3) m at times (n,) s."""
    return sides(t, position)[0]


def sides(t: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The expected side (n, 3), -1 to 1, and its standard deviation (n, 3); readings (n, 3) m at (n,) s."""
    position = np.ascontiguousarray(position)
    since, left = _last_step(t, position)
    until, met = _last_step(-t[::-1], position[::-1])
    until, met = until[::-1], -met[::-1]
    still = np.exp(-((since / AFTER_S) ** 2)) * (left != 0)
    there = np.exp(-until / BEFORE_S) * (met != 0)
    lead = left * still * (1.0 - there) + met * there
    return lead, SPREAD * np.sqrt((1.0 - still) * (1.0 - there))


@njit(cache=True)
def _last_step(t, x):
    """Seconds since the last step before each sample, and its direction; 0 where none was."""
    since, sign = np.zeros(x.shape), np.zeros(x.shape)
    for axis in range(x.shape[1]):
        level, at, way = x[0, axis], t[0], 0.0
        for i in range(len(t)):
            move = x[i, axis] - level
            if abs(move) > STEP_M:
                way = 1.0 if move > 0.0 else -1.0
                level, at = x[i, axis], t[i]
            since[i, axis], sign[i, axis] = t[i] - at, way
    return since, sign


@njit(cache=True)
def play(start, y, side, width, out):
    """Play operator, axis by axis: what follows is dragged once it is width / 2 behind.

    start: (p + 1,). side: (p, 3), -1 to 1, where a reading went that reached each start: what follows lags.
    """
    half = 0.5 * width
    for p in range(start.shape[0] - 1):
        for k in range(3):
            out[start[p], k] = y[start[p], k] - half * side[p, k]
            for i in range(start[p] + 1, start[p + 1]):
                out[i, k] = min(max(out[i - 1, k], y[i, k] - half), y[i, k] + half)
