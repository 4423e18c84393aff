"""What a place, a speed or a force can be at all: checked before any arithmetic, so that squares stay finite.

Far beyond every device and object: what lies outside is a garbled message, not a reading.
"""

from __future__ import annotations

from palpate.mechanics.kernels import kernel

FARTHEST_M = 100.0
FASTEST_M_PER_S = 1e4
LARGEST_N = 1e9


@kernel
def within(vector, limit):
    """Whether all three components are numbers of at most `limit`; False for NaN."""
    return abs(vector[0]) <= limit and abs(vector[1]) <= limit and abs(vector[2]) <= limit
