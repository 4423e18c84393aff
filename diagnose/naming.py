"""When an effect is named: the probability that what a score says is there, and not our own law's error.

Two things are asked of places that the fit has not seen. How much more likely does the effect make them (its
evidence)? And how much of the plain gap does it close there, at least (its closure)? A law is never exact:
what it misses is felt at many places, so evidence alone grows with the force over the noise without end, and
a gap that closes a little closes by chance. Together they tell causes from errors of ours; how they weigh was
fitted once, to recordings of the virtual laboratory whose seeds stand beside the weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Weights:
    """Log odds = offset + evidence * log10(gain in log likelihood) + closure * share of the held-out gap."""

    offset: float
    evidence: float
    closure: float

    def log_odds(self, gain: float, closes: float) -> float:
        """That an effect is there. gain: log likelihood, of held-out places. closes: share of the gap."""
        return float(
            self.offset + self.evidence * np.log10(max(gain, 1.0)) + self.closure * np.clip(closes, -1, 1)
        )


WEIGHTS = Weights(offset=-14.3, evidence=4.5, closure=13.6)
"""Fitted by `palpate bench diagnose-weights` to the development seeds of the blind benchmark."""


def lower_closure(
    before: np.ndarray, after: np.ndarray, counts: np.ndarray, noise: float, least: float
) -> float:
    """The share of the held-out gap that is closed in nine of ten resamplings of the places.

    before, after: (g,) N^2, sums of squares of each place; counts: (g,) samples; noise: N^2, mean square of a
    sample's noise; least: N^2, what a gap that matters exceeds it by: a smaller one is not closed by less.
    """
    drawn = np.random.default_rng(0).integers(0, len(before), (400, len(before)))
    n = counts[drawn].sum(axis=1)
    gap = np.maximum(before[drawn].sum(axis=1) / n - noise, least)
    return float(np.quantile((before - after)[drawn].sum(axis=1) / n / gap, 0.1))
