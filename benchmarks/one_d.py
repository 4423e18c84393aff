"""1D models of every press of a recording, against the paper's 0.5 s."""

from __future__ import annotations

import argparse
from typing import Any

from benchmarks.timing import measure, table
from mechanics.recording import read_recording
from reconstruct.contacts import explore
from reconstruct.one_d import fit_paper, fit_robust
from reconstruct.uniaxial import profiles
from scenes.embedded import embedded_recording

SUMMARY = "Kelvin-Voigt and Hunt-Crossley fits of every press"
PAPER_S = 0.5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """REC and repeats."""
    parser.add_argument("recording", nargs="?", help="recording (default: the embedded one)")
    parser.add_argument("--repeats", type=int, default=9)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Time the profiles and both estimators."""
    exploration = explore(read_recording(arguments.recording or embedded_recording()))
    presses = profiles(exploration, exploration.normals)
    work = {
        "profiles": lambda: profiles(exploration, exploration.normals),
        "paper's estimators": lambda: fit_paper(presses),
        "bounded, robust": lambda: fit_robust(presses),
    }
    rows, result = [], {"presses": len(presses)}
    for name, call in work.items():
        timing = measure(call, repeats=arguments.repeats)
        rows.append(
            [name, timing.median_s * 1e3, timing.spread, timing.cpu_median_s * 1e3, PAPER_S / timing.median_s]
        )
        result[name] = {"median_s": timing.median_s, "spread": timing.spread, "cpu_s": timing.cpu_median_s}
    print(f"{len(presses)} presses")
    print(table(["step", "median [ms]", "spread", "CPU [ms]", "paper's 0.5 s over it"], rows))
    return result
