"""Progress is reported to a callable, so that pure code needs no terminal; and the time that steps take."""

from __future__ import annotations

import time
from collections.abc import Callable

Progress = Callable[[str, float], None]
"""`progress(stage, fraction)`: the stage's name in plain words and the share of it done, 0 to 1."""


def silent(stage: str, fraction: float) -> None:
    """The default: reports to nobody."""


def part(progress: Progress, low: float, high: float) -> Progress:
    """The progress of a part of the work, from `low` to `high` of the whole."""
    return lambda stage, fraction: progress(stage, low + (high - low) * fraction)


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
