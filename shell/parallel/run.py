"""Which task next: what is finished is recognised, the rest goes to an engine as needs and memory allow."""

from __future__ import annotations

import contextlib
import heapq
import queue
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path

from palpate.mechanics.progress import Progress, silent
from palpate.output import progress_bar
from palpate.parallel.engines import Engine, engine
from palpate.parallel.tasks import Answer, Record, Task, finished

RETRIES = 1
"""How often a task is tried again whose process ended in the middle; it then counts for twice its memory."""

_MARGIN = 1.1
_WAIT_S = 0.5


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


class Status:
    """How far a run is. total, ended: counts of tasks; running: what began first is first."""

    def __init__(self, total: int) -> None:
        self.total, self.ended = total, 0
        self.running: dict[Future[Answer], Task] = {}

    @property
    def fraction(self) -> float:
        """Share of the tasks that have ended."""
        return self.ended / self.total if self.total else 1.0

    def words(self, most: int = 3) -> str:
        """'7 of 12: diagnose bean, reconstruct block' of what began first."""
        names = [f"{task.stage} {task.label}".strip() for task in self.running.values()][:most]
        return f"{self.ended} of {self.total}" + (f": {', '.join(names)}" if names else "")


def run(
    tasks: Iterable[Task],
    engine: Engine,
    root: Path,
    *,
    force: bool = False,
    tell: Callable[[Status], None] = lambda status: None,
    outcomes: dict[str, Outcome] | None = None,
) -> dict[str, Outcome]:
    """Do what is not finished, in this order as far as needs allow; name -> outcome, of every task.

    root: the folder that all records lie in, which every worker must see. force: finished tasks too. tell: is
    called after every change. outcomes: filled as they come, for whoever is interrupted. One task that fails
    stops only what needs it. Raises ValueError for two tasks of one name, and needs that are unknown or lead
    in a circle.
    """
    run = _Run(tasks, engine, root, force, {} if outcomes is None else outcomes)
    while run.ready or run.status.running:
        run.begin()
        tell(run.status)
        if run.status.running:
            run.collect()
    tell(run.status)
    return run.outcomes


class _Run:
    """ready: a heap of (order, name) whose needs have ended."""

    def __init__(
        self, tasks: Iterable[Task], engine: Engine, root: Path, force: bool, outcomes: dict[str, Outcome]
    ) -> None:
        self.engine, self.root, self.force, self.outcomes = engine, root, force, outcomes
        self.tasks: dict[str, Task] = {}
        for task in tasks:
            if self.tasks.setdefault(task.name, task) != task:
                raise ValueError(f"two different tasks are named '{task.name}'")
        if unknown := {need for task in self.tasks.values() for need in task.needs} - set(self.tasks):
            raise ValueError(f"needs that are no task: {', '.join(sorted(unknown))}")
        self.order = {name: k for k, name in enumerate(self.tasks)}
        self.status = Status(len(self.tasks))
        self.sorter = TopologicalSorter({name: task.needs for name, task in self.tasks.items()})
        self.sorter.prepare()
        self.ready: list[tuple[int, str]] = []
        self.answers: queue.SimpleQueue[Future[Answer]] = queue.SimpleQueue()
        self.crashes: Counter[str] = Counter()
        self.peaks: Counter[str] = Counter()
        self._make_ready(*self.sorter.get_ready())

    def _make_ready(self, *names: str) -> None:
        for name in names:
            heapq.heappush(self.ready, (self.order[name], name))

    def begin(self) -> None:
        """Settle what is finished or skipped; hand on as many others, in order, as there is room for."""
        slots = self.engine.slots()
        while self.ready:
            order, name = heapq.heappop(self.ready)
            task = self.tasks[name]
            before = [self.outcomes[need] for need in task.needs]
            if failed := next((o for o in before if o.record is None), None):
                whose = f"{failed.task.stage} {failed.task.label}".strip()
                reason = failed.reason if failed.state == "skipped" else f"{whose}: {failed.reason}"
                self._settle(Outcome(task, "skipped", reason=reason))
                continue
            needs = {o.task.name: o.record.digest for o in before if o.record is not None}
            known = None if self.force else finished(task, needs)
            if known is not None:
                self._settle(Outcome(task, "done", known, reused=True))
            elif self._has_room(task, slots):
                future = self.engine.submit(task.job(needs, self.root), order)
                self.status.running[future] = task
                future.add_done_callback(self.answers.put)
            else:
                self._make_ready(name)
                return

    def _has_room(self, task: Task, slots: int) -> bool:
        running, whole = self.status.running, self.engine.memory_bytes
        if not running or len(running) >= slots:
            return not running
        return whole is None or sum(map(self.memory_bytes, (*running.values(), task))) <= whole

    def memory_bytes(self, task: Task) -> int:
        """What the task is taken to need: stated, or measured of its like; more after a crash."""
        return max(task.memory_bytes, int(_MARGIN * self.peaks[task.stage])) * 2 ** self.crashes[task.name]

    def collect(self) -> None:
        """Enter the answers that came; waits for the first, at most so long that others may join."""
        with contextlib.suppress(queue.Empty):
            self._take(self.answers.get(timeout=_WAIT_S))
            while True:
                self._take(self.answers.get_nowait())

    def _take(self, future: Future[Answer]) -> None:
        """What was lost, or crashed for the first time, is done again."""
        task = self.status.running.pop(future)
        try:
            answer = future.result()
        except CancelledError:
            self._make_ready(task.name)
            return
        except Exception as error:
            answer = {"state": "failed", "reason": f"{type(error).__name__}: {error}"}
        self.crashes[task.name] += answer["state"] == "crashed"
        if answer["state"] == "done":
            self._settle(Outcome(task, "done", Record(**answer["record"])))
        elif answer["state"] == "crashed" and self.crashes[task.name] <= RETRIES:
            self._make_ready(task.name)
        else:
            self._settle(Outcome(task, "failed", reason=answer["reason"], trace=answer.get("trace", "")))

    def _settle(self, outcome: Outcome) -> None:
        task, record = outcome.task, outcome.record
        self.outcomes[task.name] = outcome
        self.status.ended += 1
        if record is not None:
            self.peaks[task.stage] = max(self.peaks[task.stage], record.peak_bytes)
        self.sorter.done(task.name)
        self._make_ready(*self.sorter.get_ready())


def run_with_bar(
    tasks: Iterable[Task],
    root: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    memory_bytes: int | None = None,
    force: bool = False,
    progress: bool | Progress = True,
    outcomes: dict[str, Outcome] | None = None,
) -> dict[str, Outcome]:
    """`run` on the engine that is wanted; progress: shown on standard error, or a function of words and the
    share that is done."""
    with engine(workers, scheduler, memory_bytes) as chosen, contextlib.ExitStack() as shown:
        told = progress if callable(progress) else silent
        if progress is True:
            told = shown.enter_context(progress_bar(""))

        def tell(status: Status) -> None:
            told(status.words(), status.fraction)

        return run(tasks, chosen, root, force=force, tell=tell, outcomes=outcomes)
