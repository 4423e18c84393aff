"""The explorer: takes what was felt, keeps an estimate, says what is known and what to touch next."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from palpate.diagnosis.explore.candidates import TOUCH_ERROR_M, ReachOptions
from palpate.diagnosis.explore.causes import Causes, causes_of
from palpate.diagnosis.explore.estimate import LEAST_PRESSES, ExplorationEstimate, updated
from palpate.diagnosis.explore.felt import felt
from palpate.diagnosis.explore.goals import GoalOptions, GoalState
from palpate.diagnosis.explore.modulus import modulus_beside
from palpate.diagnosis.explore.segments import Instrument, Segment, check_joined, join, split
from palpate.diagnosis.explore.state import ExplorationState, cause_goal
from palpate.diagnosis.explore.suggestion import Explored, Situation, Step, Suggestion, suggest
from palpate.diagnosis.explore.weighing import Weighing
from palpate.mechanics.errors import (
    ContactError,
    DiagnosisError,
    LoudAirError,
    MeshError,
    ModelError,
    SurfaceError,
)
from palpate.mechanics.plausible import USUAL_POISSON_RATIO
from palpate.mechanics.progress import Clock
from palpate.mechanics.recording.recording import Recording, write_recording
from palpate.mechanics.shape.nearest import distance
from palpate.reconstruction.steps.s2_base import Boundary

Order = Callable[[np.ndarray, np.ndarray, np.ndarray, np.random.Generator], int]
"""(places (p, 3) m, touched (k, 3) m, here (3,) m, random numbers) to the number of the next place."""
RECENT = 6
"""Touches that test the surface: older ones tested another."""
NEW_S = 0.1
"""A press that begins so much later than the last one known is new."""
TRUSTED = 3.0
"""Touches by which a surface's own word of its uncertainty counts beside those that tested it."""


class Explorer:
    """A running exploration: `add` what was felt, read `state`, ask `suggest`.

    instrument: what is known of the device. poisson_ratio: of the object. order: None goes where the progress
    is greatest; another order of touching stands in for it where guidance is measured. estimate: shape,
    sites and modulus behind `state`. Segments that were added stay, whatever happens after: `recording` and
    `save` hold them all.
    """

    def __init__(
        self,
        instrument: Instrument,
        goals: GoalOptions | None = None,
        reach: ReachOptions | None = None,
        *,
        poisson_ratio: float = USUAL_POISSON_RATIO,
        seed: int = 0,
        order: Order | None = None,
    ) -> None:
        self.instrument = instrument
        self.goals = goals or GoalOptions()
        self.reach = reach or ReachOptions()
        self.segments: list[Segment] = []
        self._nu, self._seed = poisson_ratio, seed
        self._order, self._rng = order, np.random.default_rng([seed, 61])
        self.estimate = ExplorationEstimate()
        self._base: Boundary | None = None
        self._heights = np.zeros(0)
        self._trouble, self._air_hides = "", False
        self._asked: list[np.ndarray] = []
        self._tests: list[float] = []
        self._causes: tuple[Causes, Weighing] | None = None
        self._beside: tuple[float, tuple[float, float]] | None = None
        self._steps: list[Step] = []
        self._last: Suggestion | None = None

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
        instrument, segments = split(recording)
        nu = {} if recording.poisson_ratio is None else {"poisson_ratio": recording.poisson_ratio}
        made = cls(instrument, goals, reach, **{**nu, **given})
        # the last touches test the surface as it was before them, as they did when they were made
        presses = [k for k, s in enumerate(segments) if s.kind == "press"]
        tested = presses[max(LEAST_PRESSES, len(presses) - RECENT) :]
        for end in (*tested, len(segments)):
            made.segments = segments[:end]
            made.bring_up_to_date()
        del made._steps[:-1]
        return made

    @property
    def recording(self) -> Recording:
        """All that was felt, as a recording. Raises RecordingError where that is nothing."""
        return join(self.instrument, self.segments)

    def save(self, path: str | Path) -> Path:
        """Write what was felt so far; an earlier file stays whole until the new one is. Returns its path."""
        return write_recording(path, self.recording)

    def add(self, segment: Segment) -> ExplorationState:
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
            if self.estimate.surface is None:
                self._trace_only()
            if self._made >= LEAST_PRESSES:
                before = self.estimate
                self.estimate = updated(
                    self.recording, self.estimate, self._nu, self._seed, within_m=self.goals.surface_within_m
                )
                self._tested(before)
                self._weigh()
            self._trouble, self._air_hides = self.estimate.doubt, False
        except (ContactError, SurfaceError, MeshError, DiagnosisError, ModelError) as error:
            self._trouble, self._air_hides = str(error), isinstance(error, LoudAirError)
        self._steps.append(Step(self._last, self.state))
        self._last = None  # it is done, and what comes next depends on what it told

    def _tested(self, before: ExplorationEstimate) -> None:
        """Each new touch tests the surface as it was: by how many of its standard deviations it was off."""
        if before.surface is None or before.exploration is None or self.estimate.exploration is None:
            return
        surface, presses = before.surface, self.estimate.exploration.presses
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
        self._causes = causes_of(self.estimate)
        clock.lap("causes")
        self._beside = None
        if self._causes is not None:
            causes, weighing = self._causes
            self._beside = modulus_beside(self.estimate, weighing, causes, self._seed)
        clock.lap("modulus beside causes")
        self.estimate.seconds.update(clock.laps)

    @property
    def _made(self) -> int:
        return sum(s.kind == "press" for s in self.segments)

    def _trace_only(self) -> None:
        """The base's outline and the height of the highest touch, before there are presses enough."""
        found, _ = felt(self.recording, min(self._made, 1))
        self._base = found.boundary
        self._heights = found.boundary.height(found.presses.point) if len(found.presses) else np.zeros(0)

    @property
    def state(self) -> ExplorationState:
        """What is known now."""
        e = self.estimate
        nan = float("nan")
        modulus, interval = (nan, (nan, nan)) if e.fit is None else (e.fit.modulus_pa, e.fit.ci95_pa)
        modulus, interval = self._beside or (modulus, interval)
        error = nan
        if e.surface is not None:
            error = e.surface_error_m * self._doubt
        goals = []
        if self.goals.modulus_within is not None:
            half = (interval[1] - interval[0]) / (2 * modulus) if e.fit is not None else float("inf")
            goals.append(GoalState("modulus", float(half), self.goals.modulus_within))
        if self.goals.surface_within_m is not None:
            now = error if e.surface is not None else float("inf")
            goals.append(GoalState("surface", now, self.goals.surface_within_m))
        causes = self._causes[0] if self._causes else None
        if self.goals.cause_at is not None:
            goals.append(cause_goal(causes, self.goals.cause_at))
        return ExplorationState(
            presses=e.presses,
            made=self._made,
            seconds=sum(s.seconds for s in self.segments),
            modulus_pa=modulus,
            modulus_ci95_pa=interval,
            surface_error_m=error,
            surface="" if e.surface is None else e.surface.method,
            goals=tuple(goals),
            update_s=dict(e.seconds),
            trouble=self._trouble,
            causes=causes,
            cause_at=self.goals.cause_at or 0.95,
        )

    def suggest(self) -> Suggestion:
        """The touch that makes the most progress a second, or the word to stop, each with its reason."""
        order, rng = self._order, self._rng
        choose = None if order is None else lambda p, t, h: order(p, t, h, rng)
        found = suggest(
            Situation(
                state=self.state,
                goals=self.goals,
                reach=self.reach,
                tip_radius_m=self.instrument.tip_radius_m,
                poisson_ratio=self._nu,
                kinds=tuple(s.kind for s in self.segments),
                base=self._base,
                heights=self._heights,
                air_hides=self._air_hides,
                estimate=self.estimate,
                causes=self._causes,
                here=self.segments[-1].position[-1] if self.segments else np.zeros(3),
                asked=np.array(self._asked).reshape(-1, 3),
                choose=choose,
            )
        )
        if found.point is not None and self.estimate.surface is not None:
            self._asked.append(found.point)
        self._last = found
        return found

    def explored(self, path: str = "", truth: Mapping[str, Any] | None = None) -> Explored:
        """What it came to so far. path: of the recording that holds it; truth: of a phantom."""
        last = self._last or self.suggest()
        return Explored(
            path, tuple(self._steps), self.state, last, self.goals, self.estimate, truth=truth or {}
        )
