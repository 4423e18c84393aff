"""Which task next: what is finished is recognised, the rest goes to an executor as needs and memory allow."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from palpate.parallel.graph import Graph, Record, Task, finished
from palpate.version import __version__

RETRIES = 1
"""How often a task is tried again whose process ended in the middle; it then counts for twice its memory."""

_MARGIN = 1.1
_WAIT_S = 0.5

Answer = dict[str, Any]
"""A worker's: state "done" with the record, "failed" or "crashed" with a reason, or "lost": do it again."""


class Executor(Protocol):
    """What does jobs. memory_bytes: what these share, None where it is not ours to count."""

    memory_bytes: int | None

    def at_once(self) -> int:
        """How many it can do at once, now."""

    def slots(self) -> int:
        """How many it wants to hold, now: those, and what should wait beside them."""

    def submit(self, jobs: Sequence[tuple[str, dict[str, Any]]]) -> None:
        """Take on jobs, by name."""

    def collect(self, timeout_s: float) -> list[tuple[str, Answer]]:
        """Answers that came, by name; waits that long for the first."""


class Status:
    """How far a run is: counts by stage; names of running tasks in the order of their beginning; at_once: how
    many can run."""

    def __init__(self, graph: Graph) -> None:
        self.total = Counter(task.stage for task in graph.tasks.values())
        self.ended: Counter[str] = Counter()
        self.running: dict[str, Task] = {}
        self.seconds: dict[str, list[float]] = {}
        self.at_once = 1

    def end(self, task: Task, record: Record | None) -> None:
        """It is done, failed or skipped."""
        self.running.pop(task.name, None)
        self.ended[task.stage] += 1
        if record is not None:
            self.seconds.setdefault(task.stage, []).append(record.seconds)

    def _means_s(self) -> dict[str, float]:
        return {stage: sum(known) / len(known) for stage, known in self.seconds.items()}

    @property
    def fraction(self) -> float:
        """Share of the work that is done; a stage that nobody has timed counts as the mean of the others."""
        means = self._means_s()
        known = [mean for mean in means.values() if mean]
        usual = sum(known) / len(known) if known else 1.0
        weight = {stage: means.get(stage) or usual for stage in self.total}
        whole = sum(weight[s] * n for s, n in self.total.items())
        return sum(weight[s] * n for s, n in self.ended.items()) / whole if whole else 1.0

    def left_s(self) -> float | None:
        """Seconds that the rest takes; None before every stage has been timed."""
        means, rest = self._means_s(), self.total - self.ended
        if any(stage not in means for stage in rest):
            return None
        return sum(means[stage] * n for stage, n in rest.items()) / max(1, self.at_once)

    def words(self, most: int = 3) -> str:
        """'7 of 12, about 3 min left: diagnose bean, reconstruct block' of what began first."""
        done, whole, left = self.ended.total(), self.total.total(), self.left_s()
        text = f"{done} of {whole}"
        if left is not None and done < whole:
            text += f", about {_duration(left)} left"
        names = [f"{task.stage} {task.label}".strip() for task in self.running.values()][: self.at_once]
        more = f" and {len(names) - most} more" if len(names) > most else ""
        return text + (f": {', '.join(names[:most])}{more}" if names else "")


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


@dataclass(frozen=True)
class Outcome:
    """What became of a task. state: "done", "failed", or "skipped", where a need failed. reason: in a line;
    trace: of what nobody foresaw. reused: it was finished before."""

    task: Task
    state: str
    record: Record | None = None
    reason: str = ""
    trace: str = ""
    reused: bool = False


def run(
    graph: Graph,
    executor: Executor,
    root: Path,
    *,
    force: bool = False,
    tell: Callable[[Status], None] = lambda status: None,
    outcomes: dict[str, Outcome] | None = None,
) -> dict[str, Outcome]:
    """Do what is not finished; name -> outcome, of every task.

    root: the folder that all records lie in, which every worker must see. force: finished tasks too. tell: is
    called after every change. outcomes: filled as they come, for whoever is interrupted. One task that fails
    stops only what needs it.
    """
    run = _Run(graph, executor, root, force, {} if outcomes is None else outcomes)
    while run.ready or run.running:
        run.begin()
        run.status.at_once = executor.at_once()
        tell(run.status)
        if run.running:
            for name, answer in executor.collect(_WAIT_S):
                run.take(name, answer)
    tell(run.status)
    return run.outcomes


def job_of(task: Task, needs: Mapping[str, str], root: Path, order: int = 0) -> dict[str, Any]:
    """What a worker needs to know of a task, as JSON can hold it. order: the lower, the sooner."""
    return {
        "function": task.function,
        "keywords": {**task.content, **task.places},
        "key": task.key,
        "needs": dict(needs),
        "record": str(task.record),
        "products": list(map(str, task.products)),
        "root": str(root),
        "version": __version__,
        "order": order,
    }


class _Run:
    """ready: a heap of (order, name) whose needs have ended; running: names that the executor has."""

    def __init__(
        self, graph: Graph, executor: Executor, root: Path, force: bool, outcomes: dict[str, Outcome]
    ) -> None:
        self.graph, self.executor, self.root, self.force = graph, executor, root, force
        self.outcomes, self.status, self.sorter = outcomes, Status(graph), graph.sorter()
        self.order = {name: k for k, name in enumerate(graph.tasks)}
        self.ready: list[tuple[int, str]] = []
        self.running: set[str] = set()
        self.crashes: Counter[str] = Counter()
        self.peaks: dict[str, int] = {}
        self._make_ready(*self.sorter.get_ready())

    def _make_ready(self, *names: str) -> None:
        for name in names:
            heapq.heappush(self.ready, (self.order[name], name))

    def begin(self) -> None:
        """Settle what is finished or skipped; hand on as many others, in order, as there is room for."""
        jobs = []
        while self.ready:
            order, name = self.ready[0]
            task = self.graph.tasks[name]
            before = [self.outcomes[need] for need in task.needs]
            needs = {o.task.name: o.record.digest for o in before if o.record is not None}
            failed = next((o for o in before if o.record is None), None)
            known = None if failed or self.force or name in self.crashes else finished(task, needs)
            if failed is None and known is None:
                if len(self.running) >= max(1, self.executor.slots()) or not self._fits(name):
                    break
                self.running.add(name)
                self.status.running[name] = task
                jobs.append((name, job_of(task, needs, self.root, order)))
            heapq.heappop(self.ready)
            if failed is not None:
                whose = f"{failed.task.stage} {failed.task.label}".strip()
                reason = failed.reason if failed.state == "skipped" else f"{whose}: {failed.reason}"
                self._settle(Outcome(task, "skipped", reason=reason))
            elif known is not None:
                self._settle(Outcome(task, "done", known, reused=True))
        if jobs:
            self.executor.submit(jobs)

    def memory_bytes(self, name: str) -> int:
        """What the task is taken to need: stated, or measured of its like; more after a crash."""
        task = self.graph.tasks[name]
        known = max(task.memory_bytes, int(_MARGIN * self.peaks.get(task.stage, 0)))
        return known * 2 ** self.crashes[name]

    def _fits(self, name: str) -> bool:
        whole = self.executor.memory_bytes
        if whole is None or not self.running:
            return True
        return sum(map(self.memory_bytes, self.running)) + self.memory_bytes(name) <= whole

    def take(self, name: str, answer: Answer) -> None:
        """Enter an answer; what was lost, or crashed for the first time, is done again."""
        if name not in self.running:
            return  # an answer that was given twice
        self.running.remove(name)
        task, state, reason = self.graph.tasks[name], answer["state"], answer.get("reason", "")
        if state == "crashed":
            self.crashes[name] += 1
        if state == "lost" or (state == "crashed" and self.crashes[name] <= RETRIES):
            self.status.running.pop(name, None)
            self._make_ready(name)
        elif state == "done":
            self._settle(Outcome(task, "done", Record(**answer["record"])))
        else:
            self._settle(Outcome(task, "failed", reason=reason, trace=answer.get("trace", "")))

    def _settle(self, outcome: Outcome) -> None:
        task, record = outcome.task, outcome.record
        self.outcomes[task.name] = outcome
        self.status.end(task, record)
        if record is not None:
            self.peaks[task.stage] = max(self.peaks.get(task.stage, 0), record.peak_bytes)
        self.sorter.done(task.name)
        self._make_ready(*self.sorter.get_ready())
