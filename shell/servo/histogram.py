"""A histogram of nanoseconds with 3 % bins from 1 ns to 1100 s, filled without allocation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.kernels import kernel

SUB = 32
BINS = 36 * SUB


@kernel
def bin_of(value_ns):
    """The bin of a duration: exact below 64 ns, then 32 bins an octave; negative values count as 0."""
    if value_ns < 0:
        value_ns = 0
    shift = 0
    rest = value_ns
    while rest >= 2 * SUB:
        rest >>= 1
        shift += 1
    return min(shift * SUB + rest, BINS - 1)


@kernel
def count(bins, extremes, value_ns):
    """Add one duration; extremes: (3,) int64 of number, greatest and sum."""
    bins[bin_of(value_ns)] += 1
    extremes[0] += 1
    extremes[1] = max(extremes[1], value_ns)
    extremes[2] += value_ns


def lower_edge_ns(index: int) -> int:
    """The least duration of a bin."""
    if index < 2 * SUB:
        return index
    shift = index // SUB - 1
    return (index - shift * SUB) << shift


@dataclass(frozen=True)
class Histogram:
    """counts: (BINS,) of durations; greatest_ns and sum_ns are exact."""

    counts: np.ndarray
    greatest_ns: int
    sum_ns: int

    @property
    def number(self) -> int:
        """How many durations were counted."""
        return int(self.counts.sum())

    def quantile_us(self, share: float) -> float:
        """Microseconds that `share` of the durations do not exceed (upper edge of the bin); 0 when empty."""
        total = self.counts.sum()
        if not total:
            return 0.0
        index = int(np.searchsorted(np.cumsum(self.counts), share * total))
        return min(lower_edge_ns(index + 1), self.greatest_ns) / 1000.0

    def as_json(self) -> dict[str, float]:
        """median, p99, p99.9, max and mean in microseconds."""
        return {
            "median": self.quantile_us(0.5),
            "p99": self.quantile_us(0.99),
            "p99.9": self.quantile_us(0.999),
            "max": self.greatest_ns / 1000.0,
            "mean": self.sum_ns / max(self.number, 1) / 1000.0,
        }
