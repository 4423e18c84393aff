"""Where fits start from: where each press first met the surface, and what a first fit leaves at every press,
from which effects seek their own starts."""

from __future__ import annotations

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.forward.touches import REACH_M
from palpate.diagnosis.search.fit import Fit, settings_of
from palpate.diagnosis.search.whiten import Whitener
from palpate.mechanics.effects.hints import Misfit

LEAST_SD = 0.015
"""Share by which a press's stiffness is off at least, beside noise and shape."""


def first_touches(forward: Forward, whitener: Whitener, modulus: float) -> np.ndarray:
    """(p,) m, how much earlier each press met the surface than its model says: a search over shifts.

    Each press alone, with a free factor on its force, so that neither modulus nor shape decides it.
    """
    t = forward.touches
    shifts = np.linspace(-REACH_M, REACH_M, 25)
    cost = np.empty((len(shifts), len(t)))
    measured = np.where(t.counted, t.local_force[:, 0], 0.0)
    for i, shift in enumerate(shifts):
        settings = forward.ideal(modulus)
        settings.onset = settings.onset + shift
        predicted = np.where(t.counted, forward.predict(settings)[:, 0], 0.0)

        def sums(a: np.ndarray) -> np.ndarray:
            return np.bincount(t.press, weights=a, minlength=len(t))

        pp, pf, ff = sums(predicted**2), sums(predicted * measured), sums(measured**2)
        factor = np.clip(pf / np.maximum(pp, 1e-12), 0.5, 2.0)
        error = ff - 2 * factor * pf + factor**2 * pp
        cost[i] = (
            error / (sums(t.counted.astype(float)) * whitener.variance) * 50
            + (shift / (2 * whitener.onset_sd)) ** 2
        )
    best = np.argmin(cost, axis=0)
    inner = np.clip(best, 1, len(shifts) - 2)
    rows = np.arange(len(t))
    left, mid, right = cost[inner - 1, rows], cost[inner, rows], cost[inner + 1, rows]
    curve = np.maximum(left - 2 * mid + right, 1e-12)
    return shifts[inner] + np.clip(0.5 * (left - right) / curve, -0.5, 0.5) * (shifts[1] - shifts[0])


def misfit_of(forward: Forward, base: Fit, site_sd: np.ndarray) -> Misfit:
    """Each press's factor on the force, and how it answers to compliance. site_sd: (p,) of the shape."""
    t = forward.touches
    keep = t.counted[:, None]
    predicted = np.where(keep, t.local_force - base.residual, 0.0)[:, 0]
    residual = np.where(keep, base.residual, 0.0)[:, 0]

    def sums(a: np.ndarray) -> np.ndarray:
        return np.bincount(t.press, weights=a, minlength=len(t))

    power = np.maximum(sums(predicted**2), 1e-12)
    settings = settings_of(forward, base.effects, base.values, base.likeliest)
    step = 1.0
    settings.far = settings.far.copy()
    settings.far[:, 0, 0] += step
    moved = np.where(t.counted, forward.predict(settings)[:, 0], 0.0)
    return Misfit(
        level=sums(predicted * residual) / power,
        answer=sums(predicted * (moved - predicted)) / power / step,
        weight=1 / (site_sd**2 + t.noise_n**2 / power + LEAST_SD**2),
    )
