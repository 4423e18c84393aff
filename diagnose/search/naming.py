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
from numpy.typing import ArrayLike
from scipy.special import expit

from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.mechanics.effects.base import Effect


@dataclass(frozen=True)
class Weights:
    """Log odds = offset + evidence * log10(gain in log likelihood) + closure * share of the held-out gap."""

    offset: float
    evidence: float
    closure: float

    def log_odds(self, gain: ArrayLike, closes: ArrayLike) -> np.ndarray:
        """(...) that an effect is there. gain: log likelihood, of held-out places. closes: share of the
        gap."""
        evidence = np.log10(np.maximum(gain, 1.0))
        return np.asarray(self.offset + self.evidence * evidence + self.closure * np.clip(closes, -1, 1))


FILE = Path(__file__).with_name("naming.toml")
WEIGHTS = Weights(**tomllib.loads(FILE.read_text())["weights"])
"""Fitted to judged cases; the file says which."""


@dataclass(frozen=True)
class Score:
    """How much better a candidate is than what it was added to.

    added: the effects in which the two differ. gain: log likelihood, deflated by its own lack of fit.
    per_group: (g,) the gain of each site, deflated likewise. size_n: rms change of the predicted force, N.
    share: of the old held-out excess over the noise (of a lump, of the fitted one). closes: the same, at
    least, over resampled sites.
    """

    added: tuple[Effect, ...]
    gain: float
    size_n: float
    share: float
    closes: float
    per_group: np.ndarray
    candidate: JudgedSet

    @property
    def effect(self) -> Effect:
        """The effect that is scored; the first of a pair."""
        return self.added[0]

    @property
    def name(self) -> str:
        """Its name; of a pair both."""
        return "+".join(e.name for e in self.added)

    @property
    def evidence(self) -> float:
        """The gain that counts: without the site that gains most, as one place that slipped, or whose surface
        is wrong, speaks for whatever bends it. A lump lives in few places: all, less the price of which."""
        if self.effect.hints.few_places:
            return self.gain - float(np.log(len(self.per_group)))
        return self.gain - max(float(self.per_group.max()), 0.0)

    @property
    def closure(self) -> float:
        """The share of the held-out gap that counts: at least so much; of a lump, which closes it in few
        places, as it is."""
        return self.share if self.effect.hints.few_places else self.closes

    @property
    def log_odds(self) -> float:
        """That it is there, rather than an error of our own law."""
        return float(WEIGHTS.log_odds(self.evidence, self.closure))

    @property
    def probability(self) -> float:
        """The same as a probability."""
        return float(expit(self.log_odds))

    @property
    def may_be(self) -> bool:
        """Whether it would be as likely as not if it closed the whole gap."""
        return float(WEIGHTS.log_odds(self.evidence, 1.0)) > 0
