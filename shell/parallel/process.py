"""A process of its own for each thread of an executor: `python -m palpate.parallel.process`.

It reads a job a line on standard input and writes an answer a line on standard output, JSON both. When its
input ends its parent is gone: it stops at once, in the middle of a task too, with the processes that it
started. Why not a pool's processes: docs/decisions/0100.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from typing import Any

from palpate.child import module_command
from palpate.parallel.tasks import Answer, done

_THREADS = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""What libraries read, once, when they are loaded. Always 1: as many processes as cores fill the machine, and
sums are added up in the same order whatever their number."""

_processes: dict[int, _Process] = {}
"""Of each thread of this process."""
_stopped: set[str] = set()
_lock = threading.Lock()


def in_own_process(job: dict[str, Any], run: str) -> Answer:
    """What executors submit: a run's job, done by this thread's process, which is started where there is none
    of this run."""
    thread = threading.get_ident()
    with _lock:
        if run in _stopped:
            return {"state": "crashed", "reason": "stopped"}
        if thread in _processes and _processes[thread].run != run:
            _end(thread)
        try:
            process = _processes.get(thread) or _Process(run)
        except OSError as error:
            return {"state": "crashed", "reason": f"no process could be started: {error}"}
        _processes[thread] = process
    answer = process.answer(job)
    if answer is None:
        with _lock:
            _end(thread)
        return {"state": "crashed", "reason": process.last_words()}
    return answer


def stop(run: str) -> None:
    """End a run's processes with all that these started; what it submits from now on does not begin."""
    with _lock:
        _stopped.add(run)
        for thread in [thread for thread, process in _processes.items() if process.run == run]:
            _end(thread)


def _end(thread: int) -> None:
    """Under the lock: a process is ended once, while its number is its own."""
    if thread in _processes:
        _processes.pop(thread).kill()


class _Process:
    def __init__(self, run: str) -> None:
        self.run = run
        self._said = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            module_command("palpate.parallel.process"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            text=True,
            encoding="utf-8",
            env=dict(os.environ, **dict.fromkeys(_THREADS, "1"), MPLBACKEND="Agg"),
            start_new_session=True,  # Ctrl-C is the parent's; and the group is killed as one
        )

    def answer(self, job: dict[str, Any]) -> Answer | None:
        """None where the process ended."""
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None and stdout is not None
        with contextlib.suppress(OSError, ValueError):
            stdin.write(json.dumps(job) + "\n")
            stdin.flush()
            line = stdout.readline()
            return dict(json.loads(line)) if line.endswith("\n") else None
        return None

    def kill(self) -> None:
        with contextlib.suppress(OSError):
            if hasattr(os, "killpg"):
                os.killpg(self._process.pid, signal.SIGKILL)  # the number stays taken while one of it lives
            else:
                self._process.kill()
        self._process.wait()

    def last_words(self) -> str:
        """Why it ended."""
        self._said.seek(0)
        said = self._said.read().decode(errors="replace").strip().splitlines()
        code = self._process.returncode
        if code < 0:
            name = signal.Signals(-code).name
            return f"its process was ended by {name}" + (" (out of memory?)" if name == "SIGKILL" else "")
        return f"its process ended with exit code {code}" + (f": {said[-1]}" if said else "")


def _listen(jobs: queue.SimpleQueue[dict[str, Any]]) -> None:
    for line in sys.stdin:
        jobs.put(json.loads(line))
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():  # a group of our own
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
