"""How sure a name is: probabilities calibrated on cases whose truth was known."""

from __future__ import annotations

import numpy as np

from diagnose.judging import Score, Search

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


def odds(score: Score, search: Search, best: float) -> float:
    """Rough odds of what is not named: its share of the best gain, and how near the threshold it comes."""
    need = search.options.lump_gain if score.effect.few_places else search.options.gain
    over = 1 / (1 + np.exp(np.clip(-(score.gain - need) / max(0.25 * need, 1.0), -50, 50)))
    rank = np.exp(min(0.0, (score.gain - best) / max(0.1 * best, 20.0)))
    return float(np.clip(over * rank, 0.0, 0.25))
