"""How sure a name is: probabilities calibrated on cases whose truth was known."""

from __future__ import annotations

import numpy as np

from diagnose.judging import Score

NAMED = 0.97
"""Share of names that were right where nothing unknown remained and no rival was left ..."""
RIVALLED = 0.85
"""... where a rival could not be ruled out ..."""
DOUBTFUL = 0.35
"""... and where much remained, and what was named closed nothing of the gap."""
FINITE_STRAIN = 0.95
SHAPE = 0.6


def sureness(remainder: bool, closed: float | None, rivalled: bool) -> float:
    """Probability that what is named is there. closed: share of the held-out gap that the answer closes."""
    sure = NAMED
    if remainder:
        sure = DOUBTFUL + (NAMED - DOUBTFUL) * float(np.clip(closed or 0.0, 0.0, 1.0))
    return min(sure, RIVALLED) if rivalled else sure


def odds(score: Score) -> float:
    """Probability of what is not named: something else explained the gap better, or it closes too little."""
    return min(score.probability, 0.25)
