"""Who does the tasks: threads of `concurrent.futures` here, or of Dask's workers (extra 'cluster') wherever
the same folders are seen. Either has processes of its own (`parallel.process`)."""

from __future__ import annotations

import contextlib
import os
import time
import uuid
from concurrent.futures import CancelledError, Future, InvalidStateError, ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

import psutil

from palpate.mechanics.errors import OptionError
from palpate.mechanics.extras import install_words
from palpate.parallel.process import in_own_process, stop
from palpate.parallel.tasks import Answer

_SHARE = 0.9
"""Of the memory that is free at the beginning, what tasks may take together."""
_AHEAD = 2, 32
"""Jobs that Dask is given at once, so many a thread of its workers and so many more: none of them waits for
this process, also where they are short."""
_CONNECT_S, _COUNT_S, _PATIENCE_S = 10.0, 2.0, 900.0


class LocalEngine(AbstractContextManager["LocalEngine"]):
    """Use as `with LocalEngine(workers) as engine`; leaving the block kills what still runs."""

    def __init__(self, workers: int | None = None, memory_bytes: int | None = None) -> None:
        self.workers = workers or cores()
        self.memory_bytes: int | None = memory_bytes or int(_SHARE * available_bytes())
        self._run, self._threads = uuid.uuid4().hex, ThreadPoolExecutor(self.workers)

    def __exit__(self, *_: object) -> None:
        self._threads.shutdown(wait=False, cancel_futures=True)
        stop(self._run)

    def slots(self) -> int:
        """One a worker: which comes next is decided when there is room."""
        return self.workers

    def submit(self, job: dict[str, Any], order: int) -> Future[Answer]:
        """Do a job in a process of one of the threads."""
        return self._threads.submit(in_own_process, job, self._run)


class DaskEngine(AbstractContextManager["DaskEngine"]):
    """Use as `with DaskEngine(address) as engine`; leaving the block ends what still runs.

    address: of the scheduler, "tcp://HOST:PORT". Raises OptionError where Dask is not installed or no
    scheduler answers.
    """

    memory_bytes: int | None = None

    def __init__(self, address: str) -> None:
        self.address, self._run = address, uuid.uuid4().hex
        self._given: dict[Future[Answer], Any] = {}
        self._threads, self._counted_at = 0, -_COUNT_S
        self._client = self._connected(_CONNECT_S)

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(Exception):  # a scheduler that is gone holds nothing of ours
            if self._client.status == "running":
                self._client.cancel(list(self._given.values()), force=True)
                self._client.run(stop, self._run)  # Dask itself stops nothing that has begun
        self._client.close(timeout=2)

    def _connected(self, within_s: float) -> Any:
        try:
            from distributed import Client
        except ImportError as error:
            raise OptionError(
                f"--scheduler needs Dask: {install_words('cluster')}, here and where the workers run"
            ) from error
        until = time.monotonic() + within_s
        while True:
            try:
                return Client(self.address, timeout=_CONNECT_S, set_as_default=False)
            except (OSError, TimeoutError, ValueError) as error:
                if time.monotonic() > until or isinstance(error, ValueError):
                    words = f"no Dask scheduler answers at '{self.address}' ({error}): start one there"
                    raise OptionError(" ".join(words.split())) from error

    def _connect_again(self) -> None:
        """Wait for a scheduler that went away; what it had is lost."""
        self._client.close(timeout=2)
        self._client = self._connected(_PATIENCE_S)
        for future in list(self._given):
            future.cancel()

    def slots(self) -> int:
        """One a thread of the workers, and some that wait with the scheduler."""
        if self._client.status == "closed":
            self._connect_again()
        now = time.monotonic()
        if now > self._counted_at + _COUNT_S and self._client.status == "running":
            with contextlib.suppress(Exception):  # the scheduler may go away now: the last count stands
                self._threads = sum(self._client.nthreads().values())
            self._counted_at = now
        return _AHEAD[0] * self._threads + _AHEAD[1]

    def submit(self, job: dict[str, Any], order: int) -> Future[Answer]:
        """Do a job in a process of one of the workers' threads."""
        while True:
            client = self._client
            try:
                theirs = client.submit(in_own_process, job, self._run, pure=False, priority=-order)
            except Exception:
                if client.status == "running":
                    raise
                self._connect_again()
                continue
            ours: Future[Answer] = Future()
            self._given[ours] = theirs
            ours.add_done_callback(self._given.pop)
            theirs.add_done_callback(partial(_hand_on, client, ours))
            return ours


Engine = LocalEngine | DaskEngine
"""What does jobs. memory_bytes: what these share, None where it is not ours to count; slots(): how many it
wants to hold, now; submit(job, order): a future, cancelled where the job was lost; the lower its order, the
sooner."""


def _hand_on(client: Any, ours: Future[Answer], theirs: Any) -> None:
    """Those of Dask's `client.get_executor` wait for ever where a scheduler goes away while it answers."""
    with contextlib.suppress(InvalidStateError):  # it was lost meanwhile
        try:
            ours.set_result(theirs.result(timeout=_CONNECT_S))
        except (CancelledError, OSError):
            ours.cancel()
        except Exception as error:
            if client.status == "running":
                ours.set_exception(error)
            else:
                ours.cancel()


def engine(
    workers: int | None = None, scheduler: str | None = None, memory_bytes: int | None = None
) -> Engine:
    """Processes of this machine, or the workers of a Dask scheduler.

    Raises OptionError for fewer workers than one, for both at once, and where no scheduler answers.
    """
    if scheduler is not None and (workers is not None or memory_bytes is not None):
        raise OptionError("a scheduler's workers are its own: give --scheduler, or --workers and --memory")
    if workers is not None and workers < 1:
        raise OptionError(f"--workers {workers}: allowed are 1 and more")
    if memory_bytes is not None and not memory_bytes > 0:
        raise OptionError("--memory must be greater than 0")
    return LocalEngine(workers, memory_bytes) if scheduler is None else DaskEngine(scheduler)


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
