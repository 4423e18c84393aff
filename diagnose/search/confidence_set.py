"""The model confidence set: which explanations the sites cannot tell from the best one.

Hansen, Lunde & Nason (2011), "The Model Confidence Set", Econometrica 79: explanations are dropped one after
another while the hypothesis that all that are left predict equally well is rejected. The units are sites, as
samples within a touch, and touches within a place, are not independent.
"""

from __future__ import annotations

import numpy as np


def confidence_p(losses: np.ndarray, rng: np.random.Generator, draws: int = 1000) -> np.ndarray:
    """(m,) p value of each explanation: it is in the set of confidence 1 - alpha where p > alpha.

    losses: (m, g) loss of each of m explanations at each of g sites, smaller is better. Statistic: the
    greatest t of an explanation's loss against the mean of those left (T_max), its distribution by bootstrap
    of sites. The best explanation has p = 1.
    """
    m, g = losses.shape
    p = np.ones(m)
    left = list(range(m))
    weight = rng.multinomial(g, np.full(g, 1 / g), size=draws) / g  # (draws, g), shared by all rounds
    level = 0.0
    while len(left) > 1:
        excess = losses[left] - losses[left].mean(axis=0)
        mean = excess.mean(axis=1)
        drawn = weight @ excess.T - mean
        error = np.sqrt((drawn**2).mean(axis=0)) + 1e-12
        t = mean / error
        level = max(level, float((np.max(drawn / error, axis=1) >= t.max()).mean()))
        worst = int(np.argmax(t))
        p[left.pop(worst)] = level
    return p
