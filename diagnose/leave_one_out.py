"""Each group left out of a fit in turn, linearised at the optimum: quick enough for every effect tried.

The gaps that are reported are fitted again instead (diagnose.validation).
"""

from __future__ import annotations

import numpy as np

from diagnose.fit import Fit, bounds_of

_FAR = 20  # parameter steps


def held_out(found: Fit) -> tuple[np.ndarray, np.ndarray]:
    """Leave one group out: (whitened loss, plain sum of squares N^2), (g,) each, of the group not fitted.

    Linearised at the optimum of all: each group's share of the normal equations is taken out again. For the
    plain gap the modulus is refitted to the other groups' plain residual, so that a gap is never one that a
    modulus would close.
    """
    gram, raw = found.gram, found.raw
    low, high, step, *_ = bounds_of(found.effects)
    total, raw_total = gram.sum(axis=0), raw.sum(axis=0)
    whitened = np.empty(len(gram))
    plain = np.empty(len(gram))
    at_bound = (found.values <= low + 1e-9) | (found.values >= high - 1e-9)
    free = ~at_bound
    free[0] = True
    for g in range(len(gram)):
        rest = total - gram[g]
        hessian = (rest[1:, 1:] + np.diag(found.prior))[np.ix_(free, free)]
        # a parameter that nothing here moves (a slip where no motion is sideways) has no curvature at all
        hessian = hessian + 1e-9 * np.diag(np.maximum(np.diag(hessian), 1e-12))
        move = np.zeros(len(found.values))
        move[free] = np.linalg.solve(hessian, (rest[1:, 0] - found.pull)[free])
        # where sites leave a parameter loose, a linear answer is good near the optimum only
        move = np.clip(move, -_FAR * step, _FAR * step)
        move = np.clip(found.values + move, low, high) - found.values
        coefficients = np.concatenate([[1.0], -move])
        whitened[g] = 0.5 * coefficients @ gram[g] @ coefficients
        others = raw_total - raw[g]
        coefficients[1] -= others[1] @ coefficients / max(others[1, 1], 1e-12)
        plain[g] = coefficients @ raw[g] @ coefficients
    return whitened, plain


def levelled(found: Fit) -> np.ndarray:
    """(n, 3) N, the residual after the modulus is refitted to it plainly (linearised)."""
    raw = found.raw.sum(axis=0)
    return found.residual - raw[0, 1] / max(raw[1, 1], 1e-12) * found.jacobian[:, :, 0]
