"""What a person waits for on a machine that has never seen the program, and the next time.

A clone of this state, a virtual environment of its own, and an empty cache before each first time: to
install, `palpate --help`, the demo, and a touch of the demo's scene and of the nodule's. A touch is the
command from its start to its end, with a tenth of a second of touching: in the window where a virtual screen
(Xvfb) is there, else without one. CPU is user's and system's of a command with all its processes; the
clock's time counts what else the machine does.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.errors import OptionError
from palpate.operations.bench import clone

PARTS = ("install", "help", "demo", "touch", "nodule")
FIRST_OVER_WARM, WARM_DEMO_CPU_S, FIRST_TOUCH_S, WARM_TOUCH_S, HELP_S = 1.25, 40.0, 15.0, 4.0, 0.3


class Spent(NamedTuple):
    """Seconds of one command."""

    wall_s: float
    cpu_s: float


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is measured, and by which installation."""
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), help="leave out the others")
    parser.add_argument("--python", help="of an environment that has it installed; none: one is made")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure, print a row a command."""
    spent: dict[str, Spent] = {}
    with tempfile.TemporaryDirectory() as work, _screen() as screen:
        here = Path(work)
        python = arguments.python or _installed(here, spent)
        palpate = [python, "-m", "palpate"]
        kind = "window" if screen else "without a window"
        touch = ["--seconds", "0.1", *([] if screen else ["--headless"])]
        if "help" in arguments.only:
            spent["palpate --help"] = _timed([*palpate, "--help"], here, here / "c0", screen)
        for part, name, words in (
            ("touch", f"palpate touch, {kind}", ["touch", "demo", *touch]),
            ("nodule", f"palpate touch nodule, {kind}", ["touch", "nodule", *touch]),
            ("demo", "palpate demo", ["demo", "--no-window"]),
        ):
            if part in arguments.only:
                for which in ("first", "warm"):
                    spent[f"{name}, {which}"] = _timed([*palpate, *words], here, here / part, screen)
    print(table(["command", "clock [s]", "CPU [s]"], [[name, *each] for name, each in spent.items()]))
    return {"figures": _figures(spent)}


def _figures(spent: dict[str, Spent]) -> list[Figure]:
    found = []
    for name, each in spent.items():
        clock = Figure(f"{name}, clock", each.wall_s, unit="s")
        cpu = Figure(f"{name}, CPU", each.cpu_s, unit="s")
        if name == "palpate --help":
            clock = clock.at_most(HELP_S)
        elif name == "palpate demo, warm":
            cpu = cpu.at_most(WARM_DEMO_CPU_S)
        elif name.startswith("palpate touch"):
            clock = clock.at_most(FIRST_TOUCH_S if name.endswith("first") else WARM_TOUCH_S)
        found += [clock, cpu]
    demos = [spent[name] for name in ("palpate demo, first", "palpate demo, warm") if name in spent]
    if len(demos) == 2:
        clock_ratio, cpu_ratio = (first / warm for first, warm in zip(*demos, strict=True))
        found.append(Figure("first demo over the warm one, clock", clock_ratio).at_most(FIRST_OVER_WARM))
        found.append(Figure("first demo over the warm one, CPU", cpu_ratio))
    return found


def _installed(work: Path, spent: dict[str, Spent]) -> str:
    """The interpreter of a virtual environment with this state of the clone, made as the README says."""
    source, made = work / "clone", work / "venv"
    subprocess.run(["git", "clone", "-q", str(clone()), str(source)], check=True)
    began = _now()
    subprocess.run([sys.executable, "-m", "venv", str(made)], check=True)
    python = str(made / ("Scripts" if os.name == "nt" else "bin") / "python")
    subprocess.run([python, "-m", "pip", "install", "-q", str(source)], check=True)
    spent["installing"] = _since(began)
    return python


@contextmanager
def _screen() -> Iterator[str]:
    """DISPLAY of a virtual screen of its own, '' where none can be made."""
    if shutil.which("Xvfb") is None:
        yield ""
        return
    read, write = os.pipe()
    words = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1280x800x24", "-nolisten", "tcp"]
    server = subprocess.Popen(words, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    try:
        with os.fdopen(read) as told:
            number = told.readline().strip()
        yield f":{number}" if number else ""
    finally:
        server.terminate()
        server.wait()


def _timed(command: list[str], folder: Path, cache: Path, screen: str) -> Spent:
    """Run it in that folder, with that cache, as a user would: without what sets up this process."""
    unset = ("PYTHONPATH", "NUMBA_CACHE_DIR", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    environment = {name: value for name, value in os.environ.items() if name not in unset}
    environment |= {"PALPATE_CACHE": str(cache), "DISPLAY": screen, "MPLBACKEND": "Agg"}
    environment.pop("PYVISTA_OFF_SCREEN", None)
    began = _now()
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    spent = _since(began)
    if done.returncode:
        raise OptionError(f"'{' '.join(command[1:])}' ended with {done.returncode}: {done.stderr[-500:]}")
    return spent


def _now() -> Spent:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Spent(time.perf_counter(), used.ru_utime + used.ru_stime)


def _since(began: Spent) -> Spent:
    return Spent(*(now - then for now, then in zip(_now(), began, strict=True)))
