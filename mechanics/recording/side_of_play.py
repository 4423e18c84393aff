"""Which side of a play the tip is on, where the reading follows the tip: read off the reading's own motion.

While a reading moves, the tip is half the play ahead of it. While it stands still, the tip is somewhere in
the play: for a while after a motion still on that side, as it left it from a halt, and shortly before the
next already on the other, which it meets in motion; between anywhere. Axis by axis of the device, whatever
is done: tracing, pressing or sliding.

A reading near the edge of two steps of its encoder jumps to and fro while nothing moves. So it is averaged
first, and has moved where its mean has, by more than noise and rounding of this very reading move a mean.
"""

from __future__ import annotations

import numpy as np
from numba import njit

MEAN_S = 0.02
"""A reading is averaged over this long: no hand turns faster."""
SURE = 5.0
"""Standard errors of the difference of two means, beyond which a reading has moved."""
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
    mean, still_m = averaged(t, position)
    since, left = _last_motion(t, mean, still_m)
    until, met = _last_motion(-t[::-1], np.ascontiguousarray(mean[::-1]), still_m)
    until, met = until[::-1], -met[::-1]
    still = np.exp(-((since / AFTER_S) ** 2)) * (left != 0)
    there = np.exp(-until / BEFORE_S) * (met != 0)
    lead = left * still * (1.0 - there) + met * there
    return lead, SPREAD * np.sqrt((1.0 - still) * (1.0 - there))


def averaged(t: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """((n, 3) m, (3,) m): running means of readings (n, 3) m at (n,) s, and by how much two means of a tip
    that stands still differ at most.

    Noise and rounding show in second differences, of the slower half of the samples: a motion bends least
    there.
    """
    from scipy.ndimage import uniform_filter1d  # here: a touch needs no recording

    if len(t) < 4:
        return np.array(position, dtype=float), np.zeros(3)
    count = 2 * int(0.5 * MEAN_S / np.median(np.diff(t))) + 1
    mean = uniform_filter1d(position, count, axis=0, mode="nearest")
    bend = np.diff(position, n=2, axis=0) ** 2 / 6.0
    speed = np.abs(uniform_filter1d(np.diff(position, axis=0), max(count, 3), axis=0, mode="nearest"))[1:]
    slow = speed <= np.median(speed, axis=0)
    variance = (bend * slow).sum(axis=0) / slow.sum(axis=0)
    return mean, SURE * np.sqrt(2.0 * variance / count)


@njit(cache=True)
def _last_motion(t, x, still):
    """Seconds since x (n, 3) last moved by more than `still` (3,), and which way; 0 where it had not."""
    since, sign = np.zeros(x.shape), np.zeros(x.shape)
    for axis in range(x.shape[1]):
        level, at, way = x[0, axis], t[0], 0.0
        for i in range(len(t)):
            move = x[i, axis] - level
            if abs(move) > still[axis]:
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
