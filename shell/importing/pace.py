"""The pace of a hand: what rows numbered by a stated rate make of its speed and of the time of a press."""

from __future__ import annotations

import numpy as np

from palpate.importing.meaning import best
from palpate.mechanics.plausible import EXPLORATION
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.checks.samples import Samples
from palpate.reconstruction.checks.units import measured

_OFF = (10.0, 100.0)
"""Factors by which a rate is mistaken upwards; a machine may go as slowly as it likes."""
_SEEN = ("speed", "touch")


def too_quick(recording: Recording) -> str:
    """A warning, which asks for another rate, where no hand is so quick as the stated one makes it; else ''.

    Both quantities are log-normal (`EXPLORATION`); the rate is doubted where a lower one is far likelier.
    """
    seen = {name: value for name, value in measured(Samples(recording)).items() if name in _SEEN}
    scores: dict[tuple[int, ...], float] = {
        (round(by),): sum(
            -0.5 * EXPLORATION[k].off(v, EXPLORATION[k].powers[0] * -float(np.log(by))) ** 2
            for k, v in seen.items()
        )
        for by in (1.0, *_OFF)
    }
    reading = best(scores)
    if reading.value == (1,) or not reading.sure:
        return ""
    rate = recording.sample_rate_hz / reading.value[0]
    told = " and ".join(
        f"a {EXPLORATION[k].words} of {v:.2g}, where {EXPLORATION[k].usual:.2g} is usual"
        for k, v in seen.items()
    )
    given = f"WARNING: rows at {recording.sample_rate_hz:g} Hz give {told}"
    return f"{given}: is it {rate:g} Hz? say --rate {rate:g}"
