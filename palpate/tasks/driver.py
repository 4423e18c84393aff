"""Which task next: what is finished is recognised, the rest goes to an executor as needs and memory allow."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from palpate.tasks.graph import Graph, Task
from palpate.tasks.record import Record, finished
from palpate.tasks.words import Status
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
        ...

    def slots(self) -> int:
        """How many it wants to hold, now: those, and what should wait beside them."""
        ...

    def submit(self, jobs: Sequence[tuple[str, dict[str, Any]]]) -> None:
        """Take on jobs, by name."""
        ...

    def collect(self, timeout_s: float) -> list[tuple[str, Answer]]:
        """Answers that came, by name; waits that long for the first."""
        ...


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
    told after every change. outcomes: filled as they come, for whoever is interrupted. One task that fails
    stops only what needs it.
    """
    return _Run(graph, executor, root, force, tell, {} if outcomes is None else outcomes).whole()


def job_of(task: Task, needs: Mapping[str, str], root: Path, order: int = 0) -> dict[str, Any]:
    """What a worker is told of a task, as JSON can hold it. order: the lower, the sooner it is wanted."""
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
    def __init__(
        self,
        graph: Graph,
        executor: Executor,
        root: Path,
        force: bool,
        tell: Callable[[Status], None],
        outcomes: dict[str, Outcome],
    ) -> None:
        self.graph, self.executor, self.root, self.force, self.tell = graph, executor, root, force, tell
        self.outcomes = outcomes
        self.order = {name: k for k, name in enumerate(graph.tasks)}
        self.missing = {name: len(task.needs) for name, task in graph.tasks.items()}
        self.ready = [self.order[name] for name, count in self.missing.items() if not count]
        heapq.heapify(self.ready)
        self.names = list(graph.tasks)
        self.running: set[str] = set()
        self.crashes: dict[str, int] = {}
        self.peaks: dict[str, int] = {}
        self.status = Status.of(graph)

    def whole(self) -> dict[str, Outcome]:
        while self.ready or self.running:
            self._begin()
            self.status.at_once = self.executor.at_once()
            self.tell(self.status)
            if self.running:
                for name, answer in self.executor.collect(_WAIT_S):
                    self._take(name, answer)
        self.tell(self.status)
        return self.outcomes

    def _begin(self) -> None:
        """Settle what is finished; hand on as many of the others, in order, as there is room for."""
        jobs = []
        while self.ready:
            name = self.names[self.ready[0]]
            task = self.graph.tasks[name]
            needs = {need: self._digest(need) for need in task.needs}
            record = None if self.force or name in self.crashes else finished(task, needs)
            if record is None:
                if len(self.running) >= max(1, self.executor.slots()) or not self._fits(name):
                    break
                self.running.add(name)
                self.status.began(task)
                jobs.append((name, job_of(task, needs, self.root, self.order[name])))
            heapq.heappop(self.ready)
            if record is not None:
                self._learn(task, record)
                self._settle(name, Outcome(task, "done", record, reused=True))
        if jobs:
            self.executor.submit(jobs)

    def _digest(self, name: str) -> str:
        record = self.outcomes[name].record
        assert record is not None, "what is ready has needs that are done"
        return record.digest

    def _memory(self, name: str) -> int:
        """What the task is taken to need: stated, or measured of its like; more after a crash."""
        task = self.graph.tasks[name]
        known = max(task.memory_bytes, int(_MARGIN * self.peaks.get(task.stage, 0)))
        return known * 2 ** self.crashes.get(name, 0)

    def _fits(self, name: str) -> bool:
        whole = self.executor.memory_bytes
        if whole is None or not self.running:
            return True
        return sum(map(self._memory, self.running)) + self._memory(name) <= whole

    def _learn(self, task: Task, record: Record) -> None:
        self.peaks[task.stage] = max(self.peaks.get(task.stage, 0), record.peak_bytes)

    def _take(self, name: str, answer: Answer) -> None:
        if name not in self.running:
            return  # an answer that was given twice
        self.running.remove(name)
        task = self.graph.tasks[name]
        state, reason = answer["state"], answer.get("reason", "")
        if state == "crashed":
            self.crashes[name] = self.crashes.get(name, 0) + 1
            if self.crashes[name] <= RETRIES:
                state = "lost"
        if state == "lost":
            self.status.gave_back(task)
            heapq.heappush(self.ready, self.order[name])
        elif state == "done":
            record = Record(**answer["record"])
            self._learn(task, record)
            self._settle(name, Outcome(task, "done", record))
        else:
            self._settle(name, Outcome(task, "failed", reason=reason, trace=answer.get("trace", "")))

    def _settle(self, name: str, outcome: Outcome) -> None:
        """Enter an outcome; what needs it becomes ready, or is skipped with everything after it."""
        self.outcomes[name] = outcome
        self.status.ended(outcome.task, outcome.record, reused=outcome.reused)
        for user in self.graph.users[name]:
            if user in self.outcomes:
                continue
            if outcome.state != "done":
                what = f"{outcome.task.stage} {outcome.task.label}".strip()
                reason = outcome.reason if outcome.state == "skipped" else f"{what}: {outcome.reason}"
                self._settle(user, Outcome(self.graph.tasks[user], "skipped", reason=reason))
                continue
            self.missing[user] -= 1
            if not self.missing[user]:
                heapq.heappush(self.ready, self.order[user])
