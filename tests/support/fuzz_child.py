"""The process that runs hostile commands one after another: a line of JSON in, a line of JSON out.

`Child` is its parent's end, `Stranger` runs each command as a person does, in a process of its own.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any, Protocol

import psutil

from palpate.child import module_command

CLONE = Path(__file__).resolve().parents[2]

LONGEST_S, MOST_BYTES = 60.0, 2e9
"""Of processor time and memory beyond what the sound command takes."""
_PATIENCE = 5.0
"""Times LONGEST_S by the clock on the wall: other programs may run beside, and a command may sleep."""


class Runner(Protocol):
    """Runs a command line and says how that ended: see `answer`, and `ended`: '', or how it had to end."""

    def ask(self, argv: list[str], longest_s: float = LONGEST_S) -> dict[str, Any]:
        """Its answer."""

    def end(self) -> None:
        """End what still runs."""


def answer(argv: list[str]) -> dict[str, Any]:
    """What a command answers: exit code, standard error, and the traceback if there is one."""
    from palpate import cli

    said, error = io.StringIO(), io.StringIO()
    code: Any = None
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(error):
            if argv[0] == "#bytes":
                from .device_bytes import tried

                code = tried(int(argv[1]))
            else:
                code = cli.main(argv)
    except SystemExit as end:
        code = end.code
    except BaseException:
        return {"code": None, "error": error.getvalue(), "traceback": traceback.format_exc(limit=-4)}
    return {"code": code, "error": error.getvalue(), "traceback": ""}


def main() -> None:
    """Answer until the input ends."""
    # libraries print where they like: the parent's line is for answers alone
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    for words in sys.stdin:
        print(json.dumps(answer(json.loads(words))), file=out, flush=True)


class Child:
    """A process that answers commands, made anew, and warmed by `first`, where it died or had to be ended."""

    def __init__(self, first: list[list[str]] | None = None) -> None:
        self.first = first or []
        self._process: subprocess.Popen[str] | None = None

    def ask(self, argv: list[str], longest_s: float = LONGEST_S) -> dict[str, Any]:
        """See `Runner`."""
        if self._process is None:
            self._start()
        return self._asked(argv, longest_s)

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def _start(self) -> None:
        self._process = subprocess.Popen(
            module_command("tests.support.fuzz_child"), stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=clone_environment(),
        )  # fmt: skip
        for words in self.first:  # imports, and kernels that are not compiled yet
            self._asked(words, 10 * LONGEST_S)

    def _asked(self, argv: list[str], longest_s: float) -> dict[str, Any]:
        process = self._process
        assert process is not None and process.stdin is not None and process.stdout is not None
        watch = _Watch(process.pid, longest_s)
        process.stdin.write(json.dumps(argv) + "\n")
        process.stdin.flush()
        while not select.select([process.stdout], [], [], 0.05)[0]:
            if ended := watch.beyond():
                self.end()
                return {"code": None, "error": "", "traceback": "", "ended": ended}
        words = process.stdout.readline()
        if not words:
            code = process.wait()
            self.end()
            return {"code": code, "error": f"ended by {code}", "traceback": "", "ended": "died"}
        return {"ended": "", **json.loads(words)}


class Stranger:
    """Each command in a process of its own, as a person runs it."""

    def ask(self, argv: list[str], longest_s: float = LONGEST_S) -> dict[str, Any]:
        """See `Runner`."""
        with tempfile.TemporaryFile() as said:
            process = subprocess.Popen(
                module_command("palpate", *argv), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                stderr=said,
            )  # fmt: skip
            watch, ended = _Watch(process.pid, longest_s, most_bytes=MOST_BYTES + 1e9), ""
            while process.poll() is None and not ended:
                time.sleep(0.02)
                ended = watch.beyond()
            if process.poll() is None:
                process.kill()
            code = process.wait()
            said.seek(0)
            error = said.read().decode(errors="replace")
        trace = error if "Traceback (most recent call last)" in error else ""
        if code in (-signal.SIGSEGV, -signal.SIGABRT, -signal.SIGBUS, -signal.SIGFPE):
            ended = "died"
        return {"code": code, "error": error, "traceback": trace, "ended": ended}

    def end(self) -> None:
        """Nothing is left running."""


class _Watch:
    """Whether a process takes too long or too much memory from now on."""

    def __init__(self, pid: int, longest_s: float, most_bytes: float = MOST_BYTES) -> None:
        self._pid, self._longest_s, self._most = pid, longest_s, most_bytes
        self._bytes, self._cpu_s, self._began = resident(pid), cpu_s(pid), time.monotonic()

    def beyond(self) -> str:
        """'memory', 'hang' or ''."""
        if resident(self._pid) - self._bytes > self._most:
            return "memory"
        worked, passed = cpu_s(self._pid) - self._cpu_s, time.monotonic() - self._began
        return "hang" if worked > self._longest_s or passed > _PATIENCE * self._longest_s else ""


def resident(pid: int) -> float:
    """Bytes in memory; 0 where the process is gone."""
    with contextlib.suppress(psutil.Error):
        return float(psutil.Process(pid).memory_info().rss)
    return 0.0


def cpu_s(pid: int) -> float:
    """Seconds of processor time so far; 0 where the process is gone."""
    with contextlib.suppress(psutil.Error):
        times = psutil.Process(pid).cpu_times()
        return float(times.user + times.system)
    return 0.0


def clone_environment(**variables: str) -> dict[str, str]:
    """This process's environment and `variables`, in which the clone's own `tests` are found too."""
    before = os.environ.get("PYTHONPATH")
    path = os.pathsep.join([str(CLONE), *([before] if before else [])])
    return {**os.environ, "PYTHONPATH": path, **variables}


if __name__ == "__main__":
    main()
