"""The force that the sensor reads in free air, followed over time: bias, drift and the tool's weight."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

_WINDOW_S = 8.0
_SAMPLES = 300
_SHARE = 0.12


def free_air_force(
    t: np.ndarray,
    force: np.ndarray,
    spread_n: float,
    *,
    reach: float = 5.0,
    touched: np.ndarray | None = None,
) -> tuple[np.ndarray, float]:
    """Free-air force (n, 3) N interpolated over time, and the share of windows where it was found.

    Free air is where readings crowd: in each window of 8 s the densest cluster of low-passed readings (n, 3)
    within `reach` times their noise `spread_n` (N an axis). Windows without such a crowd, or far from their
    neighbours', are passed over. Where no window has one the force is zero. touched: (n,) bool, where
    something is touched for certain: a tracing crowds as well.
    """
    may = np.ones(len(t), dtype=bool) if touched is None else ~touched
    starts = np.arange(t[0], t[-1], _WINDOW_S / 2)
    times, levels = [], []
    for start in starts:
        inside = np.flatnonzero(may & (t >= start) & (t < start + _WINDOW_S))
        if len(inside) < 20:
            continue
        chosen = inside[np.linspace(0, len(inside) - 1, min(_SAMPLES, len(inside))).astype(int)]
        f = force[chosen]
        gap = cdist(f, f)
        neighbours = (gap < reach * spread_n).sum(axis=1)
        best = int(np.argmax(neighbours))
        if neighbours[best] < max(5, _SHARE * len(chosen)):
            continue
        crowd = gap[best] < reach * spread_n
        times.append(float(np.mean(t[chosen[crowd]])))
        levels.append(np.median(f[crowd], axis=0))
    if not times and touched is not None:  # nothing else was recorded: air is in there too
        return free_air_force(t, force, spread_n, reach=reach)
    if not times:
        return np.zeros_like(force), 0.0
    at, level = np.array(times), np.array(levels)
    # a long hold crowds as well: what stands far from the median of its neighbours is such a hold
    typical = np.array([np.median(level[max(0, i - 3) : i + 4], axis=0) for i in range(len(level))])
    lowest = level[np.argmin(np.linalg.norm(level, axis=1))]
    good = np.linalg.norm(level - typical, axis=1) < 4 * reach * spread_n
    if not good.any():
        return np.broadcast_to(lowest, force.shape).copy(), 0.0
    at, level = at[good], level[good]
    return np.column_stack([np.interp(t, at, level[:, a]) for a in range(3)]), len(at) / len(starts)
