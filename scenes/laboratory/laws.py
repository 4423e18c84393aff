"""Laws at a material point: isochoric stress and moduli of a solid with fibres, neo-Hookean or one that
stiffens (exponentially) or softens as it is strained.

Voigt order 11 22 33 12 23 13; stresses in units of the matrix's Young's modulus.
"""

from __future__ import annotations

import numba
import numpy as np

PAIRS = np.array([[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [0, 2]])
"""Tensor indices of the Voigt numbers."""


@numba.njit(cache=True, fastmath=False)
def isochoric(c, shear, c20, fibre, stress, moduli):
    """Second Piola-Kirchhoff stress and moduli of the isochoric energy; returns (energy, J)."""
    det = (
        c[0] * (c[1] * c[2] - c[4] * c[4])
        - c[3] * (c[3] * c[2] - c[4] * c[5])
        + c[5] * (c[3] * c[4] - c[1] * c[5])
    )
    inverse = np.empty(6)
    inverse[0] = (c[1] * c[2] - c[4] * c[4]) / det
    inverse[1] = (c[0] * c[2] - c[5] * c[5]) / det
    inverse[2] = (c[0] * c[1] - c[3] * c[3]) / det
    inverse[3] = (c[4] * c[5] - c[3] * c[2]) / det
    inverse[4] = (c[3] * c[5] - c[0] * c[4]) / det
    inverse[5] = (c[3] * c[4] - c[1] * c[5]) / det
    j = np.sqrt(det)
    scale = det ** (-1.0 / 3.0)
    trace = c[0] + c[1] + c[2]
    first = scale * trace
    c10 = 0.5 * shear
    strained = first - 3
    if c20 > 0.0:
        w1 = c10 * np.exp(2 * c20 * strained)
        w11 = 2 * c20 * w1
        energy = (w1 - c10) / (2 * c20)
    elif c20 < 0.0:
        root = np.sqrt(1 - 4 * c20 * strained)
        w1 = c10 / root
        w11 = 2 * c20 * w1 / (root * root)
        energy = c10 * (1 - root) / (2 * c20)
    else:
        w1, w11, energy = c10, 0.0, c10 * strained
    d = np.empty(6)
    for a in range(6):
        d[a] = (scale if a < 3 else 0.0) - first / 3 * inverse[a]
        stress[a] = 2 * w1 * d[a]
    for a in range(6):
        one_a = scale if a < 3 else 0.0
        for b in range(a, 6):
            one_b = scale if b < 3 else 0.0
            value = -(one_a * inverse[b] + inverse[a] * one_b) / 3 + first / 9 * inverse[a] * inverse[b]
            value += first / 3 * circled(inverse, a, b)
            moduli[a, b] = 4 * (w1 * value + w11 * d[a] * d[b])
            moduli[b, a] = moduli[a, b]
    if fibre[0] > 0.0:
        m = np.empty(6)
        m[0], m[1], m[2] = fibre[1] ** 2, fibre[2] ** 2, fibre[3] ** 2
        m[3], m[4], m[5] = fibre[1] * fibre[2], fibre[2] * fibre[3], fibre[1] * fibre[3]
        length = m[0] * c[0] + m[1] * c[1] + m[2] * c[2] + 2 * (m[3] * c[3] + m[4] * c[4] + m[5] * c[5])
        k = fibre[0] * shear
        e = scale * length - 1
        energy += 0.5 * k * e * e
        h = np.empty(6)
        for a in range(6):
            h[a] = scale * m[a] - scale * length / 3 * inverse[a]
            stress[a] += 2 * k * e * h[a]
        for a in range(6):
            for b in range(6):
                value = -scale / 3 * (m[a] * inverse[b] + inverse[a] * m[b])
                value += scale * length / 9 * inverse[a] * inverse[b]
                value += scale * length / 3 * circled(inverse, a, b)
                moduli[a, b] += 4 * k * (h[a] * h[b] + e * value)
    return energy, j, inverse


@numba.njit(cache=True)
def circled(s, a, b):
    """(s_ik s_jl + s_il s_jk) / 2 in Voigt numbers."""
    i, j = PAIRS[a, 0], PAIRS[a, 1]
    k, m = PAIRS[b, 0], PAIRS[b, 1]
    return 0.5 * (_at(s, i, k) * _at(s, j, m) + _at(s, i, m) * _at(s, j, k))


@numba.njit(cache=True)
def _at(s, i, j):
    if i == j:
        return s[i]
    low, high = min(i, j), max(i, j)
    if low == 0:
        return s[3] if high == 1 else s[5]
    return s[4]


@numba.njit(cache=True)
def norm(s):
    """Frobenius norm of a symmetric tensor in Voigt order."""
    return np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2 + 2 * (s[3] ** 2 + s[4] ** 2 + s[5] ** 2))


@numba.njit(cache=True)
def erf(x):
    """Error function, Abramowitz & Stegun 7.1.26 (error below 1.5e-7)."""
    t = 1 / (1 + 0.3275911 * abs(x))
    tail = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))))
    value = 1 - tail * np.exp(-x * x)
    return value if x >= 0 else -value
