"""An executor of Dask workers, which may be anywhere that sees the same folders. Needs palpate[cluster].

A thread of a Dask worker keeps one of our own workers (`parallel.local.Child`) and hands it the jobs: the
same process on one thread that does them on this machine, which dies with the Dask worker and not the other
way round. Dask does again what a lost worker had; what a lost scheduler had, the driver hands on anew.
"""

from __future__ import annotations

import contextlib
import itertools
import queue
import threading
import time
import uuid
from collections.abc import Sequence
from typing import Any, Self

from palpate.mechanics.errors import OptionError
from palpate.parallel.driver import Answer
from palpate.parallel.local import Child, waiting

_AHEAD = 2, 32
"""Jobs that the scheduler is given at once, so many a thread of its workers and so many more: none of them
waits for the driver, also where they are short."""

_CONNECT_S = 10.0
_COUNT_S = 2.0
_own = threading.local()
_busy: dict[int, tuple[str, Child]] = {}


def do(job: dict[str, Any], run: str) -> Answer:
    """Runs on a Dask worker: hands a run's job to this thread's own process."""
    if not hasattr(_own, "child"):
        _own.child = Child()
    thread = threading.get_ident()
    _busy[thread] = run, _own.child
    try:
        answer: Answer = _own.child.do(job)
        return answer
    finally:
        del _busy[thread]


async def stop(run: str) -> None:
    """Runs on every Dask worker: ends what it does for a run. (Dask itself stops nothing that has begun.)"""
    for whose, child in list(_busy.values()):
        if whose == run:
            child.stop()


class DaskExecutor:
    """Use as `with DaskExecutor(address) as executor`; leaving the block ends what still runs.

    address: of the scheduler, "tcp://HOST:PORT". patience_s: how long a scheduler that went away is waited
    for. Raises OptionError where Dask is not installed or no scheduler answers.
    """

    memory_bytes: int | None = None

    def __init__(self, address: str, patience_s: float = 900.0) -> None:
        self.address, self.patience_s = address, patience_s
        self._given: dict[str, tuple[str, Any]] = {}
        self._unsent: list[str] = []
        self._ended: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._number = itertools.count()
        self._run = uuid.uuid4().hex
        self._threads, self._counted_at = 0, -_COUNT_S
        self._client = self._connected(_CONNECT_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._given and self._client.status == "running":
            self._client.cancel([future for _, future in self._given.values()], force=True)
            with contextlib.suppress(OSError, TimeoutError):
                self._client.run(stop, self._run, wait=False)
        self._client.close(timeout=2)

    def _connected(self, within_s: float) -> Any:
        try:
            from distributed import Client
        except ImportError as error:
            raise OptionError(
                "--scheduler needs Dask: pip install 'palpate[cluster]', here and where the workers run"
            ) from error
        until = time.monotonic() + within_s
        while True:
            try:
                return Client(self.address, timeout=_CONNECT_S, set_as_default=False)
            except (OSError, TimeoutError, ValueError) as error:
                if time.monotonic() > until or isinstance(error, ValueError):
                    words = f"no Dask scheduler answers at '{self.address}' ({error}): start one there"
                    raise OptionError(" ".join(words.split())) from error

    def at_once(self) -> int:
        """Threads of all workers; 1 where none has come yet."""
        now = time.monotonic()
        if now > self._counted_at + _COUNT_S and self._client.status == "running":
            with contextlib.suppress(Exception):  # the scheduler may go away now: the last count stands
                self._threads = sum(self._client.nthreads().values())
            self._counted_at = now
        return max(1, self._threads)

    def slots(self) -> int:
        """Some that wait with the scheduler beside those."""
        return _AHEAD[0] * self.at_once() + _AHEAD[1]

    def submit(self, jobs: Sequence[tuple[str, dict[str, Any]]]) -> None:
        """Take on jobs, by name."""
        # equal jobs of two runs are two: they may write to different places
        keys = [f"palpate-{self._run}-{next(self._number)}" for _ in jobs]
        given = [job for _, job in jobs]
        # what finishes a recording goes before what begins one
        priority = -given[0]["order"]
        try:
            futures = self._client.map(do, given, run=self._run, key=keys, pure=False, priority=priority)
        except Exception:
            if self._client.status != "closed":
                raise
            self._unsent += [name for name, _ in jobs]  # the scheduler went away: collect waits for it
            return
        for (name, _), key, future in zip(jobs, keys, futures, strict=True):
            self._given[key] = name, future
            future.add_done_callback(lambda f: self._ended.put(f.key))

    def collect(self, timeout_s: float) -> list[tuple[str, Answer]]:
        """Answers that came; waits that long for the first. Jobs of a scheduler that went away are "lost"."""
        keys = waiting(self._ended, timeout_s)
        if self._client.status == "closed":
            lost = [*self._unsent, *(name for name, _ in self._given.values())]
            self._given.clear()
            self._unsent.clear()
            self._client = self._connected(self.patience_s)
            return [(name, {"state": "lost"}) for name in lost]
        ended = {key: self._given.pop(key) for key in keys if key in self._given}
        good = [future for _, future in ended.values() if future.status == "finished"]
        with contextlib.suppress(Exception):  # whatever it was, it is asked for one by one
            answers = dict(zip((f.key for f in good), self._client.gather(good), strict=True))
            return [(n, answers[key] if key in answers else self._answer(f)) for key, (n, f) in ended.items()]
        return [(name, self._answer(future)) for name, future in ended.values()]

    def _answer(self, future: Any) -> Answer:
        from distributed import CancelledError, KilledWorker

        try:
            return dict(future.result(timeout=_CONNECT_S))
        except (CancelledError, OSError, TimeoutError):
            return {"state": "lost"}
        except KilledWorker as error:
            return {"state": "failed", "reason": f"the Dask workers that had it died: {error}"}
        except Exception as error:
            return {"state": "failed", "reason": f"on the Dask worker: {type(error).__name__}: {error}"}
