"""Files as people export them: how many are understood and right, asked about, refused, or wrong in
silence.

Machines' curves and robots' logs, with units, signs, axes, separators, decimal signs, headers and clocks
drawn at random (tests/support/exports.py), as text, spreadsheets (xlsx, ods), NumPy (npz, npy), MATLAB, ROS
bags and MCAP. Thresholds were shaped on seeds below 1000, which a measurement leaves out. A machine's file is
right where its modulus is within 40 % of the truth (the curves relax and lose work, which the ideal law does
not know), a robot's where positions and forces on the tool are the truth.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.evidence import Figure, rates
from tests.support.exports import Export, export

_TOLERANCE = 0.4
OUTCOMES = ("understood and right", "asked", "refused with a cure", "refused without", "wrong in silence")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """--files, --seed."""
    parser.add_argument("--files", type=int, default=400, help="how many (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1000, help="of the first file (default: %(default)s)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """{"outcomes": counts by kind, "wrong": names, "figures"}."""
    counts: dict[str, Counter[str]] = {"curves": Counter(), "recording": Counter()}
    by_file: dict[str, Counter[str]] = {}
    wrong, begun = [], time.process_time()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for seed in range(arguments.seed, arguments.seed + arguments.files):
            made = export(Path(folder), seed, mixed=True)
            outcome = outcome_of(made)
            counts[made.kind][outcome] += 1
            by_file.setdefault(str(made.traits.get("container", "text")), Counter())[outcome] += 1
            if outcome == "wrong in silence":
                wrong.append({"seed": seed, **made.traits})
            shutil.rmtree(made.path) if made.path.is_dir() else made.path.unlink()
    for kind, each in (*counts.items(), *sorted(by_file.items())):
        print(f"{kind}: " + ", ".join(f"{name} {each[name]}" for name in OUTCOMES))
    total = sum(counts.values(), Counter())
    figures = rates({name: (total[name], arguments.files) for name in OUTCOMES})
    figures[0] = figures[0].at_least(75)
    figures[-1] = figures[-1].at_most(0)
    seconds = (time.process_time() - begun) / arguments.files
    figures.append(Figure("processor time a file", seconds, unit="s"))
    figures += rates(
        {
            f"{OUTCOMES[0]} of {kind} files": (each[OUTCOMES[0]], sum(each.values()))
            for kind, each in sorted(by_file.items())
        }
    )
    return {
        "outcomes": {k: dict(v) for k, v in (*counts.items(), *by_file.items())},
        "wrong": wrong,
        "figures": figures,
    }


def outcome_of(made: Export) -> str:
    """What becomes of one file."""
    try:
        if made.kind == "curves":
            said = {"columns": made.columns, "units": made.units}
            found = pp.material(made.path, tip_radius_m=made.tip_radius_m, fast=True, progress=False, **said)
            if not found.predicts:
                return "refused with a cure"
            assert made.young_modulus_pa is not None
            right = abs(np.log(found.young_modulus_pa / made.young_modulus_pa)) < np.log(1 + _TOLERANCE)
        else:
            read = pp.read_table(
                made.path, tip_radius_m=made.tip_radius_m, columns=made.columns, units=made.units
            )
            assert made.position is not None and made.force_on_tool is not None
            right = (
                read.position.shape == made.position.shape
                and np.allclose(read.position, made.position, atol=1e-6)
                and np.allclose(read.force_on_tool, made.force_on_tool, atol=1e-4)
            )
    except pp.PalpateError as refused:
        if getattr(refused, "option", None) or "is it" in str(refused):
            return "asked"
        return "refused with a cure" if "--" in str(refused) else "refused without"
    return "understood and right" if right else "wrong in silence"
