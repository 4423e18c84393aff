"""The modulus beside causes: what each hypothesis takes off the presses, and the modulus of the rest.

Under a cause its parameters are fitted together with the modulus (`fit`), what it changes is taken off
every press, and the modulus is that of the presses so corrected, with the interval that any presses have
(`modulus`), widened by what the cause's own parameters leave open. Over hypotheses it is the
mixture by their posterior probabilities.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from palpate.diagnosis.explore.causes import NONE, Causes
from palpate.diagnosis.explore.estimate import ExplorationEstimate, modulus_of
from palpate.diagnosis.explore.weighing import Weighing
from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.search.descent import fit
from palpate.diagnosis.search.fit import settings_of
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.effects.time_delay import EFFECT as DELAY
from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusFit

MOST = 3
"""Hypotheses that are fitted, the likeliest."""
LEAST = 0.025
"""Of their probabilities: what is less likely moves no end of a 95 % interval."""
SAME_S = 1e-6
STEPS = 60
"""Of a fit, at most: two branches of a relaxation lie along a valley, where 8 left a modulus 2.6 % low."""


def modulus_beside(
    estimate: ExplorationEstimate, weighing: Weighing, causes: Causes, seed: int = 0
) -> tuple[float, tuple[float, float]]:
    """(Pa, 95 % interval) of the modulus over the likeliest hypotheses."""
    assert estimate.fit is not None
    plain = _by(estimate.fit)
    found = []
    for name, probability in sorted(causes.probability.items(), key=lambda item: -item[1])[:MOST]:
        if probability < LEAST:
            continue
        sought = name != NONE and effect(name).hints.seek is None
        log, sd = _beside(estimate, weighing, causes, name, seed) if sought else plain
        if np.isfinite(log) and 0 < sd < np.inf:
            found.append((log, sd, probability))
    if not found:
        return estimate.fit.modulus_pa, estimate.fit.ci95_pa
    logs, sds, shares = np.array(found).T
    low, high = logs.min() - 8 * sds.max(), logs.max() + 8 * sds.max()

    def at(level: float) -> float:
        return float(np.exp(brentq(lambda x: shares @ (norm.cdf((x - logs) / sds) - level), low, high)))

    return at(0.5), (at(0.025), at(0.975))


def log_sd(interval: tuple[float, float]) -> float:
    """Standard deviation of the logarithm of what has this 95 % interval."""
    low, high = interval
    return float(np.log(high / low) / 3.92)


def _by(made: ModulusFit) -> tuple[float, float]:
    """(log, its standard deviation)."""
    return float(np.log(made.modulus_pa)), log_sd(made.ci95_pa)


def _beside(
    estimate: ExplorationEstimate, w: Weighing, causes: Causes, name: str, seed: int
) -> tuple[float, float]:
    """(log modulus, its standard deviation) of the presses with one cause taken off."""
    e = estimate
    assert e.presses_placed is not None and e.sites is not None
    assert e.exploration is not None and e.covariance is not None
    # a delay that was found is part of every hypothesis: presses are weighed as read
    late = (DELAY,) if e.presses_placed.delay_s and name != DELAY.name else ()
    acting = [effect(name), *late]
    fitted = fit(
        w.forward, w.whitener, acting, modulus=w.found.modulus, onset=w.found.onset, iterations=STEPS
    )
    # to where the ideal model has it from the first touches as found: a play or a delay has moved those too
    settings = settings_of(w.forward, fitted.effects, fitted.values, fitted.onset)
    change = np.nan_to_num(w.forward.predict(settings) - w.forward.predict(w.forward.ideal(fitted.modulus)))
    kept, presses = without(e.presses_placed, w.forward, change)
    covariance = e.covariance[np.ix_(kept, kept)]
    made = modulus_of(presses, e.sites.of(kept), e.exploration.noise_n, covariance, seed)
    over = w.inflation(causes.misfit)
    hessian = fitted.gram.sum(axis=0)[1:, 1:] + np.diag(fitted.prior)
    # what the cause's own parameters leave open of the modulus
    more = max(float(np.linalg.pinv(hessian)[0, 0]) - 1 / float(hessian[0, 0]), 0.0)
    log, sd = _by(made)
    return log, float(np.sqrt(sd**2 + more * over))


def without(presses: Presses, forward: Forward, change: np.ndarray) -> tuple[np.ndarray, Presses]:
    """(numbers (k,) of the presses that a forward model holds, a table of those with a change taken off).

    change: (n, 3) N, at the forward model's rows, in its presses' local frames; a delay that was found is
    part of it, and undone.
    """
    t = forward.touches
    device = np.einsum("nij,ni->nj", t.frame[t.press], change)
    number = np.searchsorted(presses.onset_s, t.onset_s - SAME_S)
    force = np.array(presses.force)
    for part, i in zip(t.parts, number, strict=True):
        own = presses.parts[i]
        if part.stop > part.start:
            for axis in range(3):
                force[own, axis] -= np.interp(presses.t[own], t.t[part], device[part, axis])
    return number, dataclasses.replace(presses, force=force, delay_s=0.0).of(number)
