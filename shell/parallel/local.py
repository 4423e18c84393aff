"""Worker processes on this machine: one is started when needed, again after it died, and killed with all that
it started; the executor runs as many as there are cores, by default."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import tempfile
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Self, TypeVar

import psutil

from palpate.child import module_command
from palpate.parallel.driver import Answer
from palpate.parallel.worker import THREADS

T = TypeVar("T")

_SHARE = 0.9
"""Of the memory that is free at the beginning, what tasks may take together."""


class Child:
    """A worker process (`palpate.parallel.worker`). `do` is for one thread, the rest for any."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None
        self._errors: Any = None
        self._closed = False

    def do(self, job: dict[str, Any]) -> dict[str, Any]:
        """The worker's answer to a job; state "crashed" with a reason where the process ended instead."""
        process = self._started()
        if process is None:
            return {"state": "crashed", "reason": "stopped"}
        assert process.stdin is not None and process.stdout is not None
        with contextlib.suppress(OSError, ValueError):
            process.stdin.write(json.dumps(job) + "\n")
            process.stdin.flush()
            answer = process.stdout.readline()
            if answer.endswith("\n"):
                return dict(json.loads(answer))
        return {"state": "crashed", "reason": self._buried(process)}

    def stop(self) -> None:
        """End the worker and what it started; the next job starts another."""
        with self._lock:
            if self._process is not None:
                _kill(self._process)

    def close(self) -> None:
        """End it for good."""
        self._closed = True
        self.stop()

    def _started(self) -> subprocess.Popen[str] | None:
        with self._lock:
            if self._process is None and not self._closed:
                self._errors = tempfile.TemporaryFile()
                self._process = subprocess.Popen(
                    module_command("palpate.parallel.worker"),
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=self._errors,
                    text=True,
                    encoding="utf-8",
                    env=dict(os.environ, **dict.fromkeys(THREADS, "1"), MPLBACKEND="Agg"),
                    start_new_session=True,  # Ctrl-C is the parent's; and the group is killed as one
                )
            return self._process

    def _buried(self, process: subprocess.Popen[str]) -> str:
        """Why the process ended; what is left of its group ends too."""
        with self._lock:
            _kill(process)
            self._process = None
        self._errors.seek(0)
        said = self._errors.read().decode(errors="replace").strip().splitlines()
        self._errors.close()
        if process.returncode is not None and process.returncode < 0:
            name = signal.Signals(-process.returncode).name
            guess = " (out of memory?)" if name == "SIGKILL" else ""
            return f"its process was ended by {name}{guess}"
        return f"its process ended with exit code {process.returncode}" + (f": {said[-1]}" if said else "")


def _kill(process: subprocess.Popen[str]) -> None:
    with contextlib.suppress(OSError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)  # the group's number stays taken while one of it lives
        else:
            process.kill()
    process.wait()


class LocalExecutor:
    """Use as `with LocalExecutor(workers) as executor`; leaving the block kills what still runs."""

    def __init__(self, workers: int | None = None, memory_bytes: int | None = None) -> None:
        self.workers = workers or cores()
        self.memory_bytes = memory_bytes or int(_SHARE * available_bytes())
        self._answers: queue.SimpleQueue[tuple[str, Answer]] = queue.SimpleQueue()
        self._children: list[Child] = []
        self._own = threading.local()
        self._pool = ThreadPoolExecutor(self.workers, initializer=self._one_more)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)
        for child in self._children:
            child.close()

    def _one_more(self) -> None:
        self._own.child = Child()
        self._children.append(self._own.child)

    def at_once(self) -> int:
        """How many at once."""
        return self.workers

    slots = at_once
    """None waits beside those: which comes next is decided when there is room."""

    def submit(self, jobs: Sequence[tuple[str, dict[str, Any]]]) -> None:
        """Take on jobs, by name; a process is started with the first that it is needed for."""
        for name, job in jobs:
            self._pool.submit(self._do, name, job)

    def _do(self, name: str, job: dict[str, Any]) -> None:
        self._answers.put((name, self._own.child.do(job)))

    def collect(self, timeout_s: float) -> list[tuple[str, Answer]]:
        """Answers that came; waits that long for the first."""
        return waiting(self._answers, timeout_s)


def waiting(things: queue.SimpleQueue[T], timeout_s: float) -> list[T]:
    """All that a queue holds; waits that long for the first."""
    found = []
    with contextlib.suppress(queue.Empty):
        found.append(things.get(timeout=timeout_s))
        while True:
            found.append(things.get_nowait())
    return found


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def available_bytes() -> int:
    """What processes that start now may take: free or quickly freed, and within the memory limits of this
    process's control groups (version 2), as containers and SLURM set them; psutil reads no such limits."""
    free = [int(psutil.virtual_memory().available)]
    with contextlib.suppress(OSError, ValueError, IndexError):
        own = Path("/proc/self/cgroup").read_text().strip().splitlines()[-1].split("::")[1].strip("/")
        root = Path("/sys/fs/cgroup")
        for group in (root / own, *(root / own).parents):
            if not group.is_relative_to(root):
                break
            with contextlib.suppress(OSError, ValueError):
                limit = int((group / "memory.max").read_text())
                free.append(limit - int((group / "memory.current").read_text()))
    return min(free)
