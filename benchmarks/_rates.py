"""Rates that were counted, with their intervals."""

from __future__ import annotations

from scipy.stats import binomtest


def wilson(hits: int, of: int) -> tuple[float, float, float]:
    """(rate, low, high): Wilson's 95 % interval; all nan for none."""
    if of == 0:
        return (float("nan"),) * 3
    interval = binomtest(hits, of).proportion_ci(0.95, "wilson")
    return hits / of, float(interval.low), float(interval.high)
