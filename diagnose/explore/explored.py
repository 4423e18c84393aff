"""What an exploration came to: what was known after each touch, and why it ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.diagnosis.explore.estimate import Estimate
from palpate.diagnosis.explore.goals import GoalOptions
from palpate.diagnosis.explore.state import State
from palpate.diagnosis.explore.suggestion import Suggestion
from palpate.mechanics.result import Result


@dataclass(frozen=True)
class Step:
    """One touch: what was asked for (None: nothing was, as of touches that an earlier run made), and what was
    known after it."""

    asked: Suggestion | None
    state: State


@dataclass(frozen=True, eq=False, repr=False)
class Explored(Result):
    """An exploration so far, by `Explorer.explored`.

    path: of its recording, "" where none was written. last: what would be done next, or the word to stop with
    its reason. estimate: shape, touches and modulus. truth: of a phantom, the stated values. It prints, plots
    (modulus and surface over the touches), and writes its page.
    """

    path: str
    steps: tuple[Step, ...]
    state: State
    last: Suggestion
    goals: GoalOptions
    estimate: Estimate
    truth: Mapping[str, Any] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """The figures of `palpate explore --json`."""
        steps = [
            {"suggest": s.asked.table(), "state": s.state.table()} for s in self.steps if s.asked is not None
        ]
        truth = {"truth": dict(self.truth)} if self.truth else {}
        return {"recording": self.path, "steps": steps, **self.state.table(), **truth}
