"""The whole reconstruction, recording in memory to model in memory, against the paper's 45 s."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from benchmarks.timing import table
from mechanics.recording import read_recording
from reconstruct.modulus_paper import PaperOptions
from reconstruct.pipeline import ReconstructOptions, reconstruct_fully
from scenes.embedded import embedded_recording

SUMMARY = "the whole reconstruction, step by step"
PAPER_S = 45.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC and repeats."""
    parser.add_argument("recording", nargs="?", help="recording (default: the embedded one)")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--indentation", type=float, default=0.005, help="m, for the paper's method")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Time both methods, every step apart."""
    recording = read_recording(arguments.recording or embedded_recording())
    result: dict[str, Any] = {}
    for method in ("paper", "finite-tip"):
        options = ReconstructOptions(method=method, paper=PaperOptions(indentation_m=arguments.indentation))
        laps = [reconstruct_fully(recording, options).seconds for _ in range(arguments.repeats)]
        steps = {name: float(np.median([lap[name] for lap in laps])) for name in laps[0]}
        totals = [sum(lap.values()) for lap in laps]
        median = float(np.median(totals))
        rows = [[name, seconds, seconds / median] for name, seconds in steps.items()]
        print(f"method {method}: {median:.2f} s (spread {(max(totals) - min(totals)) / median:.2f}), "
              f"the paper's 45 s are {PAPER_S / median:.1f} times that")  # fmt: skip
        print(table(["step", "median [s]", "share"], rows))
        result[method] = {"median_s": median, "least_s": min(totals), "most_s": max(totals), "steps_s": steps}
    return result
