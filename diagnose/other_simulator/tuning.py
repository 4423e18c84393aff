"""The smallest change of a simulator's settings with which it meets a force, without a derivative.

Settings are moved along their rungs (`render.simulators.tunable`). One rung of each is tried from where the
simulator starts, and how its force changes along the path is compared with the force that is missing: what a
setting can take off is the projection of the one on the other (forward selection by matching pursuit). So a
setting is chosen by the course of its force over the way in and the hold, not by how much one rung of it
helps, and a rung to the wrong side tells as much as one to the right. Those that promise most are followed,
each by the secant of that projection, to where nothing of it is missing. Where none alone meets the force,
the one that leaves least is kept, and the next is sought beside it. What was moved for little is set back.
A trial ends as soon as it misses by more than all that the settings which it must beat do.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.other_simulator.runs import Runs, Sums, TruePath, Values
from palpate.mechanics.progress import Clocked, TimeIsUp
from palpate.render.simulators.tunable import Tunable

NEAR = 1.05
"""A gap so many times another is as good."""
FEWER = 1.2
"""Times the gap: what every setting that is moved must take off."""
LINES = 3
"""Of the settings that promise most, how many are followed before the next is sought beside the best."""
HALF = 0.5
"""Share of the gap: a setting that promises to leave less is followed at once."""
JUMP, STILL, STEPS = 3.0, 0.05, 5
"""Rungs that are jumped at most; rungs by which a setting still moves when it is left; trials along one."""
EDGE = 0.2
"""Share of two places with a change of sign between, by which a trial is off both at least."""
MARGIN = 1.2
"""Times what the judgement is expected to take, which is kept for it."""


@dataclass(frozen=True)
class Trial:
    """One try. values: of every tunable setting. whole: whether all paths were run; else its gap is that of
    those that were, and at least so large. step_s: the simulator's own step;
    path_s: what a path took by the clock. rest: (k, 3) N, true less simulated, as far as it was run."""

    values: dict[str, float]
    sums: Sums
    whole: bool
    step_s: float
    path_s: float
    rest: np.ndarray

    @property
    def gap_n(self) -> float:
        """N rms over the samples that count."""
        return self.sums.gap_n

    @property
    def ms_per_step(self) -> float:
        """Of the processor, for one step of its own in contact."""
        return 1e3 * self.sums.cost * self.step_s


@dataclass(frozen=True)
class Promise:
    """What one rung of a setting promises. place: on the ladder, where nothing of what it can take off would
    be missing; share: of the gap that would be left there. trial: the rung."""

    tunable: Tunable
    place: float
    share: float
    trial: Trial


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


class SettingsSearch:
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
        """Of those whose cost is allowed, the one that is nearest for the settings that it moves; of those as
        good, the one that moved least."""
        whole = [trial for trial in self.trials.values() if trial.whole]
        cheap = [trial for trial in whole if self.budget.over(trial) == 1.0]
        among = cheap or [min(whole, key=self.budget.over)]
        enough = NEAR * min(self._score(trial) for trial in among)
        alike = [trial for trial in among if self._score(trial) <= enough]
        return min(alike, key=lambda t: (*self.size(t), t.gap_n))

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

    def _score(self, trial: Trial) -> float:
        """N, the gap, where every setting that is moved counts as so much more of it."""
        return max(self.target_n, trial.gap_n) * FEWER ** self.size(trial)[0]

    def _key(self, trial: Trial) -> tuple[float, float]:
        return self.budget.over(trial), trial.gap_n if trial.whole else math.inf

    def tried(self, values: Values, rival: Trial | None) -> Trial:
        """A trial of these settings, to its end where it may beat the rival. Raises TimeIsUp."""
        key = self._key_of(values)
        known = self.trials.get(key)
        # a rival that is too expensive is beaten by cost as well
        most = math.inf if rival is None or self.budget.over(rival) > 1 else rival.sums.missed
        if known is not None and (known.whole or known.sums.missed > most):
            return known
        sums, rest, end_s = Sums(), [], self.budget.deadline_s - self._reserved_s()

        def watched(stage: str, fraction: float) -> None:
            if self.trials and self.budget.now() > end_s:
                raise TimeIsUp

        whole = True
        for path in self.paths:
            if self.trials and self.budget.now() + self._longest_s > end_s:
                raise TimeIsUp
            run = self.runs.run(values, path, watched, most - sums.missed)
            sums, whole = sums + run.sums, run.whole
            rest.append(run.rest)
            self._longest_s = max(self._longest_s, sums.took_s / len(rest))
            if sums.missed > most:
                break
        whole = whole and len(rest) == len(self.paths)
        trial = Trial(
            dict(values), sums, whole, self._step_of(values), sums.took_s / len(rest), np.concatenate(rest)
        )
        self.trials[key] = trial
        self.tell(len(self.trials), self.best().gap_n)
        return trial

    def _reserved_s(self) -> float:
        """s that what comes after the trials takes: longer, as the best settings so far are slower."""
        first = self.trials.get(self._key_of(self.start))
        slower = 1.0 if first is None or not first.path_s else self.best().path_s / first.path_s
        return MARGIN * self._after_s * max(1.0, slower)

    def _descend(self, current: Trial, spoken: Sequence[Tunable]) -> None:
        order = [*spoken, *(t for t in self.tunables if t not in spoken)]
        while not self._met(current):
            best = self._sought(current, order, len(spoken))
            if not self._worth(best, current):
                return
            current = best

    def _sought(self, current: Trial, order: Sequence[Tunable], spoken: int) -> Trial:
        """The best of those that differ from the current in one setting, which must leave 1 / FEWER of its
        gap at most. The first `spoken` of the order are followed at once where they promise that."""
        best, promises = current, []
        for k, tunable in enumerate(order):
            promise = self._promise(current, tunable)
            if promise is None or promise.share > 1 / FEWER:
                continue
            best = self._better(promise.trial, best)
            if k < spoken or promise.share < HALF:
                best = self._line(current, promise, best)
            else:
                promises.append(promise)
            if self._met(best):
                return best
        for promise in sorted(promises, key=lambda promise: promise.share)[:LINES]:
            best = self._line(current, promise, best)
        beside = self.size(current)[0] > 0 and self.budget.over(current) == 1.0
        if beside or self._worth(best, current):
            return best
        return self._farther(current, order, best)

    def _farther(self, current: Trial, order: Sequence[Tunable], best: Trial) -> Trial:
        """The best so far, or a rung that is better, of any setting, the nearest first: a body that rings at
        the rung beside may be at rest at the one after."""
        places = {t.name: t.place(current.values[t.name]) for t in order}
        rungs = [(abs(k - places[t.name]), t, rung) for t in order for k, rung in enumerate(t.rungs)]
        for _, tunable, rung in sorted(rungs, key=lambda each: each[0]):
            if self._met(best):
                break
            best = self._better(self.tried({**current.values, tunable.name: rung}, best), best)
        return best

    def _better(self, trial: Trial, best: Trial) -> Trial:
        return min(best, trial, key=self._key)

    def _worth(self, trial: Trial, best: Trial) -> bool:
        """Whether one setting more is: nearer by enough, or no longer too expensive."""
        (over, gap_n), (was, before_n) = self._key(trial), self._key(best)
        return over < was or (over == was and FEWER * gap_n < before_n)

    def _met(self, trial: Trial) -> bool:
        return trial.whole and trial.gap_n <= self.target_n and self.budget.over(trial) == 1.0

    def _promise(self, current: Trial, tunable: Tunable) -> Promise | None:
        """By the rung beside that costs less, else the other; None where it changes nothing."""
        name = tunable.name
        cheap = tunable.beside(current.values[name], not tunable.dear)
        value = tunable.beside(current.values[name], tunable.dear) if cheap is None else cheap
        if value is None:
            return None
        trial = self.tried({**current.values, name: value}, current)
        was = current.rest[: len(trial.rest)]
        moved, before_n2 = was - trial.rest, float((was**2).sum())
        size = float((moved**2).sum())
        if not size > 0 or not before_n2 > 0:
            return None
        start, way = (tunable.place(current.values[name]), tunable.place(value))
        low, high = sorted((-start / (way - start), (len(tunable.rungs) - 1 - start) / (way - start)))
        by = min(max(float((moved * was).sum()) / size, low), high)
        left_n2 = float(((was - by * moved) ** 2).sum())
        return Promise(tunable, start + by * (way - start), math.sqrt(left_n2 / before_n2), trial)

    def _line(self, current: Trial, promise: Promise, best: Trial) -> Trial:
        """The best so far, or one of this setting that is better: by the secant of what is missing, as the
        current misses it, to where nothing of that is left. Not followed where it promises no better."""
        tunable, aim = promise.tunable, promise.place
        at = tunable.place(current.values[tunable.name])
        known = {at: 1.0, tunable.place(promise.trial.values[tunable.name]): _left(promise.trial, current)}
        if best is not current and promise.share * current.gap_n > best.gap_n:
            return best
        for _ in range(STEPS):
            value = tunable.at(min(max(aim, at - JUMP, 0.0), at + JUMP, len(tunable.rungs) - 1.0))
            aim = tunable.place(value)
            if self._met(best) or any(abs(aim - place) < STILL for place in known):
                break
            trial = self.tried({**current.values, tunable.name: value}, best)
            known[aim], best, at = _left(trial, current), self._better(trial, best), aim
            aim = _crossing(known)
        return best

    def _set_back(self) -> None:
        """Try to move fewer: each moved setting back to where it began."""
        for tunable in self.tunables:
            best, name = self.best(), tunable.name
            if best.values[name] != self.start[name] and self.size(best)[0] > 1:
                self.tried({**best.values, name: self.start[name]}, None)


def _left(trial: Trial, current: Trial) -> float:
    """Share of what the current misses that a trial still misses in the same direction: 0 none, negative too
    much."""
    was = current.rest[: len(trial.rest)]
    size = float((was**2).sum())
    return float((trial.rest * was).sum()) / size if size else 0.0


def _crossing(known: Mapping[float, float]) -> float:
    """The place where nothing is left, by the two that are nearest to it: within a change of sign, else
    beyond."""
    places = sorted(known)
    pairs = [(a, b) for a, b in itertools.pairwise(places) if known[a] * known[b] <= 0]
    one, two = (
        min(pairs, key=lambda pair: abs(known[pair[0]]) + abs(known[pair[1]]))
        if pairs
        else sorted(places, key=lambda place: abs(known[place]))[:2]
    )
    if known[one] == known[two]:
        return one
    share = known[one] / (known[one] - known[two])
    return one + (two - one) * (min(max(share, EDGE), 1 - EDGE) if pairs else share)
