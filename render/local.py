"""Trial of one touch's local law without writing its memory (mechanics.touch writes it each step)."""

from __future__ import annotations

import numpy as np
from numba import njit

from mechanics.dent import dent_force
from mechanics.touch import _remember as touch_remember_ring
from mechanics.touch import _tangential


@njit(cache=True, error_model="numpy")
def touch_solve(state, d, far, table, radius, plane_strain_modulus, stick):
    press = -d[2]
    if not press > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    cuu, cuv, cvv, cnn = far[0, 0], far[0, 1], far[1, 1], far[2, 2]
    cun, cvn = far[0, 2], far[1, 2]
    low, high = 0.0, np.inf
    dent = state[1] if state[1] > 0.0 else 0.5 * press
    tolerance = 1e-10 * radius
    fn = fu = fv = a = du = dv = tangent = 0.0
    for _ in range(60):
        fn, stiffness, a = dent_force(table, dent, radius, plane_strain_modulus)
        fu, fv, du, dv = _tangential(state, a, stick, cuu, cuv, cvv, d[0] + cun * fn, d[1] + cvn * fn)
        excess = dent + cnn * fn - cun * fu - cvn * fv - press
        tangent = stiffness / (1.0 + cnn * stiffness)
        if excess > 0.0:
            high = dent
        else:
            low = dent
        step = -excess / (1.0 + cnn * stiffness)
        if abs(step) < tolerance:
            break
        dent += step
        if not (low < dent < high):
            dent = 0.5 * (low + high) if high < np.inf else 2.0 * low + tolerance
    return -fu, -fv, fn, dent, a, du, dv, tangent


@njit(cache=True, error_model="numpy")
def touch_remember(state, a, dent, du, dv, thin):
    touch_remember_ring(state, a, du, dv, thin)
    state[1] = dent
