"""The whole reconstruction, recording in memory to model in memory, against the paper's 45 s."""

from __future__ import annotations

import argparse
import os
from typing import Any

import numpy as np

from benchmarks._recording import add_indentation, add_recording, recording_of
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.reconstruction.methods import METHODS
from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct_fully
from palpate.reconstruction.steps.s7_modulus.modulus_paper import PaperOptions

PAPER_S = 45.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC, repeats, indentation, methods."""
    add_recording(parser, repeats=3)
    add_indentation(parser)
    parser.add_argument("--method", nargs="+", choices=METHODS, default=["paper", "finite-tip"])


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Time both methods, every step apart."""
    recording = recording_of(arguments)
    result: dict[str, Any] = {}
    figures = []
    for method in arguments.method:
        options = ReconstructOptions(method=method, paper=PaperOptions(indentation_m=arguments.indentation))
        laps, cpu = [], []
        for _ in range(arguments.repeats):
            before = _cpu_s()
            laps.append(reconstruct_fully(recording, options).seconds)
            cpu.append(_cpu_s() - before)
        steps = {name: float(np.median([lap[name] for lap in laps])) for name in laps[0]}
        totals = [sum(lap.values()) for lap in laps]
        median = float(np.median(totals))
        rows = [[name, seconds, seconds / median] for name, seconds in steps.items()]
        print(
            f"method {method}: {median:.2f} s (spread {(max(totals) - min(totals)) / median:.2f}), "
            f"{np.median(cpu):.2f} s of processor time; the paper's 45 s over it: {PAPER_S / median:.1f}"
        )
        print(table(["step", "median [s]", "share"], rows))
        result[method] = {"median_s": median, "least_s": min(totals), "most_s": max(totals),
                          "cpu_s": float(np.median(cpu)), "steps_s": steps}  # fmt: skip
        used = Figure(f"method {method}, CPU", float(np.median(cpu)), (min(cpu), max(cpu)), "s")
        figures.append(used.at_most(PAPER_S, "the paper's, by the clock"))
        figures.append(Figure(f"method {method}, wall", median, (min(totals), max(totals)), "s"))
    return {**result, "figures": figures}


def _cpu_s() -> float:
    """Processor time of this process and its children (the mesher is one), s."""
    return sum(os.times()[:4])
