"""Progress is told to a callable, so that pure code can report without knowing a terminal."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""`progress(stage, fraction)`: the stage's name in plain words and the share of it done, 0 to 1."""


def silent(stage: str, fraction: float) -> None:
    """The default: tells nobody."""
