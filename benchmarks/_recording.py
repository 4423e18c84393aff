"""What the benchmarks of the reconstruction share: one recording, repeats, rows against the paper's times."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from benchmarks.evidence import Figure
from benchmarks.timing import measure, table
from palpate.mechanics.recording.recording import Recording, read_recording
from palpate.scenes.embedded import embedded_recording


def add_recording(parser: argparse.ArgumentParser, repeats: int) -> None:
    """REC and --repeats."""
    parser.add_argument("recording", nargs="?", help="recording (default: the embedded one)")
    parser.add_argument("--repeats", type=int, default=repeats)


def add_indentation(parser: argparse.ArgumentParser) -> None:
    """--indentation, of the paper's method; the embedded recording stays shallower than the paper's 10 mm."""
    parser.add_argument("--indentation", type=float, default=0.005, help="m, for the paper's method")


def recording_of(arguments: argparse.Namespace) -> Recording:
    """The recording asked for."""
    return read_recording(arguments.recording or embedded_recording())


def timed(work: dict[str, Callable[[], Any]], repeats: int, paper_s: float) -> dict[str, Any]:
    """Time every call, print a row each, ms and beside the paper's time; returns them, and as "figures"."""
    rows: list[list[Any]] = []
    result: dict[str, Any] = {}
    figures = []
    for name, call in work.items():
        timing = measure(call, repeats=repeats)
        rows.append(
            [
                name,
                timing.median_s * 1e3,
                timing.spread,
                timing.cpu_median_s * 1e3,
                paper_s / timing.median_s,
            ]
        )
        result[name] = {"median_s": timing.median_s, "spread": timing.spread, "cpu_s": timing.cpu_median_s}
        # judged by processor time, all threads: by the clock a shared machine tells of its other users
        cpu = Figure(f"{name}, CPU", timing.cpu_median_s, timing.cpu_spread_s, "s")
        figures.append(cpu.at_most(paper_s, "the paper's, by the clock"))
        figures.append(Figure(f"{name}, wall", timing.median_s, (timing.least_s, timing.most_s), "s"))
    print(table(["step", "median [ms]", "spread", "CPU [ms]", f"paper's {paper_s:g} s over it"], rows))
    return {**result, "figures": figures}
