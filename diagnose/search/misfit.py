"""What a fit leaves at every press, for effects that seek their starts in it."""

from __future__ import annotations

import numpy as np

from diagnose.forward.prediction import Forward
from diagnose.search.fit import Fit, settings_of
from mechanics.effects.base import Misfit

LEAST_SD = 0.015
"""Share by which a press's stiffness is off at least, beside noise and shape."""


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
