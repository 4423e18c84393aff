"""What no exploration of an object by hand can be: a wrong clock or unit, a force that no sensor reads."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.bounds import LARGEST_N
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.recording.files import MOST_SAMPLES

WIDEST_PATH_M = 1.5
"""Greatest extent of a recorded path: objects are at most 1 m."""
_UNITS = {"micrometres": 1e-6, "millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254}
_HAND_M = (0.02, 0.6)
"""Extent of a path that a hand makes round an object, to guess a wrong unit by."""
_RATE_FACTOR = 1.5


def check_sane(t: np.ndarray, rate: float, position: np.ndarray, force: np.ndarray) -> None:
    """Raises RecordingError for what no exploration of an object of 1 mm to 1 m by hand can be.

    t: (n,) s. rate: stated, Hz. position: (n, 3) m. force: (n, 3) N.
    """
    block = min(100, len(t) - 1)
    read = block / float(np.median(t[block:] - t[:-block]))
    if not _near(read, rate):
        units = {"milliseconds": 1e3, "microseconds": 1e6}
        like = next((unit for unit, scale in units.items() if _near(read * scale, rate)), "")
        raise RecordingError(
            f"t steps by {1 / read:.4g}, in seconds {read:.4g} Hz, where sample_rate_hz is {rate:g}: "
            + (f"these look like {like}; write t in seconds" if like else "state the true rate")
        )
    if (t[-1] - t[0]) * max(rate, read) > MOST_SAMPLES:
        gap = int(np.argmax(np.diff(t)))
        raise RecordingError(
            f"the clock runs from {t[0]:.6g} to {t[-1]:.6g} s (longest gap {t[gap + 1] - t[gap]:.4g} s, "
            f"after data row {gap + 1}): at most {MOST_SAMPLES / rate:.6g} s at {rate:g} Hz; mend the clock "
            "or cut the recording"
        )
    extent = float(np.ptp(position, axis=0).max())
    if extent > WIDEST_PATH_M:
        guesses = [u for u, s in _UNITS.items() if _HAND_M[0] <= extent * s <= _HAND_M[1]]
        like = f"these look like {' or '.join(guesses)}; " if guesses else ""
        raise RecordingError(
            f"the tip's path is {extent:.4g} m across: {like}x, y, z must be metres, at most "
            f"{WIDEST_PATH_M:g} m across"
        )
    loud = np.flatnonzero((np.abs(force) > LARGEST_N).any(axis=1))
    if len(loud):
        raise RecordingError(
            f"{len(loud)} samples have a force above {LARGEST_N:g} N (first in data row {loud[0] + 1}): no "
            "sensor reads that; remove or repair those rows"
        )


def _near(value: float, other: float) -> bool:
    return other / _RATE_FACTOR < value < other * _RATE_FACTOR
