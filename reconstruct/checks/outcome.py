"""What came out: a modulus that a soft object can have, an interval, and a force that the model explains."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.checks.finding import Finding
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusFit

LEAST_PA, MOST_PA = 500.0, 5e6
_MISFIT = 0.5


@dataclass(frozen=True)
class Outcome:
    """What is looked at of a reconstruction: modulus and its 95 % interval, Pa; of each press (k,) the misfit
    rms (NaN where unknown) and the force rms, N, and first touch, s."""

    modulus_pa: float
    ci95_pa: tuple[float, float]
    misfit_n: np.ndarray
    force_n: np.ndarray
    onset_s: np.ndarray


def outcome_of(
    presses: Presses, modulus_pa: float, ci95_pa: tuple[float, float], fit: ModulusFit | None
) -> Outcome:
    """Of fitted presses; the paper's method (no fit) states no misfit."""
    net, touched = presses.net, presses.press[presses.counted]
    squared = np.bincount(touched, (net.force[presses.counted] ** 2).sum(axis=1), len(presses))
    force = np.sqrt(squared / np.maximum(np.bincount(touched, minlength=len(presses)), 1))
    misfit = np.full(len(presses), np.nan) if fit is None else fit.press.rms_n
    return Outcome(modulus_pa, ci95_pa, misfit, force, presses.onset_s)


def outcome(result: Outcome) -> Iterator[Finding]:
    """A modulus or interval that is none; a modulus beyond soft objects; a misfit as large as the force."""
    modulus, (low, high) = result.modulus_pa, result.ci95_pa
    numbers = np.array([modulus, low, high])
    if not np.isfinite(numbers).all() or not 0 < low <= high:
        yield Finding(
            "no interval",
            f"the modulus is {modulus:.4g} Pa with the interval {low:.4g} to {high:.4g} Pa",
            "no number",
            "presses contradict one another: see the other findings; press more places",
            np.inf,
            np.inf,
        )
    elif not LEAST_PA < modulus < MOST_PA:
        yield Finding(
            "modulus",
            f"the modulus is {modulus:.4g} Pa; objects that can be felt so have 0.5 kPa to 5 MPa",
            f"{max(LEAST_PA / modulus, modulus / MOST_PA):.3g} times beyond",
            "check the units of position and force, and the tip's radius",
            np.inf,
            np.inf,
        )
    known = np.isfinite(result.misfit_n) & (result.force_n > 0)
    if not known.any():
        return
    share = result.misfit_n[known] / result.force_n[known]
    typical = float(np.median(share))
    if typical < _MISFIT:
        return
    worst = int(np.flatnonzero(known)[np.argmax(share)])
    at = float(result.onset_s[worst])
    yield Finding(
        "misfit",
        f"the model misses half of the presses by more than {100 * typical:.0f} % of their force (rms)",
        f"{known.sum()} presses; 5 to 20 % is usual",
        "see the other findings; `palpate diagnose` names what the model lacks",
        float(typical),
        np.inf,
        (at - 0.2, at + 1.0),
        ("fx", "fy", "fz"),
    )
