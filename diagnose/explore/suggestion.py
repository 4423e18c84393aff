"""What to do next, and why: the touch that makes the most progress a second, or the word to stop.

What an exploration came to: what was known after each touch, and why it ended.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.diagnosis.explore.candidates import (
    RIGID_S,
    Known,
    ReachOptions,
    TouchCandidate,
    first_places,
    ranked,
    separations,
    support_gain,
)
from palpate.diagnosis.explore.causes import Causes, words
from palpate.diagnosis.explore.estimate import LEAST_PRESSES, ExplorationEstimate
from palpate.diagnosis.explore.goals import GoalOptions
from palpate.diagnosis.explore.modulus import log_sd
from palpate.diagnosis.explore.state import ExplorationState
from palpate.diagnosis.explore.weighing import Weighing
from palpate.mechanics.result import Result
from palpate.reconstruction.steps.s2_base import Boundary
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusOptions

FAR_FROM = 3.0
"""Times as much as all presses that are left are expected to show."""
BESIDE = {
    "rigid": "press the bare support three times, with 3 to 5 N: what yields there is the tool",
    "free": "wave and turn the tool in the air for three seconds: its weight and what it reads of nothing",
    "retrace": "slide once more around the object's foot: whether it, or the device, moved meanwhile",
}
"""What a complete exploration does beside pressing the object, in this order, and why."""


@dataclass(frozen=True)
class Suggestion:
    """What to do next. kind: 'trace', 'press', 'rigid' (press the bare support three times), 'free' (wave and
    turn the tool in the air), 'retrace' (trace the base once more) or 'stop'; the rest holds for a press;
    device frame, SI units.

    point: (3,) where the surface is expected; normal: (3,) outward there. Come from outside along -normal,
    begin clearance_m above, go on until the force rises, then depth_m deeper at speed_m_per_s, hold hold_s,
    and go back. seconds: how long it is expected to take. why: one sentence.
    """

    kind: str
    why: str
    point: np.ndarray | None = None
    normal: np.ndarray | None = None
    depth_m: float = 0.0
    speed_m_per_s: float = 0.0
    hold_s: float = 0.0
    clearance_m: float = 0.0
    seconds: float = 0.0

    def table(self) -> dict[str, Any]:
        """As JSON has it."""
        if self.kind != "press":
            return {"kind": self.kind, "why": self.why}
        assert self.point is not None and self.normal is not None
        return {
            "kind": self.kind,
            "point": [float(x) for x in self.point],
            "normal": [float(x) for x in self.normal],
            "depth_m": self.depth_m,
            "speed_m_per_s": self.speed_m_per_s,
            "hold_s": self.hold_s,
            "clearance_m": self.clearance_m,
            "seconds": self.seconds,
            "why": self.why,
        }


@dataclass(frozen=True)
class Situation:
    """All that a suggestion follows from.

    kinds: of the segments so far, in order. base, heights: outline, and m over the support of touches so far.
    air_hides: what the tool reads in the air hides the presses. here: (3,) m, where the tip is, and asked:
    (a, 3) m, places that were suggested. choose: another order of touching (places, touched, here) -> number
    of the next place; None goes where the progress is greatest.
    """

    state: ExplorationState
    goals: GoalOptions
    reach: ReachOptions
    tip_radius_m: float
    poisson_ratio: float
    kinds: tuple[str, ...]
    base: Boundary | None
    heights: np.ndarray
    air_hides: bool
    estimate: ExplorationEstimate
    causes: tuple[Causes, Weighing] | None
    here: np.ndarray
    asked: np.ndarray
    choose: Callable[[np.ndarray, np.ndarray, np.ndarray], int] | None

    @property
    def weighed(self) -> tuple[Weighing, Causes, float] | None:
        """(what evidence there is, causes by it, how surely one is asked for), where a touch may separate
        them."""
        if self.causes is None or self.goals.cause_at is None or self.choose is not None:
            return None
        causes, weighing = self.causes
        return weighing, causes, self.goals.cause_at


def suggest(s: Situation) -> Suggestion:
    """The touch that makes the most progress a second, or the word to stop, each with its reason."""
    found = _of_the_object(s)
    left = [kind for kind in BESIDE if kind not in s.kinds]
    if found.kind != "stop" or not s.goals.complete or s.base is None or not left:
        return found
    return Suggestion(left[0], BESIDE[left[0]], seconds=RIGID_S)


def _of_the_object(s: Situation) -> Suggestion:
    """The same, of what the object shows."""
    state, traced = s.state, s.kinds.count("trace")
    if not traced and s.base is None:
        return Suggestion("trace", "the base's outline is not known: slide once around the object's foot")
    if s.air_hides and "free" not in s.kinds:
        why = "what the tool reads in the air hides the presses: wave and turn it there for three seconds"
        return Suggestion("free", f"{why} ({state.trouble})")
    if s.base is None and traced >= s.goals.most:
        return Suggestion("stop", f"no tracing could be understood ({state.trouble})")
    if s.base is None:
        return Suggestion("trace", f"the tracing could not be understood ({state.trouble}): trace again")
    if state.done and state.presses >= LEAST_PRESSES:
        return Suggestion("stop", "every goal is met: " + state.words)
    if state.made >= s.goals.most:
        return Suggestion("stop", f"{state.made} presses were made, as many as allowed; " + state.words)
    if s.estimate.surface is None:
        return _first(s, s.base)
    best = _best(s)
    rigid = _on_support(s, best.worth if best else 0.0)
    if rigid is not None:
        return rigid
    if best is None or (best.worth <= 0 and s.choose is None) or _in_vain(s, best):
        why = "no touch in reach is expected to bring a goal nearer at this noise; " + state.words
        return Suggestion("stop", why)
    return Suggestion(
        "press", _why(s, best), best.point, best.normal, float(best.depth_m), best.speed_m_per_s,
        best.hold_s, s.reach.clearance_m, float(best.seconds),
    )  # fmt: skip


def _first(s: Situation, base: Boundary) -> Suggestion:
    height = float(s.heights.max()) if len(s.heights) else None
    places = first_places(base, s.tip_radius_m, height)
    # one that could not be used counts as made: come back to it last
    point, normal = places[s.state.made % len(places)] if height is not None else places[0]
    what = "how high the object is" if height is None else "where its sides and its top are"
    return Suggestion(
        "press", f"it tells {what}", point, normal, float(min(0.004, s.reach.deepest_m)),
        s.reach.press_speed_m_per_s, s.reach.hold_s, s.reach.clearance_m, 3.0,
    )  # fmt: skip


def _best(s: Situation) -> TouchCandidate | None:
    e = s.estimate
    if e.surface is None or e.exploration is None or e.fit is None:
        return None
    sd = log_sd(s.state.modulus_ci95_pa)
    presses = e.exploration.presses
    used = e.fit.weights > 0 if (e.fit.weights > 0).any() else np.ones(len(presses), dtype=bool)
    known = Known(
        surface=e.surface,
        goals=s.state.goals,
        touched=presses.point[used],
        depths_m=presses.depth_m[used],
        here=s.here,
        asked=s.asked,
        modulus_pa=s.state.modulus_pa,
        modulus_sd=sd,
        modulus_bias=min(ModulusOptions().law_bias, sd),
        poisson_ratio=s.poisson_ratio,
        tip_radius_m=s.tip_radius_m,
    )
    best = ranked(known, s.reach, separations(*s.weighed) if s.weighed else ())
    if s.choose is None or not best:
        return best[0] if best else None
    return best[s.choose(np.array([c.point for c in best]), presses.point, presses.point[-1])]


def _in_vain(s: Situation, best: TouchCandidate) -> bool:
    """Whether only the cause is open, and all presses that are left would not settle it, by far."""
    open_ = [goal for goal in s.state.goals if not goal.met]
    if best.separation is None or [goal.name for goal in open_] != ["cause"]:
        return False
    left = s.goals.most - s.state.made
    return FAR_FROM * left * best.worth * best.seconds < open_[0].missing


def _on_support(s: Situation, worth: float) -> Suggestion | None:
    """Presses on the bare support, where a yielding tool is in question and they show more a second."""
    if s.weighed is None or "rigid" in s.kinds:
        return None
    gain, first, rival = support_gain(*s.weighed)
    if gain / RIGID_S <= worth:
        return None
    return Suggestion(
        "rigid",
        f"{words(first)} and {words(rival)} both stand: on the bare support only a yielding tool yields; "
        "press it three times, with 3 to 5 N",
        seconds=RIGID_S,
    )


def _why(s: Situation, best: TouchCandidate) -> str:
    goals = {goal.name: goal for goal in s.state.goals}
    if best.for_goal == "cause" and best.separation is not None:
        first, rival = words(best.separation.first), words(best.separation.rival)
        speed = best.speed_m_per_s
        pace = "slow" if speed < 0.01 else "fast" if speed > 0.04 else "middling"
        held = f", held {best.hold_s:.1f} s" if best.hold_s > 1 else ""
        return f"{first} and {rival} both stand: a {pace} press here{held} parts them most"
    if best.for_goal == "modulus":
        now = goals["modulus"]
        return (
            f"the modulus is known within {_at_least(100 * now.now)} % and {100 * now.goal:g} % is the goal: "
            "this place shares least with those pressed"
        )
    now = goals["surface"]
    return (
        f"95 % of the surface is known within {_at_least(1e3 * now.now)} mm and {1e3 * now.goal:g} mm is "
        "asked for: here it is least known"
    )


def _at_least(value: float) -> str:
    """To a tenth, rounded up: what misses a goal never reads as if it met it."""
    return f"{np.ceil(10 * value) / 10:.1f}"


@dataclass(frozen=True)
class Step:
    """One touch: what was asked for (None: nothing was, as of touches that an earlier run made), and what was
    known after it."""

    asked: Suggestion | None
    state: ExplorationState


@dataclass(frozen=True, eq=False, repr=False)
class Explored(Result):
    """An exploration so far, by `Explorer.explored`.

    path: of its recording, "" where none was written. last: what would be done next, or the word to stop with
    its reason. estimate: shape, touches and modulus. truth: of a phantom, the stated values. said: operands
    of the command that made it, by name. It prints, plots (modulus and surface over the touches), and writes
    its page.
    """

    path: str
    steps: tuple[Step, ...]
    state: ExplorationState
    last: Suggestion
    goals: GoalOptions
    estimate: ExplorationEstimate
    truth: Mapping[str, Any] = field(default_factory=dict)
    said: Mapping[str, Any] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """The figures of `palpate explore --json`."""
        steps = [
            {"suggest": s.asked.table(), "state": s.state.table()} for s in self.steps if s.asked is not None
        ]
        truth = {"truth": dict(self.truth)} if self.truth else {}
        return {"recording": self.path, "steps": steps, **self.state.table(), **truth}
