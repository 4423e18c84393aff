"""The smallest change of a simulator's settings with which it meets a force, without a derivative.

Settings are moved along their rungs (`render.simulators.tunable`), one at a time from where the simulator
starts: a rung up and down of each, first of those that the diagnosis speaks for, and all the way of those
that help most. Where none alone meets the force, the one that leaves least is kept, and the next is sought
beside it. What was moved for little is set back at the end.
A trial ends as soon as its paths so far miss by more than all of those of the settings that it must beat.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from palpate.diagnosis.other_simulator.runs import Runs, Sums, TruePath, Values
from palpate.mechanics.progress import Clocked, TimeIsUp
from palpate.render.simulators.tunable import Tunable

NEAR = 1.05
"""A gap so many times another is as good: no setting is moved for less."""
LINES = 2
"""Of the settings that help, how many are followed to their best before the next is sought beside one."""
HALF = 0.5
"""Share of the gap: a setting whose rung beside leaves less is followed at once."""
MARGIN = 1.2
"""Times what the judgement is expected to take, which is kept for it."""


@dataclass(frozen=True)
class Trial:
    """One try. values: of every tunable setting. whole: whether all paths were run; else its gap is that of
    those that were, and at least so large. step_s: the simulator's own step;
    path_s: what a path took by the clock."""

    values: dict[str, float]
    sums: Sums
    whole: bool
    step_s: float
    path_s: float

    @property
    def gap_n(self) -> float:
        """N rms over the samples that count."""
        return self.sums.gap_n

    @property
    def ms_per_step(self) -> float:
        """Of the processor, for one step of its own in contact."""
        return 1e3 * self.sums.cost * self.step_s


@dataclass(frozen=True)
class Budget:
    """deadline_s: of the clock `now`, when trials end. ms_per_step, cost: what a step, and a simulated second
    in contact may take of the processor, ms and s; inf: whatever it takes."""

    deadline_s: float = math.inf
    ms_per_step: float = math.inf
    cost: float = math.inf
    now: Clocked = time.monotonic

    def over(self, trial: Trial) -> float:
        """How many times too expensive, 1 at least."""
        return max(1.0, trial.ms_per_step / self.ms_per_step, trial.sums.cost / self.cost)


class Search:
    """Settings of one simulator over some paths. target_n: N, where the search ends; step_of(values): s, of
    the simulator with these; after_s: what is run after the trials took with the start's settings;
    tell(trials, best gap in N): after each trial. time_is_up: whether it ended the search; interrupted:
    what did."""

    def __init__(
        self,
        runs: Runs,
        paths: Sequence[TruePath],
        tunables: Sequence[Tunable],
        start: Values,
        *,
        target_n: float,
        step_of: Callable[[Values], float],
        budget: Budget | None = None,
        after_s: float = 0.0,
        tell: Callable[[int, float], None] = lambda trials, gap_n: None,
    ) -> None:
        self.runs, self.paths, self.tunables, self.tell = runs, paths, tunables, tell
        self.target_n, self.budget, self._step_of = target_n, budget or Budget(), step_of
        self._after_s, self._longest_s = after_s, 0.0
        self.start = dict(start)
        self.trials: dict[tuple[tuple[str, float], ...], Trial] = {}
        self.time_is_up = False
        self.interrupted: KeyboardInterrupt | None = None

    def run(self, named: Sequence[str] = ()) -> Trial:
        """The best settings; named: numerical effects that the diagnosis names, the strongest first."""
        first = self.tried(self.start, None)
        spoken = [t for name in named for t in self.tunables if name in t.mends]
        order = list(dict.fromkeys(spoken))
        try:
            self._descend(first, order)
            self._set_back()
        except TimeIsUp:
            self.time_is_up = True
        except KeyboardInterrupt as how:
            self.interrupted = how
        return self.best()

    def best(self) -> Trial:
        """Of those whose cost is allowed and whose gap is as good as the least, the one that moved least."""
        whole = [trial for trial in self.trials.values() if trial.whole]
        cheap = [trial for trial in whole if self.budget.over(trial) == 1.0]
        among = cheap or [min(whole, key=self.budget.over)]
        enough = self._enough(min(trial.gap_n for trial in among))
        return min((t for t in among if t.gap_n <= enough), key=lambda t: (*self.size(t), t.gap_n))

    def size(self, trial: Trial) -> tuple[int, float]:
        """(settings moved, how far in all)."""
        sizes = [t.size(self.start[t.name], trial.values[t.name]) for t in self.tunables]
        return sum(size > 0 for size in sizes), sum(sizes)

    def front(self) -> list[Trial]:
        """Those that no other one beats in both cost and gap, the cheapest first."""
        kept: list[Trial] = []
        for trial in sorted((t for t in self.trials.values() if t.whole), key=lambda t: t.sums.cost):
            if not kept or trial.gap_n < kept[-1].gap_n:
                kept.append(trial)
        return kept

    @staticmethod
    def _key_of(values: Values) -> tuple[tuple[str, float], ...]:
        return tuple(sorted(values.items()))

    def _enough(self, gap_n: float) -> float:
        return max(self.target_n, NEAR * gap_n)

    def _key(self, trial: Trial) -> tuple[float, float]:
        return self.budget.over(trial), trial.gap_n if trial.whole else math.inf

    def tried(self, values: Values, rival: Trial | None) -> Trial:
        """A trial of these settings, to its end where it may beat the rival. Raises TimeIsUp."""
        key = self._key_of(values)
        known = self.trials.get(key)
        if known is not None and (known.whole or rival is None or known.sums.missed > rival.sums.missed):
            return known
        # a rival that is too expensive is beaten by cost as well
        most = math.inf if rival is None or self.budget.over(rival) > 1 else rival.sums.missed
        sums, done, end_s = Sums(), 0, self.budget.deadline_s - self._reserved_s()

        def watched(stage: str, fraction: float) -> None:
            if self.trials and self.budget.now() > end_s:
                raise TimeIsUp

        for path in self.paths:
            if self.trials and self.budget.now() + self._longest_s > end_s:
                raise TimeIsUp
            sums, done = sums + self.runs.run(values, path, watched)[0], done + 1
            self._longest_s = max(self._longest_s, sums.took_s / done)
            if sums.missed > most:
                break
        trial = Trial(dict(values), sums, done == len(self.paths), self._step_of(values), sums.took_s / done)
        self.trials[key] = trial
        self.tell(len(self.trials), self.best().gap_n)
        return trial

    def _reserved_s(self) -> float:
        """s that what comes after the trials takes: longer, as the best settings so far are slower."""
        first = self.trials.get(self._key_of(self.start))
        slower = 1.0 if first is None or not first.path_s else self.best().path_s / first.path_s
        return MARGIN * self._after_s * max(1.0, slower)

    def _descend(self, current: Trial, spoken: Sequence[Tunable]) -> None:
        while not self._met(current):
            ends, beside = [], {}
            for tunable in (*spoken, *(t for t in self.tunables if t not in spoken)):
                beside[tunable.name] = probe = self._probe(current, tunable)
                if probe.whole and probe.gap_n < HALF * current.gap_n:
                    ends.append(self._line(current, tunable))
                    if self._met(ends[-1]):
                        return
            better = [t for t in self.tunables if self._key(beside[t.name]) < self._key(current)]
            better.sort(key=lambda t: self._key(beside[t.name]))
            ends += [self._line(current, tunable) for tunable in better[:LINES]]
            best = min(ends, key=self._key, default=current)
            if not self._worth(best, current):
                return
            current = best

    def _worth(self, trial: Trial, best: Trial) -> bool:
        """Whether to go on there: nearer by more than nothing, or no longer too expensive."""
        (over, gap_n), (was, before_n) = self._key(trial), self._key(best)
        return over < was or (over == was and NEAR * gap_n < before_n)

    def _met(self, trial: Trial) -> bool:
        return trial.whole and trial.gap_n <= self.target_n and self.budget.over(trial) == 1.0

    def _probe(self, current: Trial, tunable: Tunable) -> Trial:
        """The better of both rungs beside."""
        beside = [tunable.beside(current.values[tunable.name], up) for up in (True, False)]
        tries = [self.tried({**current.values, tunable.name: v}, current) for v in beside if v is not None]
        return min(tries, key=self._key, default=current)

    def _line(self, current: Trial, tunable: Tunable) -> Trial:
        """The best of one setting: along its rungs while it gets better, then between them."""
        best, name = current, tunable.name
        low: float | None
        for up in (True, False):
            while (value := tunable.beside(best.values[name], up)) is not None and not self._met(best):
                trial = self.tried({**current.values, name: value}, best)
                if not self._worth(trial, best):
                    break
                best = trial
            if best is not current:
                break
        if self._met(best):
            return best
        low, high = (tunable.beside(best.values[name], up) for up in (False, True))
        for _ in range(1 if best is current else 2):
            at = best.values[name]
            for side in (low, high):
                middle = None if side is None else tunable.between(at, side)
                if middle is None or self._met(best):
                    continue
                trial = self.tried({**current.values, name: middle}, best)
                if self._worth(trial, best):
                    best = trial
            if best.values[name] == at:
                low = None if low is None else tunable.between(at, low)
                high = None if high is None else tunable.between(at, high)
            else:
                low, high = at, (high if best.values[name] > at else low)
        return best

    def _set_back(self) -> None:
        """Try to move fewer: each moved setting back to where it began."""
        for tunable in self.tunables:
            best, name = self.best(), tunable.name
            if best.values[name] != self.start[name] and self.size(best)[0] > 1:
                self.tried({**best.values, name: self.start[name]}, None)
