"""Progress is reported to a callable, so that pure code needs no terminal; and the time that steps take."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

Progress = Callable[[str, float], None]
"""`progress(stage, fraction)`: the stage's name in plain words and the share of it done, 0 to 1."""

Clocked = Callable[[], float]
"""A clock, s."""


def silent(stage: str, fraction: float) -> None:
    """The default: reports to nobody."""


def unsaid(words: str) -> None:
    """The default of what is told in whole sentences: nobody hears."""


def part(progress: Progress, low: float, high: float) -> Progress:
    """The progress of a part of the work, from `low` to `high` of the whole."""
    return lambda stage, fraction: progress(stage, low + (high - low) * fraction)


class TimeIsUp(Exception):
    """The time that was given is over."""


def until(
    progress: Progress, begun_s: float, within_s: float, share: float = 1.0, now: Clocked = time.monotonic
) -> Progress:
    """The same by the clock: the share that is done is that of the time, within_s from begun_s on, and once
    that share of it has passed TimeIsUp is raised."""

    def told(stage: str, fraction: float) -> None:
        passed = (now() - begun_s) / within_s
        if passed > share:
            raise TimeIsUp
        progress(stage, passed)

    return told


class Clock:
    """Wall time of steps, s: `lap` books what passed since the last to a name."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        """The step `name` ends here."""
        now = time.perf_counter()
        self.laps[name] = self.laps.get(name, 0.0) + now - self._last
        self._last = now


@dataclass
class Remaining:
    """What is left of a piece of work, by the pace of what was done since it was first told of.

    now: the clock, s.
    """

    now: Callable[[], float] = time.monotonic
    _begun: float | None = field(default=None, init=False)
    _first: float = field(default=0.0, init=False)
    _done: float = field(default=0.0, init=False)

    def tell(self, fraction: float) -> None:
        """The share of the work that is done, 0 to 1."""
        if self._begun is None:
            self._begun, self._first = self.now(), fraction
        self._done = max(self._done, fraction)

    @property
    def elapsed_s(self) -> float:
        """s, since the first share was told."""
        return 0.0 if self._begun is None else self.now() - self._begun

    def words(self) -> str:
        """'about 2 min left', by what was done in the time that passed; '' where nothing was done yet."""
        done = self._done - self._first
        if done <= 0:
            return ""
        left = self.elapsed_s * (1 - self._done) / done
        if left < 10:
            return "some seconds left"
        if left < 90:
            return f"about {10 * round(left / 10)} s left"
        return f"about {round(left / 60)} min left" if left < 5400 else f"about {left / 3600:.1f} h left"
