"""A velocity from positions, for devices that give none: a low-passed difference.

Positions come in steps of the device's resolution; an unfiltered difference is that step over a millisecond.
"""

from __future__ import annotations

import math

import numpy as np

LONGEST_GAP_S = 0.1


class VelocityEstimate:
    """First-order low pass of `time_constant_s` over differences; a long gap starts it anew."""

    def __init__(self, time_constant_s: float = 0.008) -> None:
        self.time_constant_s = time_constant_s
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next velocity is zero."""
        self._position: np.ndarray | None = None
        self._time_s = 0.0
        self._velocity = np.zeros(3)

    def update(self, time_s: float, position_m: np.ndarray) -> np.ndarray:
        """(3,) m/s after this position."""
        duration = time_s - self._time_s
        if self._position is None or duration > LONGEST_GAP_S:
            self._velocity = np.zeros(3)
        elif duration <= 0:
            return self._velocity
        else:
            keep = math.exp(-duration / self.time_constant_s)
            self._velocity = keep * self._velocity + (1 - keep) * (position_m - self._position) / duration
        self._position, self._time_s = position_m, time_s
        return self._velocity
