"""Runs of another simulator along paths whose true force is known: how far off it is, what a step costs."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Clocked, Progress, silent
from palpate.mechanics.recording.recording import Recording
from palpate.render.options import RenderOptions
from palpate.render.registry import create
from palpate.render.replay import replay, rows_of_touch
from palpate.render.simulators.base import over

Values = Mapping[str, float]
"""Settings of a simulator by name."""


@dataclass(frozen=True, eq=False)
class TruePath:
    """A path of a tip over an object, and the true force.

    t (n,) s, centre (n, 3) m: the path; at_s (k,) s, force (k, 3) N on the tool: the samples that count.
    bound_n: N rms of the truth's own 95 % half width; None: measured. friction: None as the model says.
    """

    name: str
    model: Model
    t: np.ndarray
    centre: np.ndarray
    at_s: np.ndarray
    force: np.ndarray
    bound_n: float | None = None
    friction: float | None = None


def path_of_press(recording: Recording, model: Model, presses: Presses, number: int) -> TruePath:
    """One press of a recording, whose truth is what was measured, the sensor's reading in air taken off."""
    rows, own = rows_of_touch(recording.t, presses, number), presses.parts[number]
    felt = presses.counted[own]
    force = (presses.force - presses.free_air)[own][felt]
    name = f"press {number + 1}"
    return TruePath(name, model, recording.t[rows], recording.position[rows], presses.t[own][felt], force)


@dataclass(frozen=True)
class Sums:
    """Over samples: missed N^2, sum of |simulated - true|^2; cross, own, true N^2, sums of simulated . true,
    |simulated|^2, |true|^2; spent_s of the processor in steps of simulated_s in contact. ended: why a path
    ended without a force, which then counts as none. took_s: all of it, by the clock."""

    missed: float = 0.0
    cross: float = 0.0
    own: float = 0.0
    true: float = 0.0
    count: int = 0
    spent_s: float = 0.0
    simulated_s: float = 0.0
    ended: tuple[str, ...] = ()
    took_s: float = 0.0

    def __add__(self, other: Sums) -> Sums:
        return Sums(*(getattr(self, f.name) + getattr(other, f.name) for f in dataclasses.fields(self)))

    @property
    def gap_n(self) -> float:
        """N, rms of the 3-vector."""
        return math.sqrt(self.missed / max(self.count, 1))

    @property
    def cost(self) -> float:
        """Processor seconds for a simulated second in contact."""
        return self.spent_s / self.simulated_s if self.simulated_s else 0.0

    @property
    def scale(self) -> float:
        """The factor on the force that is nearest to the true one: what a change of modulus would do."""
        return self.cross / self.own if self.own > 0 else 1.0

    @property
    def scaled_n(self) -> float:
        """N, the gap with that factor."""
        rest = self.true - (self.cross**2 / self.own if self.own > 0 else 0.0)
        return math.sqrt(max(rest, 0.0) / max(self.count, 1))


@dataclass(frozen=True, eq=False)
class Run:
    """force (n, 3) N along the path, n as far as it was run; zeros where the simulator ends without a force.
    rest (k, 3) N: true less simulated, of the samples that count so far."""

    path: TruePath
    sums: Sums
    force: np.ndarray
    rest: np.ndarray

    @property
    def whole(self) -> bool:
        """Whether it was run to its end."""
        return len(self.force) == len(self.path.t)


def _cost(made: Any) -> np.ndarray:
    """(2,) s of the processor, and simulated in contact; our own renderers count none."""
    return np.array([getattr(made, "spent_s", 0.0), getattr(made, "simulated_s", 0.0)])


class Runs:
    """A simulator at its `options`, some of whose settings are given anew for each run; what was run is kept.
    now: the clock, s."""

    def __init__(self, name: str, options: RenderOptions, now: Clocked = time.monotonic) -> None:
        self.name, self.options, self.now = name, options, now
        self._made: dict[tuple[Any, ...], Any] = {}
        self._ran: dict[tuple[Any, ...], Run] = {}

    def renderer(
        self, values: Values, model: Model, friction: float | None = None, progress: Progress = silent
    ) -> Any:
        """The simulator with those settings over its own; the last few are kept, as some factorise."""
        given = self._given(values)
        key = given, id(model), friction
        if key not in self._made:
            while len(self._made) > 3:
                self._made.pop(next(iter(self._made)))
            rubs = self.options.friction if friction is None else friction
            options = dataclasses.replace(self.options, simulator_set=given, friction=rubs)
            self._made[key] = create(self.name, model, options, progress, on_demand=True)
        return self._made[key]

    def _given(self, values: Values) -> str:
        return over(self.options.simulator_set, dict(sorted(values.items())))

    def run(self, values: Values, path: TruePath, progress: Progress = silent, most: float = math.inf) -> Run:
        """One run along a path, which ends once it has missed more than `most` N^2. Whatever progress raises
        ends it as well."""
        progress("replay", 0.0)
        key = self._given(values), id(path)
        known = self._ran.get(key)
        if known is None or not (known.whole or known.sums.missed > most):
            try:
                self._ran[key] = self._run(values, path, progress, most)
            except BaseException:
                self._made.clear()  # a touch that was left in its midst serves no other
                raise
        return self._ran[key]

    def _run(self, values: Values, path: TruePath, progress: Progress, most: float) -> Run:
        begun = self.now()
        made = self.renderer(values, path.model, path.friction, progress)
        ended: tuple[str, ...] = ()
        before = _cost(made)

        def compared(force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """(simulated, true), (k, 3) N, of the samples that count so far."""
            t = path.t[: len(force)]
            k = len(path.at_s) if len(t) == len(path.t) else int(np.searchsorted(path.at_s, t[-1], "right"))
            return np.column_stack([np.interp(path.at_s[:k], t, f) for f in force.T]), path.force[:k]

        def enough(force: np.ndarray) -> bool:
            at, true = compared(force)
            return float(((at - true) ** 2).sum()) > most

        try:
            force = replay(
                made, path.t, path.centre, tip_radius_m=path.model.tool.tip_radius_m, progress=progress,
                checked=False, enough=enough,
            )  # fmt: skip
        except OptionError as error:
            force, ended = np.zeros_like(path.centre), (f"{path.name}: {error}",)
        at, true = compared(force)
        spent, simulated = (_cost(made) - before).tolist()
        sums = Sums(
            float(((at - true) ** 2).sum()), float((at * true).sum()), float((at**2).sum()),
            float((true**2).sum()), len(at), spent, simulated, ended, self.now() - begun,
        )  # fmt: skip
        return Run(path, sums, force, true - at)
