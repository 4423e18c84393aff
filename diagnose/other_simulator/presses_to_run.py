"""Which presses a slow simulator is run over."""

from __future__ import annotations

import numpy as np

from palpate.diagnosis.forward.touches import LEAST_PRESSES
from palpate.mechanics.presses.table import LEAD_S, Presses


def spread_out(presses: Presses, most: int | None) -> np.ndarray:
    """(p,) bool: at most so many presses (None: all, never fewer than a diagnosis needs), as far from each
    other as they are short. Fewer are always some of more."""
    count = len(presses) if most is None else min(max(most, LEAST_PRESSES), len(presses))
    lasts = presses.end_s - presses.onset_s + 2 * LEAD_S
    chosen = np.zeros(len(presses), dtype=bool)
    away = np.ones(len(presses))
    for _ in range(count):
        worth = np.where(chosen, -1.0, away / lasts)
        new = int(np.argmax(worth))
        distance = np.linalg.norm(presses.point - presses.point[new], axis=1)
        away = distance if not chosen.any() else np.minimum(away, distance)
        chosen[new] = True
    return chosen
