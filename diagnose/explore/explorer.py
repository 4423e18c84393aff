"""The explorer: takes what was felt, says what is known, what to touch next and why, and when to stop."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from diagnose.explore.candidates import TOUCH_ERROR_M, Candidate, ReachOptions, first_places, weighed
from diagnose.explore.causes import Causes, Weighing, causes_of, words
from diagnose.explore.estimate import LEAST_PRESSES, Estimate, updated
from diagnose.explore.goals import GoalOptions, Standing
from diagnose.explore.modulus import log_sd, modulus_beside
from diagnose.explore.orders import Order
from diagnose.explore.segments import Instrument, Segment, apart, check_joined, together
from diagnose.explore.separating import RIGID_S, Parting, by_support, missing, partings
from mechanics.errors import (
    ContactError,
    DiagnosisError,
    LoudAirError,
    MeshError,
    ModelError,
    OptionError,
    SurfaceError,
)
from mechanics.nearest import distance
from mechanics.recording import Recording, write_recording
from reconstruct.pipeline import Clock
from reconstruct.steps.s2_boundary.boundary import Boundary
from reconstruct.steps.s3_contacts.contacts import ContactOptions, explore
from reconstruct.steps.s7_modulus.modulus import ModulusOptions

FAR_FROM = 3.0
"""Times as much as all presses that are left are expected to tell."""
RECENT = 6
"""Touches that test the surface: older ones tested another."""
NEW_S = 0.1
"""A press that begins so much later than the last one known is new."""
TRUSTED = 3.0
"""Touches by which a surface's own word of its uncertainty counts beside those that tested it."""
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
class State:
    """What is known. modulus_pa, interval: nan where nothing is known, beside causes where those are asked
    for. standing: goal by goal.

    presses: found and used; made: segments of presses that were added. seconds: of exploring so far.
    update_s: wall time of the last update by step. causes: where they are asked for and can be told;
    cause_at: how surely. trouble: why the last update could not be made, or "".
    """

    presses: int
    made: int
    seconds: float
    modulus_pa: float
    modulus_ci95_pa: tuple[float, float]
    surface_error_m: float
    surface: str
    standing: tuple[Standing, ...]
    update_s: dict[str, float] = field(default_factory=dict)
    trouble: str = ""
    causes: Causes | None = None
    cause_at: float = 0.95

    @property
    def done(self) -> bool:
        """Whether every goal is met."""
        return bool(self.standing) and all(s.met for s in self.standing)

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
            "goals": {s.name: {"now": known(s.now), "goal": s.goal, "met": s.met} for s in self.standing},
            "done": self.done,
            "causes": None if self.causes is None else self.causes.table(self.cause_at),
            "update_s": self.update_s,
            "trouble": self.trouble,
        }


class Explorer:
    """A running exploration: `add` what was felt, read `state`, ask `suggest`.

    instrument: what is known of the device. poisson_ratio: of the object. order: None goes where most is
    told; another order of touching stands in for it where guidance is measured. Segments that were added
    stay, whatever happens after: `recording` and `save` hold them all.
    """

    def __init__(
        self,
        instrument: Instrument,
        goals: GoalOptions | None = None,
        reach: ReachOptions | None = None,
        *,
        poisson_ratio: float = 0.49,
        seed: int = 0,
        order: Order | None = None,
    ) -> None:
        self.instrument = instrument
        self.goals = goals or GoalOptions()
        self.reach = reach or ReachOptions()
        self.segments: list[Segment] = []
        self._nu, self._seed = poisson_ratio, seed
        self._order, self._rng = order, np.random.default_rng([seed, 61])
        self._estimate = Estimate()
        self._base: Boundary | None = None
        self._trouble, self._air_hides = "", False
        self._asked: list[np.ndarray] = []
        self._tests: list[float] = []
        self._causes: tuple[Causes, Weighing] | None = None
        self._beside: tuple[float, tuple[float, float]] | None = None

    @classmethod
    def going_on(
        cls,
        recording: Recording,
        goals: GoalOptions | None = None,
        reach: ReachOptions | None = None,
        **given: Any,
    ) -> Explorer:
        """The explorer of an exploration that was interrupted, from what it recorded; `given` as above.

        Any recording of an exploration will do. Raises RecordingError, ContactError where it cannot be cut
        into segments.
        """
        instrument, segments = apart(recording)
        nu = {} if recording.poisson_ratio is None else {"poisson_ratio": recording.poisson_ratio}
        made = cls(instrument, goals, reach, **{**nu, **given})
        made.segments = segments
        made.bring_up_to_date()
        return made

    @property
    def recording(self) -> Recording:
        """All that was felt, as a recording. Raises RecordingError where that is nothing."""
        return together(self.instrument, self.segments)

    @property
    def estimate(self) -> Estimate:
        """Shape, sites and modulus behind `state`."""
        return self._estimate

    def save(self, path: str | Path) -> Path:
        """Write what was felt so far; an earlier file stays whole until the new one is. Returns its path."""
        return write_recording(path, self.recording)

    def add(self, segment: Segment) -> State:
        """Take what was felt in, and bring the estimate up to date.

        A press that cannot be used is kept in the recording and named in `state.trouble`.
        """
        check_joined(self.instrument, self.segments, segment)
        self.segments.append(segment)
        self.bring_up_to_date()
        return self.state

    def bring_up_to_date(self) -> None:
        """Update the estimate with all segments, where they were put down without `add`."""
        try:
            if self._base is None or self._made < LEAST_PRESSES:
                self._trace_only()
            if self._made >= LEAST_PRESSES:
                before = self._estimate
                self._estimate = updated(
                    self.recording, self._estimate, self._nu, self._seed, within_m=self.goals.surface_within_m
                )
                self._tested(before)
                self._weigh()
            self._trouble, self._air_hides = "", False
        except (ContactError, SurfaceError, MeshError, DiagnosisError, ModelError) as error:
            self._trouble, self._air_hides = str(error), isinstance(error, LoudAirError)

    def _tested(self, before: Estimate) -> None:
        """Each new touch tests the surface as it was: by how many of its standard deviations it was off."""
        if before.surface is None or before.exploration is None or self._estimate.exploration is None:
            return
        surface, presses = before.surface, self._estimate.exploration.presses
        new = presses.onset_s > before.exploration.presses.onset_s[-1] + NEW_S
        if not new.any():
            return
        point = presses.point[new]
        off = distance(surface.vertices, surface.triangles, point)
        nearest = cKDTree(surface.vertices).query(point)[1]
        sd = np.hypot(surface.uncertainty_m[nearest], TOUCH_ERROR_M)
        self._tests += (off / sd).tolist()

    @property
    def _doubt(self) -> float:
        """Factor on the surface's uncertainty, from the touches that tested it; never below 1."""
        squares = np.array(self._tests[-RECENT:]) ** 2
        return float(np.sqrt(max(1.0, (TRUSTED + squares.sum()) / (TRUSTED + len(squares)))))

    def _weigh(self) -> None:
        if self.goals.cause_at is None:
            return
        clock = Clock()
        self._causes = causes_of(self._estimate)
        clock.lap("causes")
        self._beside = None
        if self._causes is not None:
            causes, weighing = self._causes
            self._beside = modulus_beside(self._estimate, weighing, causes, self._seed)
        clock.lap("modulus beside causes")
        self._estimate.seconds.update(clock.laps)

    @property
    def _made(self) -> int:
        return sum(s.kind == "press" for s in self.segments)

    def _trace_only(self) -> None:
        """The base's outline and the height of the highest touch, before there are presses enough."""
        found = explore(self.recording, contact_options=ContactOptions(least_palpations=min(self._made, 1)))
        self._base = found.boundary
        self._heights = found.boundary.height(found.presses.point) if len(found.presses) else np.zeros(0)

    @property
    def state(self) -> State:
        """What is known now."""
        e = self._estimate
        nan = float("nan")
        modulus, interval = (nan, (nan, nan)) if e.fit is None else (e.fit.modulus_pa, e.fit.ci95_pa)
        modulus, interval = self._beside or (modulus, interval)
        error = nan
        if e.surface is not None:
            error = e.surface_error_m * self._doubt
        standing = []
        if self.goals.modulus_within is not None:
            half = (interval[1] - interval[0]) / (2 * modulus) if e.fit is not None else float("inf")
            standing.append(Standing("modulus", float(half), self.goals.modulus_within))
        if self.goals.surface_within_m is not None:
            now = error if e.surface is not None else float("inf")
            standing.append(Standing("surface", now, self.goals.surface_within_m))
        causes = self._causes[0] if self._causes else None
        if self.goals.cause_at is not None:
            standing.append(cause_standing(causes, self.goals.cause_at))
        return State(
            presses=e.presses,
            made=self._made,
            seconds=sum(s.seconds for s in self.segments),
            modulus_pa=modulus,
            modulus_ci95_pa=interval,
            surface_error_m=error,
            surface="" if e.surface is None else e.surface.method,
            standing=tuple(standing),
            update_s=dict(e.seconds),
            trouble=self._trouble,
            causes=causes,
            cause_at=self.goals.cause_at or 0.95,
        )

    def suggest(self) -> Suggestion:
        """The touch that tells the most a second, or the word to stop, each with its reason."""
        found = self._of_the_object()
        left = [kind for kind in BESIDE if kind not in self._kinds]
        if found.kind != "stop" or not self.goals.complete or self._base is None or not left:
            return found
        return Suggestion(left[0], BESIDE[left[0]], seconds=RIGID_S)

    def _of_the_object(self) -> Suggestion:
        """The same, of what tells the object."""
        if not any(s.kind == "trace" for s in self.segments):
            return Suggestion("trace", "the base's outline is not known: slide once around the object's foot")
        if self._air_hides and "free" not in self._kinds:
            why = "what the tool reads in the air hides the presses: wave and turn it there for three seconds"
            return Suggestion("free", f"{why} ({self._trouble})")
        if self._base is None and sum(s.kind == "trace" for s in self.segments) >= self.goals.most:
            return Suggestion("stop", f"no tracing could be understood ({self._trouble})")
        if self._base is None:
            return Suggestion("trace", f"the tracing could not be understood ({self._trouble}): trace again")
        state = self.state
        if state.done and state.presses >= LEAST_PRESSES:
            return Suggestion("stop", "every goal is met: " + self._words(state))
        if self._made >= self.goals.most:
            return Suggestion(
                "stop", f"{self._made} presses were made, as many as allowed; " + self._words(state)
            )
        if self._estimate.surface is None:
            return self._first()
        best = self._best(state)
        rigid = self._on_support(best.worth if best else 0.0)
        if rigid is not None:
            return rigid
        if best is None or (best.worth <= 0 and self._order is None) or self._in_vain(best, state):
            return Suggestion(
                "stop",
                "no touch in reach is expected to bring a goal nearer at this noise; " + self._words(state),
            )
        self._asked.append(best.point)
        return Suggestion(
            "press", self._why(best, state), best.point, best.normal, float(best.depth_m),
            best.speed_m_per_s, best.hold_s, self.reach.clearance_m, float(best.seconds),
        )  # fmt: skip

    def _first(self) -> Suggestion:
        assert self._base is not None
        height = float(self._heights.max()) if len(self._heights) else None
        places = first_places(self._base, self.instrument.tip_radius_m, height)
        # one that could not be used counts as made: come back to it last
        point, normal = places[self._made % len(places)] if height is not None else places[0]
        depth = min(0.004, self.reach.deepest_m)
        what = "how high the object is" if height is None else "where its sides and its top are"
        why = f"nothing is known yet of {what}"
        return self._press(point, normal, depth, 3.0, why)

    def _press(
        self, point: np.ndarray, normal: np.ndarray, depth: float, seconds: float, why: str
    ) -> Suggestion:
        return Suggestion(
            "press", why, point, normal, float(depth), self.reach.press_speed_m_per_s, self.reach.hold_s,
            self.reach.clearance_m, float(seconds),
        )  # fmt: skip

    def _best(self, state: State) -> Candidate | None:
        e = self._estimate
        if e.surface is None or e.exploration is None or e.fit is None:
            return None
        sd = log_sd(state.modulus_ci95_pa)
        presses = e.exploration.presses
        used = e.fit.weights > 0 if (e.fit.weights > 0).any() else np.ones(len(presses), dtype=bool)
        ranked = weighed(
            e.surface,
            list(state.standing),
            presses.point[used],
            presses.depth_m[used],
            self.segments[-1].position[-1],
            sd,
            min(ModulusOptions().law_bias, sd),
            state.modulus_pa,
            self.instrument.tip_radius_m,
            self.reach,
            self._partings(),
            np.array(self._asked).reshape(-1, 3),
        )
        if self._order is None or not ranked:
            return ranked[0] if ranked else None
        places = np.array([c.point for c in ranked])
        return ranked[self._order(places, presses.point, presses.point[-1], self._rng)]

    def _in_vain(self, best: Candidate, state: State) -> bool:
        """Whether only the cause is open, and all presses that are left would not tell it, by far."""
        open_ = [s for s in state.standing if not s.met]
        if best.parting is None or [s.name for s in open_] != ["cause"]:
            return False
        left = self.goals.most - self._made
        return FAR_FROM * left * best.worth * best.seconds < open_[0].missing

    @property
    def _kinds(self) -> set[str]:
        return {s.kind for s in self.segments}

    def _on_support(self, worth: float) -> Suggestion | None:
        """Presses on the bare support, where a yielding tool is in question and they tell more a second."""
        if self._causes is None or self.goals.cause_at is None or self._order or "rigid" in self._kinds:
            return None
        causes, weighing = self._causes
        gain, first, rival = by_support(weighing, causes, self.goals.cause_at)
        if gain / RIGID_S <= worth:
            return None
        return Suggestion(
            "rigid",
            f"{words(first)} and {words(rival)} both stand: on the bare support only a yielding tool yields; "
            "press it three times, with 3 to 5 N",
            seconds=RIGID_S,
        )

    def _partings(self) -> list[Parting]:
        if self._causes is None or self.goals.cause_at is None or self._order is not None:
            return []
        causes, weighing = self._causes
        return partings(weighing, causes, self.goals.cause_at)

    def _why(self, best: Candidate, state: State) -> str:
        by_name = {s.name: s for s in state.standing}
        if best.for_goal == "cause" and best.parting is not None:
            p = best.parting
            pace = (
                "slow" if best.speed_m_per_s < 0.01 else "fast" if best.speed_m_per_s > 0.04 else "middling"
            )
            held = f", held {best.hold_s:.1f} s" if best.hold_s > 1 else ""
            return (
                f"{words(p.first)} and {words(p.rival)} both stand: a {pace} press here{held} parts them most"
            )
        if best.for_goal == "modulus":
            now = by_name["modulus"]
            return (
                f"the modulus is known within {100 * now.now:.0f} % and {100 * now.goal:.0f} % is asked for: "
                "this place shares least with those pressed"
            )
        now = by_name["surface"]
        return (
            f"95 % of the surface is known within {1e3 * now.now:.1f} mm and {1e3 * now.goal:.1f} mm is "
            "asked for: here it is least known"
        )

    @staticmethod
    def _words(state: State) -> str:
        parts = []
        for s in state.standing:
            if s.name == "cause":
                left = [] if state.causes is None else state.causes.standing(state.cause_at)
                parts.append("cause: " + (" or ".join(map(words, left)) or "unknown"))
            elif not np.isfinite(s.now):
                parts.append(f"{s.name} unknown")
            elif s.name == "modulus":
                parts.append(f"modulus {state.modulus_pa / 1e3:.1f} kPa within {100 * s.now:.1f} %")
            else:
                parts.append(f"95 % of the surface within {1e3 * s.now:.2f} mm")
        return ", ".join(parts)


def cause_standing(causes: Causes | None, at: float) -> Standing:
    """How far it is to one cause alone: the greatest ratio beside the likeliest, of what rules it out."""
    if causes is None:
        return Standing("cause", float("inf"), 1 - at)
    first = causes.standing(at)[0]
    most = max(missing(causes, name, at) for name in causes.ratio if name != first)
    return Standing("cause", (1 - at) * float(np.exp(most)), 1 - at)


def check_goals(goals: GoalOptions) -> None:
    """Raises OptionError where nothing is asked for."""
    if goals.modulus_within is None and goals.surface_within_m is None and goals.cause_at is None:
        raise OptionError("no goal is given: ask for --modulus-within, --surface-within or --cause-at")
