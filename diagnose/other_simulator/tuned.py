"""Another simulator's settings, tuned on some presses of a recording and judged on what they were not."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from palpate.diagnosis.other_simulator.runs import Runs, Sums, TruePath, Values
from palpate.diagnosis.other_simulator.tuning import NEAR, Budget, Search, Trial
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.result import Result


@dataclass(frozen=True)
class Moved:
    """A setting that was moved. term: as that simulator's own files name it."""

    name: str
    before: float
    after: float
    term: str


@dataclass(frozen=True)
class Unseen:
    """A shape that was not tuned on: N rms off its true force before and after; N rms of its bound, and of
    the force."""

    name: str
    gap_before_n: float
    gap_after_n: float
    bound_n: float
    force_n: float


@dataclass(frozen=True)
class Priced:
    """One point of the front: what it costs, in processor ms a step and s a simulated second in contact, and
    how far off it is, N rms on the presses that were tuned on. moved: settings that are not as they began."""

    ms_per_step: float
    s_per_s: float
    gap_n: float
    moved: dict[str, float]


@dataclass(frozen=True, eq=False, repr=False)
class Tuned(Result):
    """The smallest change of a simulator's settings that meets the measured force, its physics held.

    settings: of all that may be tuned; began: the same before. chosen, numbers: `--simulator-settings` and
    `--simulator-set` of the start. gap_before_n, gap_after_n: N rms on held-out presses; fitted_before_n,
    fitted_after_n: on those tuned on; noise_n: of the sensor; law_n: what an ideal elastic simulation leaves
    of the latter; target_n: where tuning ends; least_n: the least that any settings reached. scale, scaled_n:
    the factor on the modulus that would come nearest, and what it would leave. modulus_moved: share by which
    the modulus that the simulator was given is off the model's. named: numerical effects of the diagnosis.
    `plot`: error over cost; `show`: nothing.
    """

    simulator: str
    version: str
    model: Model
    chosen: str
    numbers: str
    began: dict[str, float]
    settings: dict[str, float]
    moved: tuple[Moved, ...]
    noise_n: float
    law_n: float
    target_n: float
    fitted_before_n: float
    fitted_after_n: float
    gap_before_n: float
    gap_after_n: float
    unseen: tuple[Unseen, ...]
    ms_per_step_before: float
    ms_per_step: float
    s_per_s: float
    front: tuple[Priced, ...]
    least_n: float
    scale: float
    scaled_n: float
    modulus_moved: float
    trials: int
    seconds: float
    time_is_up: bool
    named: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def worse(self) -> tuple[str, ...]:
        """What was not tuned on and is farther off than before, and than its force is known to."""
        held = self.gap_after_n > max(self.gap_before_n, self.target_n)
        shapes = [s.name for s in self.unseen if s.gap_after_n > max(s.gap_before_n, s.bound_n)]
        return (*(["held-out presses"] if held else []), *shapes)


@dataclass(frozen=True)
class Judged:
    """What settings are tuned on, and what they are judged by."""

    fitted: Sequence[TruePath]
    held: Sequence[TruePath]
    unseen: Sequence[TruePath]


def off(runs: Runs, values: Values, paths: Sequence[TruePath]) -> Sums:
    """What settings miss of some paths, together."""
    return sum((runs.run(values, path)[0] for path in paths), Sums())


def tuned(
    runs: Runs,
    model: Model,
    judged: Judged,
    *,
    noise_n: float,
    law_n: float,
    within_s: float,
    at_most: tuple[float, float] = (math.inf, math.inf),
    named: Sequence[str] = (),
    notes: Sequence[str] = (),
    begun_s: float | None = None,
    progress: Progress = silent,
    now: Callable[[], float] | None = None,
) -> Tuned:
    """Tune, then judge. within_s: for all of it, by the clock, from begun_s on; at_most: processor ms a step,
    s a simulated second. The judgement takes its time; trials end early enough for it."""
    clock = now or Budget().now
    begun = clock() if begun_s is None else begun_s
    adapter = runs.renderer({}, model).adapter
    start = {t.name: float(getattr(adapter.own, t.name)) for t in adapter.tunables}

    def step_of(values: Values) -> float:
        path = judged.fitted[0]
        usual = (path.t[-1] - path.t[0]) / max(len(path.t) - 1, 1)
        return float(values.get("timestep_s", getattr(adapter.own, "timestep_s", usual)))

    progress("how it is off before", 0.0)
    first = clock()
    held_before = off(runs, start, judged.held)
    shapes_before = [off(runs, start, [path]) for path in judged.unseen]
    count = len(judged.held) + len(judged.unseen)
    after = count, (clock() - first) / max(count, 1)
    target_n = NEAR * max(noise_n, law_n)

    def tell(trials: int, gap_n: float) -> None:
        left = max(begun + within_s - clock(), 0.0)
        share = min((clock() - begun) / within_s, 0.95) if within_s else 0.95
        progress(
            f"{trials} settings tried, {1e3 * gap_n:.3g} mN off ({1e3 * target_n:.3g} asked), "
            f"{left / 60:.1f} min left", share,
        )  # fmt: skip

    search = Search(
        runs, judged.fitted, adapter.tunables, start, target_n=target_n, step_of=step_of,
        budget=Budget(begun + within_s, *at_most, clock), after=after, tell=tell,
    )  # fmt: skip
    best = search.run(named)
    was = search.tried(start, None)
    progress("how it is off after", 0.97)
    same = best.values == start
    held = held_before if same else off(runs, best.values, judged.held)
    shapes = shapes_before if same else [off(runs, best.values, [path]) for path in judged.unseen]
    given = adapter.stated["young_modulus_pa"]
    dear = [] if search.budget.over(best) == 1.0 else ["nothing that was tried costs as little as was asked"]
    ended = list(dict.fromkeys(why for sums in (best.sums, held, *shapes) for why in sums.ended))
    return Tuned(
        simulator=adapter.name,
        version=adapter.version,
        model=model,
        chosen=runs.options.simulator_settings,
        numbers=runs.options.simulator_set,
        began=start,
        settings=best.values,
        moved=tuple(
            Moved(t.name, start[t.name], best.values[t.name], t.term)
            for t in adapter.tunables if best.values[t.name] != start[t.name]
        ),
        noise_n=noise_n,
        law_n=law_n,
        target_n=target_n,
        fitted_before_n=was.gap_n,
        fitted_after_n=best.gap_n,
        gap_before_n=held_before.gap_n,
        gap_after_n=held.gap_n,
        unseen=tuple(
            Unseen(p.name, a.gap_n, b.gap_n, p.bound_n or 0.0, math.sqrt(b.true / max(b.count, 1)))
            for p, a, b in zip(judged.unseen, shapes_before, shapes, strict=True)
        ),
        ms_per_step_before=was.ms_per_step,
        ms_per_step=best.ms_per_step,
        s_per_s=best.sums.cost,
        front=tuple(_priced(trial, start) for trial in search.front()),
        least_n=min(trial.gap_n for trial in search.trials.values() if trial.whole),
        scale=best.sums.scale,
        scaled_n=best.sums.scaled_n,
        modulus_moved=given / model.material.young_modulus_pa - 1,
        trials=len(search.trials),
        seconds=clock() - begun,
        time_is_up=search.time_is_up,
        named=tuple(named),
        notes=(*notes, *dear, *(f"ended without a force: {why}" for why in ended)),
    )  # fmt: skip


def _priced(trial: Trial, start: Values) -> Priced:
    moved = {name: value for name, value in trial.values.items() if value != start[name]}
    return Priced(trial.ms_per_step, trial.sums.cost, trial.gap_n, moved)


def as_json(result: Tuned) -> dict[str, Any]:
    """The contract's keys, and some more."""
    plain = {
        name: getattr(result, name)
        for name in (
            "settings", "began", "gap_before_n", "gap_after_n", "fitted_before_n", "fitted_after_n",
            "noise_n", "law_n", "target_n", "least_n", "ms_per_step_before", "ms_per_step", "s_per_s",
            "modulus_moved", "trials", "seconds", "time_is_up",
        )
    }  # fmt: skip
    return {
        "simulator": {"name": result.simulator, "version": result.version},
        **plain,
        "moved": [asdict(each) for each in result.moved],
        "unseen_shapes": [asdict(each) for each in result.unseen],
        "front": [asdict(each) for each in result.front],
        "modulus_would": {"factor": result.scale, "gap_after_n": result.scaled_n},
        "effects": list(result.named),
        "worse": list(result.worse),
        "notes": list(result.notes),
    }
