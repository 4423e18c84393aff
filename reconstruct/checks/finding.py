"""A finding of the check-up, and the two bars that every one of them has passed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binom

SURE_P = 1e-6
"""A statistic's probability on a sound recording must be below this before it makes a finding."""
SURE_ODDS = 1e3
"""Where two readings of the same samples are compared, the better must be so much more probable."""
GRAVE = 0.25
"""A finding that may move the modulus by this share, or makes it meaningless, is grave."""


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with a recording.

    name: of the kind. saw: what was seen, with figures. sure: how sure, by which
    statistic. todo: what to do. error: relative standard error that it adds to the modulus, infinite where
    nothing can be said. decades: -log10 of the probability on a sound recording, or log10 of the odds.
    stretch: (start, end) s of the recording as it is, worth a look. channels: columns of the recording.
    """

    name: str
    saw: str
    sure: str
    todo: str
    error: float
    decades: float
    stretch: tuple[float, float] | None = None
    channels: tuple[str, ...] = ()

    @property
    def grave(self) -> bool:
        """Whether the modulus is not to be believed."""
        return not self.error < GRAVE

    def line(self) -> str:
        """One line for a person."""
        return f"{'GRAVE' if self.grave else 'note'}: {self.name}: {self.saw} ({self.sure}); {self.todo}"

    def as_json(self) -> dict[str, Any]:
        """Its figures, keys with units."""
        return {
            "name": self.name,
            "grave": self.grave,
            "saw": self.saw,
            "sure": self.sure,
            "todo": self.todo,
            "modulus_error": self.error,
            "decades": self.decades,
            "stretch_s": self.stretch,
            "channels": self.channels,
        }


def decades_of_tail(count: int, among: int, share: float) -> float:
    """-log10 of the probability that `count` or more of `among` happen where each does with this share."""
    if count <= 0 or among <= 0:
        return 0.0
    return float(-binom.logsf(count - 1, among, min(max(share, 1e-12), 1.0)) / np.log(10))


def sure(decades: float) -> bool:
    """Whether a probability of 10^-decades is beyond the bar."""
    return decades > -np.log10(SURE_P)


def p_words(decades: float) -> str:
    """The probability in words."""
    return f"p = 1e-{min(decades, 300):.0f}"
