"""When an effect is named: the probability that what a score says is there, and not our own law's error.

Two things are asked of places that the fit has not seen. How much more likely does the effect make them (its
evidence)? And how much of the plain gap does it close there, at least (its closure)? A law is never exact:
what it misses is felt at many places, so evidence alone grows with the force over the noise without end, and
a gap that closes a little closes by chance. Together they tell causes from errors of ours; how they weigh was
fitted once, to the recordings that stand beside the weights.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from diagnose.search.gaps import resampled

RESAMPLES = 400


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


FILE = Path(__file__).with_name("naming.toml")
WEIGHTS = Weights(**tomllib.loads(FILE.read_text())["weights"])
"""Fitted to judged cases; the file says which."""


def share_closed(
    before: np.ndarray, after: np.ndarray, counts: np.ndarray, noise: float, least: float, axis: int = -1
) -> np.ndarray:
    """The share of the held-out gap that is closed.

    before, after: (..., g) N^2, sums of squares of each place; counts: (..., g) samples; noise: N^2, mean
    square of a sample's noise; least: N^2, what a gap that matters exceeds it by: a smaller one is not closed
    by less.
    """
    n = counts.sum(axis=axis)
    gap = np.maximum(before.sum(axis=axis) / n - noise, least)
    return (before - after).sum(axis=axis) / n / gap


def lower_closure(
    before: np.ndarray, after: np.ndarray, counts: np.ndarray, noise: float, least: float, doubt: float
) -> float:
    """`share_closed` in all but a share `doubt` of the resamplings of the places, at least."""

    def share(old: np.ndarray, new: np.ndarray, number: np.ndarray, axis: int = -1) -> np.ndarray:
        return share_closed(old, new, number, noise, least, axis)

    draws = resampled((before, after, counts), share, RESAMPLES, np.random.default_rng(0))
    return float(np.quantile(draws, doubt))
