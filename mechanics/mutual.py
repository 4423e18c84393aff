"""Kernels of the 1 kHz loop: how a touch at one place moves another, from the low-rank table.

A place is three corners of the surface, negative where held (they do not move), with three weights.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True, error_model="numpy")
def mix_factor(factor, corners, weights, out):
    """out (3, r): the rows of a low-rank factor (t, 3, r) at a place."""
    out[:] = 0.0
    for i in range(3):
        if corners[i] >= 0:
            for a in range(3):
                for k in range(factor.shape[2]):
                    out[a, k] += weights[i] * factor[corners[i], a, k]


@njit(cache=True, error_model="numpy", fastmath=True)
def between_mixed(mixed_p, mixed_q, out):
    """out (3, 3) 1/m: displacement at p for a unit force at q, from `mix_factor` at both."""
    for a in range(3):
        for b in range(3):
            total = 0.0
            for k in range(mixed_p.shape[1]):
                total += mixed_p[a, k] * mixed_q[b, k]
            out[a, b] = total
