"""Another simulator's settings, tuned on some presses of a recording and judged on what they were not."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from palpate.diagnosis.other_simulator.runs import Runs, Sums, TruePath, Values
from palpate.diagnosis.other_simulator.tuning import NEAR, Budget, SettingsSearch, Trial
from palpate.mechanics.model.model import Model
from palpate.mechanics.one_thread import one_thread
from palpate.mechanics.progress import Clocked, Progress, TimeIsUp, silent, until
from palpate.mechanics.result import Result
from palpate.render.simulators.base import Adapter

HELD = "held-out presses"
JUDGED = 0.25
"""Share of the time that is left which the start may be judged for; the end takes as long."""


@dataclass(frozen=True)
class Moved:
    """A setting that was moved. term: as that simulator's own files name it."""

    name: str
    before: float
    after: float
    term: str


@dataclass(frozen=True)
class Unseen:
    """A shape that was not tuned on: N rms off its true force before and after (NaN: not pressed), and after
    off before; N rms of its bound, and of the force."""

    name: str
    gap_before_n: float
    gap_after_n: float
    apart_n: float
    bound_n: float
    force_n: float

    @property
    def farther(self) -> bool:
        """Whether it is farther off than before wherever the true force lies within its bound. Forces that
        are as far from one as from the other lie on a plane; nothing is known where the bound reaches it."""
        return self.gap_after_n**2 - self.gap_before_n**2 > 2 * self.bound_n * self.apart_n


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
    of the latter, NaN where there was no time for it; target_n: where tuning ends; least_n: the least that
    any settings reached. scale, scaled_n: the factor on the modulus that would come nearest, and what it
    would leave. modulus_moved: share by which the modulus that the simulator was given is off the model's.
    named: numerical effects of the diagnosis.
    time_is_up: trials ended with the time; interrupted: or by this; undone: what there was no time for, whose
    numbers are NaN.
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
    undone: tuple[str, ...] = ()
    interrupted: KeyboardInterrupt | None = None

    @property
    def worse(self) -> tuple[str, ...]:
        """What was not tuned on and is known to be farther off than before: presses by more than was asked,
        shapes wherever their force lies within its bound."""
        held = self.gap_after_n > max(self.gap_before_n, self.target_n)
        return (*([HELD] if held else []), *(s.name for s in self.unseen if s.farther))


@dataclass(frozen=True)
class Judged:
    """What settings are tuned on, and what they are judged by."""

    fitted: Sequence[TruePath]
    held: Sequence[TruePath]
    unseen: Sequence[TruePath]


def off(runs: Runs, values: Values, paths: Sequence[TruePath], progress: Progress = silent) -> Sums:
    """What settings miss of some paths, together."""
    return sum((runs.run(values, path, progress).sums for path in paths), Sums())


def apart_n(runs: Runs, one: Values, two: Values, path: TruePath) -> float:
    """N rms by which the forces of two settings differ along a path that both were run on."""
    rests = [runs.run(values, path).rest for values in (one, two)]
    return math.sqrt(((rests[0] - rests[1]) ** 2).sum() / len(path.force))


def start_of(adapter: Adapter) -> dict[str, float]:
    """Of every setting that may be tuned, what it is."""
    return {t.name: float(getattr(adapter.own, t.name)) for t in adapter.tunables}


class _Pressed:
    """How far off settings are on what was not tuned on, part by part, as far as the time goes or until it is
    interrupted."""

    def __init__(self, runs: Runs, judged: Judged) -> None:
        held = {HELD: judged.held} if judged.held else {}
        self.runs, self.parts = runs, {**held, **{path.name: [path] for path in judged.unseen}}
        self.interrupted: KeyboardInterrupt | None = None

    def off(
        self,
        values: Values,
        when: str,
        progress: Progress,
        fits: Callable[[str], bool] = lambda name: True,
    ) -> dict[str, Sums]:
        """By name, of those that were pressed to their end; fits(name): whether one is begun at all, as a
        solver that factorises hears of no time."""
        sums: dict[str, Sums] = {}
        try:
            for name, paths in self.parts.items():
                if not fits(name):
                    continue
                sums[name] = off(self.runs, values, paths, _named(progress, f"{name} {when}"))
        except TimeIsUp:
            pass
        except KeyboardInterrupt as how:
            self.interrupted = how
        return sums


def _named(progress: Progress, stage: str) -> Progress:
    return lambda _, fraction: progress(stage, fraction)


@one_thread
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
    now: Clocked | None = None,
) -> Tuned:
    """Tune, then judge. within_s: for all of it, by the clock, from begun_s on; at_most: processor ms a step,
    s a simulated second. The judgement takes its time; trials end early enough for it.

    Ctrl-C ends it with what was found so far. Raises TimeIsUp where the start itself was not run in time."""
    clock = now or runs.now
    begun = clock() if begun_s is None else begun_s
    by_clock = until(progress, begun, within_s, now=clock)
    adapter = runs.renderer({}, model).adapter
    start = start_of(adapter)

    def step_of(values: Values) -> float:
        path = judged.fitted[0]
        usual = (path.t[-1] - path.t[0]) / max(len(path.t) - 1, 1)
        return float(values.get("timestep_s", getattr(adapter.own, "timestep_s", usual)))

    off(runs, start, judged.fitted, _named(by_clock, "how it is off before"))
    pressed = _Pressed(runs, judged)
    asked = tuple(pressed.parts)
    share = (clock() - begun) / within_s
    before = pressed.off(
        start, "before", until(progress, begun, within_s, share + JUDGED * (1 - share), clock)
    )
    target_n = NEAR * (noise_n if math.isnan(law_n) else max(noise_n, law_n))

    def tell(trials: int, gap_n: float) -> None:
        words = f"{trials} settings tried, {1e3 * gap_n:.3g} mN off ({1e3 * target_n:.3g} asked)"
        progress(words, min((clock() - begun) / within_s, 1.0))

    search = SettingsSearch(
        runs, judged.fitted, adapter.tunables, start, target_n=target_n, step_of=step_of,
        budget=Budget(begun + within_s, *at_most, clock), tell=tell,
        after_s=sum(sums.took_s for sums in before.values()),
    )  # fmt: skip
    was = search.tried(start, None)
    best = was if pressed.interrupted else search.run(named)
    interrupted = pressed.interrupted or search.interrupted
    after: dict[str, Sums] = before if best.values == start else {}
    if not interrupted and best.values != start:
        pressed.parts = {name: pressed.parts[name] for name in before}
        slower = max(1.0, best.path_s / was.path_s) if was.path_s else 1.0

        def fits(name: str) -> bool:
            return clock() + slower * before[name].took_s <= begun + within_s

        after = pressed.off(best.values, "after", by_clock, fits)
    interrupted = interrupted or pressed.interrupted
    lost = [name for name in asked if name not in after]
    given = adapter.stated["young_modulus_pa"]
    dear = [] if search.budget.over(best) == 1.0 else ["nothing that was tried costs as little as was asked"]
    ended = list(dict.fromkeys(why for sums in (best.sums, *after.values()) for why in sums.ended))
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
        gap_before_n=_gap_n(before, HELD) if judged.held else 0.0,
        gap_after_n=_gap_n(after, HELD) if judged.held else 0.0,
        unseen=tuple(
            Unseen(
                p.name, _gap_n(before, p.name), _gap_n(after, p.name),
                apart_n(runs, start, best.values, p) if p.name in after else math.nan,
                p.bound_n or 0.0, math.sqrt((p.force**2).sum() / len(p.force)),
            )
            for p in judged.unseen
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
        undone=tuple(lost),
        interrupted=interrupted,
    )  # fmt: skip


def _gap_n(sums: dict[str, Sums], name: str) -> float:
    """N rms; NaN where it was not pressed."""
    return sums[name].gap_n if name in sums else math.nan


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
        "undone": list(result.undone),
        "interrupted": result.interrupted is not None,
        "notes": list(result.notes),
    }
