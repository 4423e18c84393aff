"""What a command costs before it does anything: user CPU of `--help` beside that of importing NumPy.

Each is a process of its own, run in turns with the others, so that whatever else the machine does meets all
alike; a first round that fills caches does not count.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
from typing import Any

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.child import module_command

HELP_S, OVER_NUMPY_S = 0.15, 0.3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Repeats."""
    parser.add_argument("--repeats", type=int, default=7)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure in turns, print a row a command."""
    commands = {
        "python, nothing imported": [sys.executable, "-P", "-c", "pass"],
        "import numpy": [sys.executable, "-P", "-c", "import numpy"],
        "palpate --help": module_command("palpate", "--help"),
        "palpate press --help": module_command("palpate", "press", "--help"),
    }
    seconds: dict[str, list[float]] = {name: [] for name in commands}
    for k in range(arguments.repeats + 1):
        for name, command in commands.items():
            spent = _user_s(command)
            if k:
                seconds[name].append(spent)
    figures = {
        name: Figure(f"{name}, user CPU", float(np.median(each)), (min(each), max(each)), "s")
        for name, each in seconds.items()
    }
    numpy_s = figures["import numpy"].value
    figures["palpate --help"] = figures["palpate --help"].at_most(HELP_S)
    most = round(numpy_s + OVER_NUMPY_S, 3)
    figures["palpate press --help"] = figures["palpate press --help"].at_most(most, "importing NumPy + 0.3 s")
    print(table(["command", "user CPU, median [s]", "least", "most", "target"],
                [[n, f.value, *(f.spread or ()), f.target] for n, f in figures.items()]))  # fmt: skip
    return {"figures": list(figures.values())}


def _user_s(command: list[str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
