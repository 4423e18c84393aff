"""What tasks of the tests do; workers import it by name (the tests' folder is on their path)."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from palpate.mechanics.errors import PalpateError


def write(value: Any, path: str, log: str = "", seconds: float = 0.0) -> Any:
    """Write a value to a file, after a while, and say in `log` that it was done."""
    time.sleep(seconds)
    Path(path).write_text(str(value))
    if log:
        with open(log, "a") as file:
            file.write(f"{Path(path).name}\n")
    return value


def double(path: str) -> float:
    """Twice what a file says."""
    return 2 * float(Path(path).read_text())


def fail(words: str) -> None:
    """An error that was foreseen."""
    raise PalpateError(words)


def blunder() -> None:
    """One that nobody foresaw."""
    raise ZeroDivisionError("nobody\nforesaw this")


def die(path: str, times: int) -> str:
    """End the process by force, so many times; `path` counts."""
    been = int(Path(path).read_text()) if Path(path).exists() else 0
    if been < times:
        Path(path).write_text(str(been + 1))
        os.kill(os.getpid(), signal.SIGKILL)
    return "lived"


def threads() -> dict[str, Any]:
    """How many threads the libraries of this process use, and which process it is."""
    import numba

    print("libraries print")
    a = np.ones((300, 300))
    a @ a
    return {
        "omp": os.environ["OMP_NUM_THREADS"],
        "numba": numba.get_num_threads(),
        "running": psutil.Process().num_threads(),
        "process": os.getpid(),
    }


def fill(megabytes: int) -> None:
    """Hold memory for a moment."""
    held = np.ones(megabytes * 125_000)
    time.sleep(0.05)
    del held


def linger(path: str) -> None:
    """Start a process of its own, say both numbers, and sleep for a minute."""
    own = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    Path(path).write_text(f"{os.getpid()} {own.pid}")
    time.sleep(600)


def replayed(model: str, recording: str) -> str:
    """SHA-256 of the forces that a replay gives."""
    import hashlib

    from palpate.operations.replay import replay

    return hashlib.sha256(replay(model, recording, progress=False).force_n.tobytes()).hexdigest()
