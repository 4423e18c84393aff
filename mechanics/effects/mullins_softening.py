"""Mullins softening: below the greatest load that a place has felt it is softer (Ogden & Roxburgh 1999).

The force is multiplied by 1 - erf((W_max - W) / m) / r. W stands for the stored energy, taken to grow with
the depth as a dent's does, depth^2.5; m = m_rel times W at the greatest depth of the exploration.
"""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, error_model="numpy")
def dent_energy(depth_m):  # type: ignore[no-untyped-def]
    """The measure W of the load, m^2.5, at a depth, m."""
    return depth_m**2.5 if depth_m > 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def softening(energy, greatest, r, m):  # type: ignore[no-untyped-def]
    """Factor on the force, 1 while loading afresh; energy, greatest and m in the measure of `dent_energy`."""
    if greatest <= energy:
        return 1.0
    return 1.0 - math.erf((greatest - energy) / m) / r
