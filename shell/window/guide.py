"""The ghost tip: where the suggested press begins, and how deep it goes.

Guidance in the touch window: the servo's ticks are cut into segments, a ghost tip shows the suggestion.

The person does as he likes: what was done counts. A segment ends where the tip has been in the air for a
while; it is taken in by the session's worker, so that the picture never waits, and the recording so far is
written after it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyvista

from palpate.diagnosis.explore.estimate import LEAST_PRESSES
from palpate.diagnosis.explore.explorer import ExplorationState, Explorer, Suggestion
from palpate.diagnosis.explore.segments import LEAST_SAMPLES, Segment
from palpate.mechanics.model.model import Model
from palpate.servo import Servo
from palpate.show.colours import COLOURS
from palpate.window.base_tracing import BaseTracing
from palpate.window.picture import SKIN, arrow_matrix
from palpate.window.worker import Worker
from palpate.words import kpa, mm


@dataclass(frozen=True)
class Ghost:
    """Where the tip is to go: centre (3,) m at first touch, into (3,) unit, how deep, m."""

    centre: np.ndarray
    into: np.ndarray
    depth_m: float


COLOUR = COLOURS["next-touch"]
STAFF_M = 0.03
"""Of the staff along which the tip comes."""


class GhostTip:
    """On a plotter's first picture; `show` moves it."""

    def __init__(self, plotter: pyvista.Plotter, tip_radius_m: float) -> None:
        plotter.subplot(0, 0)
        ball = pyvista.Sphere(radius=tip_radius_m, theta_resolution=20, phi_resolution=20)
        self._tips = [plotter.add_mesh(ball.copy(), color=COLOUR, opacity=o, **SKIN) for o in (0.55, 0.25)]
        staff = pyvista.Arrow(start=(-1, 0, 0), tip_length=0.25, tip_radius=0.09, shaft_radius=0.03)
        self._staff = plotter.add_mesh(staff, color=COLOUR, opacity=0.7, **SKIN)
        self._radius = tip_radius_m
        self.show(None)

    def show(self, ghost: Ghost | None) -> None:
        """There, or nowhere."""
        for actor in (*self._tips, self._staff):
            actor.SetVisibility(ghost is not None)
        if ghost is None:
            return
        self._tips[0].SetPosition(*ghost.centre)
        self._tips[1].SetPosition(*(ghost.centre + ghost.depth_m * ghost.into))
        start = ghost.centre - self._radius * ghost.into
        self._staff.SetUserMatrix(arrow_matrix(start, ghost.into, STAFF_M))


TOUCHING_N = 0.02
"""Force from which the tip touches something."""
AIR_S = 0.3
"""In the air for so long, a segment has ended."""
LEAST_S = 0.05
"""A shorter contact is a brush."""
WAVED_S = 3.0
"""So long in the air, where it was asked for, is waving."""
ON_IT = 1.2
"""Tip radii above the support, a tip's centre is on it."""
WHAT = {
    "stop": "done",
    "trace": "slide around the foot",
    "rigid": "press the bare support",
    "free": "wave in the air",
    "retrace": "slide around the foot once more",
}
"""What to do, by kind of suggestion; a press has its depth."""


class Guide:
    """Call `follow` at every frame; read `ghost` and `lines`. suggestion, state: what to do next and what is
    known, by all that was taken in; touched: (p, 3) m, where the presses that were understood met the object.

    model: what is felt; of it only how far its foot has been gone round is read, and where the support is.
    """

    def __init__(
        self, explorer: Explorer, servo: Servo, model: Model, worker: Worker, path: str | Path
    ) -> None:
        self.explorer = explorer
        self._servo, self._worker, self._path = servo, worker, path
        self._model, self._support = model, model.support
        self._tracing = BaseTracing(model)
        for each in (s for s in explorer.segments if s.kind == "trace"):
            self._tracing.add(each.position, np.arange(len(each.t)))
        self._share_kept = self._tracing.share
        self._next = int(servo.arrays.ring_head[0])
        self._rows: list[np.ndarray] = []
        self._first: int | None = None
        self._last_touch: int | None = None
        self.suggestion: Suggestion = explorer.suggest()
        self.state: ExplorationState = explorer.state
        self.touched = np.zeros((0, 3))
        self._taken = self._thought = 0
        self._share, self._missed = 0.0, False

    @property
    def ghost(self) -> Ghost | None:
        """The press that is suggested; None where it is something else, or where one is being thought of."""
        s = self.suggestion
        if self._thinking or s.kind != "press" or s.point is None or s.normal is None:
            return None
        return Ghost(s.point + self._servo.tip_radius_m * s.normal, -s.normal, s.depth_m)

    @property
    def foot(self) -> tuple[np.ndarray, np.ndarray]:
        """(k, 3) m, points along the foot, and (k,) whether they were gone round."""
        return self._tracing.foot

    def follow(self) -> None:
        """Take over the servo's newest ticks; hand a segment over where one has ended."""
        rows, self._next = self._servo.history(self._next)
        rows = rows[np.isfinite(rows["tip"]).all(axis=1)]
        if not len(rows):
            return
        self._rows.append(rows)
        self._tracing.add(rows["tip"], rows["tick"])
        touching = np.flatnonzero(np.linalg.norm(rows["rendered"], axis=1) > TOUCHING_N)
        if len(touching):
            self._first = int(rows["tick"][touching[0]]) if self._first is None else self._first
            self._last_touch = int(rows["tick"][touching[-1]])
        rate = self._servo.options.rate_hz
        if self.suggestion.kind == "free" and self._first is None:
            if sum(map(len, self._rows)) > WAVED_S * rate:
                self._take_in()
            return
        if self._first is None or self._last_touch is None:
            return
        if (int(rows["tick"][-1]) - self._last_touch) < AIR_S * rate:
            return
        lasted = (self._last_touch - self._first) / rate
        self._first = self._last_touch = None
        if self._still_tracing and not self._tracing.done:
            self._missed, self._share = self._tracing.share == self._share, self._tracing.share
            return
        if self._still_tracing or lasted >= LEAST_S:
            self._take_in()

    def keep_tracing(self) -> None:
        """At a session's end: take in what was traced of a foot not gone round yet, to go on with."""
        grown = self._tracing.share > self._share_kept
        if self.suggestion.kind != "trace" or self._thinking or not self._rows or not grown:
            return
        rows, self._rows = np.concatenate(self._rows), []
        if len(rows) >= LEAST_SAMPLES:
            self._think(rows)

    @property
    def _still_tracing(self) -> bool:
        """Whether the base was not all gone round yet, or not so that it was understood."""
        return self.suggestion.kind in ("trace", "retrace")

    @property
    def _thinking(self) -> bool:
        """Whether something was taken in, and the suggestion is still the one of before."""
        return self._thought < self._taken

    def _take_in(self) -> None:
        rows, self._rows = np.concatenate(self._rows), []
        self._taken, self._share_kept = self._taken + 1, self._tracing.share

        def job() -> None:
            try:
                self._think(rows)
            finally:
                self._thought += 1

        self._worker.run("thinking of the next touch", job)

    def _think(self, rows: np.ndarray) -> None:
        """Take samples in, as what was asked for once all before them were taken in."""
        segment = Segment(
            self._kind(rows),
            rows["tick"] * self._servo.options.period_ns * 1e-9,
            rows["tip"],
            rows["rendered"],
            rows["quaternion"],
        )
        self.explorer.segments.append(segment)
        self.explorer.bring_up_to_date()
        self.explorer.save(self._path)
        self.state, self.suggestion = self.explorer.state, self.explorer.suggest()
        if (found := self.explorer.estimate.exploration) is not None:
            self.touched = found.presses.point
        if self.suggestion.kind == "retrace":
            self._tracing = BaseTracing(self._model)

    def _kind(self, rows: np.ndarray) -> str:
        asked = self.suggestion.kind
        touched = np.linalg.norm(rows["rendered"], axis=1) > TOUCHING_N
        height = self._support.height(rows["tip"][touched])
        if asked == "rigid" and height.size and height.max() < ON_IT * self._servo.tip_radius_m:
            return asked
        if asked == "free" and not touched.any():
            return asked
        return asked if self._still_tracing else "press"

    def lines(self) -> list[str]:
        """For the panel: what to do, in one sentence, and what is known."""
        s, state = self.suggestion, self.state
        why = state.trouble.split(" (")[0].split(":")[0]
        known = f"no shape yet: {why}" if why else "nothing is known yet"
        if state.made < LEAST_PRESSES:  # what a sliding tip met is no press that failed
            known = f"{state.made} of the {LEAST_PRESSES} presses that show a shape"
        if state.surface:
            low, high = state.modulus_ci95_pa
            known = (
                f"{state.made} presses: {kpa(state.modulus_pa, '.1f')} ({low / 1e3:.1f} to "
                f"{high / 1e3:.1f}), surface within {mm(state.surface_error_m, '.1f')}"
            )
        if s.kind == "stop" and state.asked:
            known += f"; asked: {state.asked}"
        what = WHAT.get(s.kind, "")
        if self._still_tracing:
            what += f" ({100 * self._tracing.share:.0f} % traced): the red part is missing"
            what += "; that touch was not at the foot, and does not count" * self._missed
        if self._thinking:
            what = "wait: the next touch is being thought of"
        elif s.kind == "press":
            what = f"press at the green ghost, {mm(s.depth_m, '.0f')} deep"
        return [what, known]
