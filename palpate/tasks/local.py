"""An executor of processes on this machine: as many as there are cores, by default."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Sequence
from typing import Any, Self

from palpate.tasks.child import Child
from palpate.tasks.driver import Answer
from palpate.tasks.memory import available_bytes

_SHARE = 0.9
"""Of the memory that is free at the beginning, what tasks may take together."""


class LocalExecutor:
    """Use as `with LocalExecutor(workers) as executor`; leaving the block kills what still runs."""

    def __init__(self, workers: int | None = None, memory_bytes: int | None = None) -> None:
        free = available_bytes()
        self.workers = workers or cores()
        self.memory_bytes = memory_bytes or (None if free is None else int(_SHARE * free))
        self._jobs: queue.SimpleQueue[tuple[str, dict[str, Any]] | None] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[tuple[str, Answer]] = queue.SimpleQueue()
        self._children: list[Child] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for child in self._children:
            child.close()
        for _child in self._children:
            self._jobs.put(None)

    def at_once(self) -> int:
        """How many at once."""
        return self.workers

    def slots(self) -> int:
        """None waits beside those: which comes next is decided when there is room."""
        return self.workers

    def submit(self, jobs: Sequence[tuple[str, dict[str, Any]]]) -> None:
        """Take on jobs, by name; a process is started with the first that it is needed for."""
        for job in jobs:
            self._jobs.put(job)
            if len(self._children) < self.workers:
                child = Child()
                self._children.append(child)
                threading.Thread(target=self._serve, args=(child,), daemon=True).start()

    def _serve(self, child: Child) -> None:
        while (given := self._jobs.get()) is not None:
            name, job = given
            self._answers.put((name, child.do(job)))

    def collect(self, timeout_s: float) -> list[tuple[str, Answer]]:
        """Answers that came; waits that long for the first."""
        found = []
        try:
            found.append(self._answers.get(timeout=timeout_s))
            while True:
                found.append(self._answers.get_nowait())
        except queue.Empty:
            return found


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
