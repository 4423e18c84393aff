"""Rates that were counted, with their intervals."""

from __future__ import annotations

import numpy as np


def wilson(hits: int, of: int) -> tuple[float, float, float]:
    """(rate, low, high): Wilson's 95 % interval; all nan for none."""
    if of == 0:
        return (float("nan"),) * 3
    z, p = 1.959964, hits / of
    centre = (p + z * z / (2 * of)) / (1 + z * z / of)
    half = z * np.sqrt(p * (1 - p) / of + z * z / (4 * of * of)) / (1 + z * z / of)
    return p, max(0.0, centre - half), min(1.0, centre + half)
