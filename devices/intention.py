"""Where a simulated hand means to be: along a path, or exploring by feel; state machines without a clock.

`intention.place(time_s, position_m, force_on_tool_n)` returns the intended place (3,) m; called with times
that do not decrease.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from palpate.mechanics.errors import DeviceError


class Intention(Protocol):
    """What the hand means to do next, from what it feels."""

    def place(self, time_s: float, position_m: np.ndarray, force_on_tool_n: np.ndarray) -> np.ndarray:
        """(3,) m, where the hand means to be at `time_s` (s since the device was opened)."""


def minimum_jerk(fraction: float) -> float:
    """The share of a reach done at a share of its time: 10 s^3 - 15 s^4 + 6 s^5 (Flash and Hogan 1985)."""
    s = min(max(fraction, 0.0), 1.0)
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


class HandPath:
    """Waypoints (n, 3) m at times (n,) s, reached with minimum-jerk strokes; rests at the last one.

    `even=True` goes along straight pieces at even speed instead, for paths sampled finely (a tracing, a
    replay).
    """

    def __init__(self, times_s: np.ndarray, waypoints_m: np.ndarray, *, even: bool = False) -> None:
        self.times_s = np.asarray(times_s, dtype=float)
        self.waypoints_m = np.asarray(waypoints_m, dtype=float)
        self.even = even
        n = len(self.times_s)
        if n < 1 or self.waypoints_m.shape != (n, 3) or (np.diff(self.times_s) <= 0).any():
            raise DeviceError(
                f"a hand's path needs times that increase and (n, 3) waypoints; got {self.times_s.shape} and "
                f"{self.waypoints_m.shape}"
            )

    @property
    def duration_s(self) -> float:
        """When the last waypoint is reached."""
        return float(self.times_s[-1])

    def place(self, time_s: float, position_m: np.ndarray, force_on_tool_n: np.ndarray) -> np.ndarray:
        """The place on the path, whatever is felt."""
        times = self.times_s
        k = int(np.searchsorted(times, time_s, side="right"))
        if k == 0 or k == len(times):
            return self.waypoints_m[min(k, len(times) - 1)].copy()
        fraction = (time_s - times[k - 1]) / (times[k] - times[k - 1])
        share = fraction if self.even else minimum_jerk(fraction)
        return self.waypoints_m[k - 1] + share * (self.waypoints_m[k] - self.waypoints_m[k - 1])


TURN_S, TURN_M_PER_S = 0.6, 0.8
"""A turn to the next direction takes so long, longer where it would go faster than this."""
LEAST_RADIUS_M = 0.005
SPREAD = 0.2
"""Cosine of the widest angle between a direction and `up`."""


class FreeExploration:
    """Presses from random directions towards a centre until it feels `target_force_n`, holds, draws back.

    Needs no geometry: it starts `radius_m` from the centre, moves inwards at `speed_m_per_s` until the
    force on the tool reaches the target or it stands LEAST_RADIUS_M from the centre, waits `hold_s`, and
    returns. Directions lie within SPREAD of `up`; every choice comes from `seed`.
    """

    def __init__(
        self,
        centre_m: ArrayLike,
        radius_m: float,
        *,
        up: ArrayLike = (0.0, 0.0, 1.0),
        target_force_n: float = 1.0,
        speed_m_per_s: float = 0.02,
        hold_s: float = 0.3,
        seed: int = 0,
    ) -> None:
        self.centre_m = np.asarray(centre_m, dtype=float)
        self.radius_m = radius_m
        axis = np.asarray(up, dtype=float)
        self.up = axis / np.linalg.norm(axis)
        self.target_force_n = target_force_n
        self.speed_m_per_s = speed_m_per_s
        self.hold_s = hold_s
        self._random = np.random.default_rng(seed)
        self._direction = self.up
        self._reach_m = radius_m
        self._phase = "around"
        self._from = self.up
        self._turn_start_s = 0.0
        self._hold_until_s = 0.0
        self._last_s = 0.0

    def _new_direction(self) -> np.ndarray:
        while True:
            direction = self._random.normal(size=3)
            direction /= np.linalg.norm(direction)
            if direction @ self.up > SPREAD:
                return direction

    def place(self, time_s: float, position_m: np.ndarray, force_on_tool_n: np.ndarray) -> np.ndarray:
        """In, hold, out, and around to the next direction."""
        step = max(0.0, time_s - self._last_s) * self.speed_m_per_s
        self._last_s = time_s
        if self._phase == "in":
            self._reach_m -= step
            felt = float(np.linalg.norm(force_on_tool_n)) >= self.target_force_n
            if felt or self._reach_m <= LEAST_RADIUS_M:
                self._phase, self._hold_until_s = "hold", time_s + self.hold_s
        elif self._phase == "hold" and time_s >= self._hold_until_s:
            self._phase = "out"
        elif self._phase == "out":
            self._reach_m += 2.0 * step
            if self._reach_m >= self.radius_m:
                self._reach_m, self._phase = self.radius_m, "around"
                self._from, self._direction = self._direction, self._new_direction()
                self._turn_start_s = time_s
        if self._phase == "around":
            angle = float(np.arccos(np.clip(self._from @ self._direction, -1.0, 1.0)))
            # a minimum-jerk stroke is 15 / 8 as fast in its middle as on the way
            turn_s = max(TURN_S, 1.875 * angle * self.radius_m / TURN_M_PER_S)
            share = minimum_jerk((time_s - self._turn_start_s) / turn_s)
            if share >= 1.0:
                self._phase = "in"
            # along the great circle: the straight way between opposite directions leads past the middle
            between = self._direction
            if angle > 1e-6:
                between = np.sin((1.0 - share) * angle) * self._from + np.sin(share * angle) * between
            return self.centre_m + self.radius_m * between / np.linalg.norm(between)
        return self.centre_m + self._reach_m * self._direction
