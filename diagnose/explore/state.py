"""What an exploration knows so far, goal by goal."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.diagnosis.explore.causes import Causes, words
from palpate.diagnosis.explore.goals import GoalState


@dataclass(frozen=True)
class ExplorationState:
    """What is known. modulus_pa, interval: nan where nothing is known, beside causes where those are asked
    for. goals: how far each is.

    presses: found and used; made: segments of presses that were added. seconds: of exploring so far.
    update_s: wall time of the last update by step. causes: where they are asked for and known;
    cause_at: how surely. trouble: why the last update could not be made, or "".
    """

    presses: int
    made: int
    seconds: float
    modulus_pa: float
    modulus_ci95_pa: tuple[float, float]
    surface_error_m: float
    surface: str
    goals: tuple[GoalState, ...]
    update_s: dict[str, float] = field(default_factory=dict)
    trouble: str = ""
    causes: Causes | None = None
    cause_at: float = 0.95

    @property
    def done(self) -> bool:
        """Whether every goal is met."""
        return bool(self.goals) and all(s.met for s in self.goals)

    def table(self) -> dict[str, Any]:
        """As JSON has it; what is unknown is null."""

        def known(x: float) -> float | None:
            return float(x) if np.isfinite(x) else None

        return {
            "presses": self.presses,
            "made": self.made,
            "seconds": self.seconds,
            "young_modulus_pa": known(self.modulus_pa),
            "young_modulus_ci95_pa": [known(x) for x in self.modulus_ci95_pa],
            "surface_error_m": known(self.surface_error_m),
            "surface": self.surface,
            "goals": {s.name: {"now": known(s.now), "goal": s.goal, "met": s.met} for s in self.goals},
            "done": self.done,
            "causes": None if self.causes is None else self.causes.table(self.cause_at),
            "update_s": self.update_s,
            "trouble": self.trouble,
        }

    @property
    def asked(self) -> str:
        """What each goal asks for: 'modulus within 5 %, surface within 2 mm'."""
        parts = {
            "cause": lambda goal: f"one cause at {100 * self.cause_at:g} %",
            "modulus": lambda goal: f"modulus within {100 * goal:g} %",
            "surface": lambda goal: f"surface within {1e3 * goal:g} mm",
        }
        return ", ".join(parts[goal.name](goal.goal) for goal in self.goals if goal.name in parts)

    @property
    def words(self) -> str:
        """How far each goal is, and what was asked for."""
        return self.reached + (f" (asked: {self.asked})" if self.asked else "")

    @property
    def reached(self) -> str:
        """How far each goal is."""
        parts = []
        for goal in self.goals:
            if goal.name == "cause":
                left = [] if self.causes is None else self.causes.not_ruled_out(self.cause_at)
                parts.append("cause: " + (" or ".join(map(words, left)) or "unknown"))
            elif not np.isfinite(goal.now):
                parts.append(f"{goal.name} unknown")
            elif goal.name == "modulus":
                parts.append(f"modulus {self.modulus_pa / 1e3:.1f} kPa within {100 * goal.now:.1f} %")
            else:
                parts.append(f"95 % of the surface within {1e3 * goal.now:.2f} mm")
        return ", ".join(parts)


def cause_goal(causes: Causes | None, at: float) -> GoalState:
    """How far it is to one cause alone: the greatest ratio beside the likeliest, of what rules it out."""
    if causes is None:
        return GoalState("cause", float("inf"), 1 - at)
    first = causes.not_ruled_out(at)[0]
    most = max(causes.missing(name, at) for name in causes.ratio if name != first)
    return GoalState("cause", (1 - at) * float(np.exp(most)), 1 - at)
