"""When an effect is named: the probability that what a score says is there, and not our own law's error.

How much more likely does the effect make what was pressed (its evidence)? A law is never exact: what it
misses is felt at many places, so evidence would grow with the force over the noise without end. So it counts
in units of what the effect leaves at the places, over what our own errors are said to be (JudgedSet.over):
the right cause leaves no more than that, an error of ours that is bent into another form does. What makes
places worse that the fit has not seen is no cause. How much of the gap a cause closes says whether it
matters, never whether it is there. The weights were fitted once, to the recordings that stand beside them.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import expit

from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.mechanics.effects.base import Effect, Scope
from palpate.mechanics.law_errors import Unnamed


@dataclass(frozen=True)
class Weights:
    """Log odds = evidence * log10(gain in log likelihood over that of the border). border: of what acts in
    space; in_time: of what has a loop, which the noise of every sample tells, and slow noise imitates;
    simulated: of another simulator's force, which has none. lapse: the share of the surest answers in which
    something else was there."""

    border: float
    in_time: float
    simulated: float
    evidence: float
    lapse: float

    def border_of(self, scope: Scope, *, measured: bool = True) -> float:
        """The gain from which an effect of a scope is likelier there than not."""
        if not measured:
            return self.simulated
        return self.in_time if scope is Scope.TIME else self.border

    def log_odds(self, gain: ArrayLike, border: float) -> np.ndarray:
        """(...) that an effect is there. gain: log likelihood."""
        return np.asarray(self.evidence * np.log10(np.maximum(gain, 1.0) / border))


ALL_TOLD = 1e12


def most_told(effect: Effect, values: np.ndarray, share: float) -> float:
    """Log likelihood that an effect of these values (k,) has at most, as our own law may err so where nothing
    is wrong; a very large number where all is told. share: of the force, rms, that it changes."""
    most = ALL_TOLD
    if effect.hints.untold:
        beyond = (values - effect.ideal) / effect.hints.untold
        most = 0.5 * float(beyond @ beyond)
    if effect.hints.few_places or effect.scope is Scope.TIME:
        return most  # single places have errors of their own, and no elastic law has a loop
    return min(most, 0.5 * (share / Unnamed.alike.value) ** 2)


FILE = Path(__file__).with_name("naming.toml")
WEIGHTS = Weights(**tomllib.loads(FILE.read_text())["weights"])
"""Fitted to judged cases; the file says which."""


@dataclass(frozen=True)
class Score:
    """How much better a candidate is than what it was added to.

    added: the effects in which the two differ. gain: log likelihood, deflated by its own lack of fit.
    per_group: (g,) the gain of each site, deflated likewise. size_n: rms change of the predicted force, N;
    share: the same over the force.
    border: the evidence from which it is likelier there than not.
    foretold: log likelihood gained at places that the fit has not seen, all in all; of a lump as fitted, 0
    where the plain squares do not shrink.
    """

    added: tuple[Effect, ...]
    gain: float
    size_n: float
    share: float
    foretold: float
    per_group: np.ndarray
    candidate: JudgedSet
    border: float

    @property
    def effect(self) -> Effect:
        """The effect that is scored; the first of a pair."""
        return self.added[0]

    @property
    def name(self) -> str:
        """Its name; of a pair both."""
        return "+".join(e.name for e in self.added)

    @property
    def shown(self) -> float:
        """The gain without the site that gains most, as one place that slipped, or whose surface is wrong,
        speaks for whatever bends it. A lump lives in few places: all, less the price of which."""
        if self.effect.hints.few_places:
            return self.gain - float(np.log(len(self.per_group)))
        return self.gain - max(float(self.per_group.max()), 0.0)

    @property
    def evidence(self) -> float:
        """What is shown, but no more than our own law's errors leave to be told."""
        return min(self.shown, most_told(self.effect, self.candidate.found.of(self.effect.name), self.share))

    @property
    def by_one_place(self) -> bool:
        """Whether one place alone speaks for it: the others gain less than the choice of a place costs."""
        return float(self.per_group.sum() - self.per_group.max()) <= np.log(len(self.per_group))

    @property
    def log_odds(self) -> float:
        """That it is there, rather than an error of our own law."""
        return float(WEIGHTS.log_odds(self.evidence, self.border))

    @property
    def odds_of_shown(self) -> float:
        """Log odds beside a rival for the same change: our own law's errors may be either's, and do not
        choose."""
        return float(WEIGHTS.log_odds(self.shown, self.border))

    @property
    def probability(self) -> float:
        """The same as a probability."""
        return float(expit(self.log_odds))
