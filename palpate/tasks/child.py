"""The parent's end of a worker: started when needed, again after it died, killed with all it started."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import tempfile
import threading
from typing import Any

from palpate.child import module_command, module_environment
from palpate.tasks.worker import THREADS


class Child:
    """A worker process (`palpate.tasks.worker`). `do` is for one thread, the rest for any."""

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
                    module_command("palpate.tasks.worker"),
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=self._errors,
                    text=True,
                    encoding="utf-8",
                    env=module_environment(**dict.fromkeys(THREADS, "1"), MPLBACKEND="Agg"),
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
