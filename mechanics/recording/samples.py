"""Stretches of samples, and series that read late: plain helpers for sampled signals."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np


def runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """[start, end) of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def delayed(parts: Iterable[slice], t: np.ndarray, values: np.ndarray, delay_s: float) -> np.ndarray:
    """(n, 3), values (n, 3) at times t (n,) s as they read `delay_s` late (negative: earlier).

    parts: stretches that know nothing of one another; the ends of each are held.
    """
    if delay_s == 0:
        return values
    out = np.empty_like(values)
    for part in parts:
        for axis in range(3):
            out[part, axis] = np.interp(t[part] - delay_s, t[part], values[part, axis])
    return out
