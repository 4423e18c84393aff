"""Adhesion: on the way out the surface pulls the tip back, most where it is level again, not beyond its
range."""

from __future__ import annotations

from numba import njit

_TURN = 0.25  # of the range: the way back over which the pull sets in, so that no force steps


@njit(cache=True, error_model="numpy")
def adhesive_pull(depth_m, deepest_m, pull_off_n, range_m):  # type: ignore[no-untyped-def]
    """Pull towards the object, N, at least 0; depth (negative: above the surface), the touch's deepest, m."""
    reach = 1.0 - abs(depth_m) / range_m
    if reach <= 0.0 or deepest_m <= 0.0:
        return 0.0
    returned = (deepest_m - depth_m) / (_TURN * range_m)
    return pull_off_n * reach * min(max(returned, 0.0), 1.0)
