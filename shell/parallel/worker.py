"""A process that does tasks, one at a time, on one thread: `python -m palpate.parallel.worker`.

It reads a job a line on standard input and writes an answer a line on standard output, JSON both. When its
input ends its parent is gone: it stops at once, in the middle of a task too, with the processes that it
started.
"""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import json
import os
import queue
import signal
import socket
import sys
import threading
import time
import traceback
from pathlib import Path
from typing import Any, Self

import psutil

from palpate.mechanics.errors import PalpateError
from palpate.output import plain
from palpate.parallel.graph import Record, digest_of, write_record
from palpate.version import __version__

THREADS = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""What libraries read, once, when they are loaded. Always 1: as many workers as cores fill the machine, and
sums are added up in the same order whatever their number."""


def done(job: dict[str, Any]) -> dict[str, Any]:
    """Do a job (`driver.job_of`) and write its record; the answer: state "done" with the record, or "failed"
    with a reason in a line and the trace of what nobody foresaw."""
    if job["version"] != __version__:
        there, here = __version__, job["version"]
        return _failed(f"{socket.gethostname()} has palpate {there}, not {here}: install the same on all")
    path = Path(job["record"])
    try:
        if not Path(job["root"]).is_dir():
            host = socket.gethostname()
            raise PalpateError(f"{host} does not see '{job['root']}': choose a folder that all workers share")
        path.unlink(missing_ok=True)  # from here on the products may be others than the record says
        module, name = job["function"].split(":")
        began, cpu = time.perf_counter(), _cpu_s()
        with Peak() as peak:
            value = plain(getattr(importlib.import_module(module), name)(**job["keywords"]))
        record = Record(
            key=job["key"],
            needs=job["needs"],
            digest=digest_of(value, tuple(map(Path, job["products"]))),
            value=value,
            seconds=time.perf_counter() - began,
            cpu_s=_cpu_s() - cpu,
            peak_bytes=peak.bytes,
            host=socket.gethostname(),
        )
        write_record(path, record)
    except PalpateError as error:
        return _failed(str(error))
    except Exception as error:
        return _failed(f"{type(error).__name__}: {error}", traceback.format_exc())
    return {"state": "done", "record": vars(record)}


_SAMPLE_S = 0.2


class Peak:
    """Greatest memory of this process and its children while the block runs: `with Peak() as peak`."""

    bytes: int = 0

    def __enter__(self) -> Self:
        with contextlib.suppress(OSError):  # Linux: the kernel's own high-water mark begins anew
            Path("/proc/self/clear_refs").write_text("5")
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        return self

    def _watch(self) -> None:
        own = psutil.Process()
        while not self._ended.wait(_SAMPLE_S):
            self.bytes = max(self.bytes, sum(map(_resident_bytes, (own, *own.children()))))

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self.bytes = max(self.bytes, high_water_bytes())


def _resident_bytes(process: psutil.Process) -> int:
    try:
        return int(process.memory_info().rss)
    except psutil.Error:  # it ended meanwhile
        return 0


def high_water_bytes() -> int:
    """The greatest resident memory of this process, since `Peak` began where the system counts anew (Linux;
    psutil does not read this mark, and getrusage's carries over a parent's); else what is resident now."""
    with contextlib.suppress(OSError, StopIteration, ValueError):
        status = Path("/proc/self/status").read_text().splitlines()
        return 1024 * next(int(line.split()[1]) for line in status if line.startswith("VmHWM:"))
    return _resident_bytes(psutil.Process())


def _failed(reason: str, trace: str = "") -> dict[str, Any]:
    return {"state": "failed", "reason": " ".join(reason.split()), "trace": trace}


def _cpu_s() -> float:
    """CPU seconds of this process and of its children that ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _listen(jobs: queue.SimpleQueue[dict[str, Any]]) -> None:
    for line in sys.stdin:
        jobs.put(json.loads(line))
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():  # a group of our own: see child
        os.killpg(0, signal.SIGKILL)
    os._exit(0)


def main() -> None:
    """Do what comes until the input ends."""
    # libraries may print: keep the parent's line for answers alone
    line = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8")
    os.dup2(2, 1)
    faulthandler.enable()
    jobs: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(jobs,), daemon=True).start()
    while True:
        answer = done(jobs.get())
        with contextlib.suppress(BrokenPipeError):
            line.write(json.dumps(answer) + "\n")


if __name__ == "__main__":
    main()
