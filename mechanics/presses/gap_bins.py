"""How large a gap is, bin by bin: at each press, in thirds of the depth, in each phase of a touch, in thirds
of the time.

The one definition of the bins, for what a diagnosis states and for what is true: so the two can be compared.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.presses.table import HOLDING, LOADING, UNLOADING

THIRDS = 3
PHASES = (LOADING, HOLDING, UNLOADING)


def gap_by_bin(
    square: np.ndarray, press: np.ndarray, presses: int, depth: np.ndarray, phase: np.ndarray, t: np.ndarray
) -> dict[str, list[float]]:
    """N rms of a gap's 3-vector: `press_n` (presses,), `depth_n`, `phase_n`, `time_n` (3,); 0 for none.

    square: (n,) N^2, the gap's squared length, less what chance adds to it where it was measured (then it may
    be negative). press: (n,) of 0 to presses - 1. depth: (n,) in any unit, in thirds of the greatest. phase:
    (n,) of PHASES, any other number in none. t: (n,) s, in thirds from the first to the last.
    """
    since = t - t.min() if len(t) else t
    return {
        "press_n": _rms(square, press, presses),
        "depth_n": _rms(square, _third(depth), THIRDS),
        "phase_n": _rms(square, phase, len(PHASES)),
        "time_n": _rms(square, _third(since), THIRDS),
    }


def _third(x: np.ndarray) -> np.ndarray:
    greatest = x.max() if len(x) else 0.0
    return np.clip(np.floor(THIRDS * x / max(greatest, 1e-12)), 0, THIRDS - 1).astype(int)


def _rms(square: np.ndarray, index: np.ndarray, count: int) -> list[float]:
    inside = (index >= 0) & (index < count)
    sums = np.bincount(index[inside], weights=square[inside], minlength=count)
    number = np.maximum(np.bincount(index[inside], minlength=count), 1)
    return [float(v) for v in np.sqrt(np.maximum(sums / number, 0.0)).round(6)]
