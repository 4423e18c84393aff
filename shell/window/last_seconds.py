"""The last seconds of a session as curves: force and depth over time."""

from __future__ import annotations

import numpy as np


class Trace:
    """Rows of (time s, force N, depth m, second renderer's force N), the newest `seconds` of them."""

    COLUMNS = 4

    def __init__(self, seconds: float = 6.0, rate_hz: float = 1000.0) -> None:
        self.seconds = seconds
        self._rows = np.zeros((0, self.COLUMNS))
        self._most = int(seconds * rate_hz * 1.2)

    def add(self, rows: np.ndarray) -> None:
        """Append (n, 4) rows; old ones fall off."""
        if len(rows):
            self._rows = np.vstack([self._rows, rows])[-self._most :]

    def curves(self, points: int = 600) -> np.ndarray:
        """(k, 4) at most `points` rows; time counts from now, so that it runs from -seconds to 0."""
        rows = self._rows
        if not len(rows):
            return np.zeros((0, self.COLUMNS))
        rows = rows[rows[:, 0] > rows[-1, 0] - self.seconds]
        shown = rows[:: max(1, len(rows) // points)].copy()
        shown[:, 0] -= rows[-1, 0]
        return shown
