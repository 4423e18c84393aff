"""The modulus under a sphere that the sample pulls at (JKR): the pull on the way out says how strongly.

With the greatest pull P, a push F has the contact radius of Hertz's at F + 2 P + 2 sqrt(P (F + P)), and the
dent is a^2 / R less sqrt(4 P a / (3 R E*)). Johnson, Kendall & Roberts (1971), doi:10.1098/rspa.1971.0141.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from palpate.diagnosis.specimen.machine_compliance import Way

_DECADES = 1.0


def jkr_modulus(
    ways: Sequence[Way], radius_m: float, poisson_ratio: float, pull_n: float, guess: float
) -> float:
    """Pa, of the ways in with a first touch each, at a known greatest pull (N). guess: Pa."""

    def missed(log_e: float) -> float:
        plane = np.exp(log_e) / (1 - poisson_ratio**2)
        squares = 0.0
        for way in ways:
            push = np.maximum(way.push, -pull_n)
            hertz = push + 2 * pull_n + 2 * np.sqrt(pull_n * (push + pull_n))
            a = np.cbrt(0.75 * radius_m * hertz / plane)
            dent = a**2 / radius_m - np.sqrt(4 * pull_n * a / (3 * radius_m * plane))
            weight = 1 / np.maximum(np.gradient(dent, push), 1e-12)  # as misses of the force
            left = way.travel - dent
            left = left - np.average(left, weights=weight**2)
            squares += float(((weight * left) ** 2).sum())
        return squares

    middle, far = np.log(guess), _DECADES * np.log(10)
    return float(np.exp(minimize_scalar(missed, bounds=(middle - far, middle + far), method="bounded").x))
