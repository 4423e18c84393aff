"""What the held force does to the hand: its work, booked by the side that holds it.

Only the device's side knows what it held and for how long: ticks come late, are skipped, and a force may have
expired meanwhile. So the work is summed here, reading by reading, and travels with each pose as one number.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from palpate.mechanics.bounds import FARTHEST_M, within


class _Held(NamedTuple):
    """(3,) N that acts from one time to another, s."""

    force: np.ndarray
    from_s: float
    until_s: float


class HeldForce:
    """The forces that act on the hand, and `work_j`, what they have given to it so far.

    delay_s: from handing a force over to its acting, where the device is slower than the loop.
    """

    def __init__(self, delay_s: float = 0.0) -> None:
        self.work_j = 0.0
        self._delay_s = delay_s
        self._held: deque[_Held] = deque()
        self._time_s = -np.inf
        self._place_m: np.ndarray | None = None

    def take(self, force_n: np.ndarray, now_s: float, hold_s: float) -> None:
        """Another force (3,) N takes over, for at most `hold_s`."""
        start = now_s + self._delay_s
        if self._held and self._held[-1].until_s > start:
            self._held.append(self._held.pop()._replace(until_s=start))
        if force_n.any():
            self._held.append(_Held(np.array(force_n), start, start + hold_s))

    def move(self, time_s: float, place_m: np.ndarray) -> None:
        """The hand was read at `place_m` (3,) m: book what acted since the reading before."""
        if not (within(place_m, FARTHEST_M) and time_s > self._time_s):
            return
        if self._place_m is not None:
            self.work_j += self._work(time_s, place_m - self._place_m)
        self._time_s, self._place_m = time_s, np.array(place_m)
        while self._held and self._held[0].until_s <= time_s:
            self._held.popleft()

    def _work(self, time_s: float, moved_m: np.ndarray) -> float:
        """Of even motion since the last reading; where a force ended unseen on the way, the most it was."""
        work, most, ended = 0.0, 0.0, False
        span = time_s - self._time_s
        for k, held in enumerate(self._held):
            along = float(held.force @ moved_m)
            work += along * max(0.0, min(held.until_s, time_s) - max(held.from_s, self._time_s)) / span
            most = max(most, along)
            following = self._held[k + 1].from_s if k + 1 < len(self._held) else np.inf
            ended = ended or held.until_s < min(following, time_s)
        return max(work, most) if ended else work
