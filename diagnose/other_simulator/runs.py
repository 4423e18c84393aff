"""Runs of another simulator along paths whose true force is known: how far off it is, what a step costs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import silent
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
    ended without a force, which then counts as none."""

    missed: float = 0.0
    cross: float = 0.0
    own: float = 0.0
    true: float = 0.0
    count: int = 0
    spent_s: float = 0.0
    simulated_s: float = 0.0
    ended: tuple[str, ...] = ()

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


def _cost(made: Any) -> np.ndarray:
    """(2,) s of the processor, and simulated in contact; our own renderers count none."""
    return np.array([getattr(made, "spent_s", 0.0), getattr(made, "simulated_s", 0.0)])


class Runs:
    """A simulator at its `options`, some of whose settings are given anew for each run."""

    def __init__(self, name: str, options: RenderOptions) -> None:
        self.name, self.options = name, options
        self._made: dict[tuple[Any, ...], Any] = {}

    def renderer(self, values: Values, model: Model, friction: float | None = None) -> Any:
        """The simulator with those settings over its own; the last few are kept, as some factorise."""
        given = over(self.options.simulator_set, dict(sorted(values.items())))
        key = given, id(model), friction
        if key not in self._made:
            while len(self._made) > 3:
                self._made.pop(next(iter(self._made)))
            rubs = self.options.friction if friction is None else friction
            options = dataclasses.replace(self.options, simulator_set=given, friction=rubs)
            self._made[key] = create(self.name, model, options, on_demand=True)
        return self._made[key]

    def run(self, values: Values, path: TruePath) -> tuple[Sums, np.ndarray]:
        """(what it missed, (n, 3) N along the path); zeros where the simulator ends without a force."""
        made = self.renderer(values, path.model, path.friction)
        ended: tuple[str, ...] = ()
        before = _cost(made)
        try:
            force = replay(
                made, path.t, path.centre, tip_radius_m=path.model.tool.tip_radius_m, progress=silent,
                checked=False,
            )  # fmt: skip
        except OptionError as error:
            force, ended = np.zeros_like(path.centre), (f"{path.name}: {error}",)
        at = np.column_stack([np.interp(path.at_s, path.t, f) for f in force.T])
        spent, simulated = (_cost(made) - before).tolist()
        sums = Sums(
            float(((at - path.force) ** 2).sum()), float((at * path.force).sum()), float((at**2).sum()),
            float((path.force**2).sum()), len(at), spent, simulated, ended,
        )  # fmt: skip
        return sums, force
