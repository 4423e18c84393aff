"""What compiling our kernels costs: CPU of each in a process with an empty cache, beside a second one.

Either does what the demo compiles beside its reconstruction (palpate.warm_up): a replay and a tick of the
finite-element renderer. The second finds the kernels on disk: the difference is what compiling costs.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import subprocess
import sys
import tempfile
import time
from typing import Any

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.child import module_command

AIM_S = 40.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Rows."""
    parser.add_argument("--rows", type=int, default=25, help="kernels to print, the most expensive first")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure, print a row a kernel, return."""
    with tempfile.TemporaryDirectory() as folder:
        first, second = (_measured(folder) for _ in range(2))
    spent = {name: seconds - second["stages"][name] for name, seconds in first["stages"].items()}
    rows = sorted(first["kernels"].items(), key=lambda each: -each[1][1])
    header = ["kernel", "compiled", "CPU, its own [s]", "with what it calls [s]"]
    print(table(header, [[name, *numbers] for name, numbers in rows[: arguments.rows]]))
    figures = [Figure(f"CPU of compiling, {stage}", seconds, unit="s") for stage, seconds in spent.items()]
    figures.append(Figure("CPU of compiling, all of it", sum(spent.values()), unit="s").at_most(AIM_S))
    figures.append(Figure("kernels compiled by a first process", len(rows)))
    figures.append(Figure("kernels compiled by a second process", len(second["kernels"])).at_most(0))
    figures += [Figure(f"CPU of {name}", numbers[1], unit="s") for name, numbers in rows]
    for figure in figures[: len(spent) + 3]:
        print(f"{figure.what}: {figure.value:.4g} {figure.unit}")
    return {"figures": figures}


def _measured(folder: str) -> dict[str, Any]:
    """What a process of its own says of its stages and kernels, with its compiled code in this folder."""
    command = module_command("benchmarks.compile")
    environment = dict(os.environ, NUMBA_CACHE_DIR=folder, OMP_NUM_THREADS="1")
    done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def _watch() -> dict[str, list[float]]:
    """Name -> [times compiled, own CPU s, CPU s with callees], filled as kernels are compiled from now on."""
    from numba.core import event

    found: dict[str, list[float]] = {}
    within: list[list[float]] = []  # of each kernel under way: when it began, and the CPU of its callees

    class Watch(event.Listener):
        def on_start(self, event: Any) -> None:
            within.append([time.process_time(), 0.0])

        def on_end(self, event: Any) -> None:
            began, callees = within.pop()
            spent = time.process_time() - began
            if within:
                within[-1][1] += spent
            function = event.data["dispatcher"].py_func
            row = found.setdefault(f"{function.__module__}.{function.__qualname__}", [0, 0.0, 0.0])
            for k, more in enumerate((1, spent - callees, spent)):
                row[k] += more

    event.register("numba:compile", Watch())
    return found


def _main() -> None:
    gc.disable()  # as the processes that compile do
    kernels = _watch()
    from palpate.warm_up import block_renderer, stages

    seconds = {}
    for name, work in stages(block_renderer()).items():
        began = time.process_time()
        work()
        seconds[name] = time.process_time() - began
    json.dump({"stages": seconds, "kernels": kernels}, sys.stdout)


if __name__ == "__main__":
    _main()
