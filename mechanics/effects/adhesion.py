"""Adhesion: on the way out the surface pulls the tip back, most where it is level again, not beyond its
range. A share of the pull may hold deeper in the contact as well, after a millimetre of the way back."""

from __future__ import annotations

from numba import njit

_TURN = 0.25  # of the range: the way back over which the pull sets in, so that no force steps
_TURN_INSIDE_M = 1e-3  # the same deeper in the contact


@njit(cache=True, error_model="numpy")
def adhesive_pull(depth_m, deepest_m, pull_off_n, range_m, inside):  # type: ignore[no-untyped-def]
    """Pull towards the object, N, at least 0; depth (negative: above the surface), the touch's deepest, m.

    inside: 0 to 1, the share of it that holds wherever the tip is in the object.
    """
    if deepest_m <= 0.0:
        return 0.0
    returned = deepest_m - depth_m
    reach = max(1.0 - abs(depth_m) / range_m, 0.0) * min(max(returned / (_TURN * range_m), 0.0), 1.0)
    if depth_m > 0.0:
        reach = max(reach, inside * min(max(returned / _TURN_INSIDE_M, 0.0), 1.0))
    return pull_off_n * reach
