"""Files as people export them: how many are understood and right, asked about, refused, or wrong in
silence.

Machines' curves and robots' logs, with units, signs, axes, separators, decimal signs, headers and clocks
drawn at random (tests/support/exports.py), as text, spreadsheets (xlsx, ods), NumPy (npz, npy), MATLAB, ROS
bags and MCAP. Every other file is of what nobody had tried (tests/support/strange_exports.py): tips of other
forms, stated or not, readings from 10 Hz, words beside numbers, tests side by side, no time, meshes of
several parts, another simulator's forces in axes and a unit of its own. Thresholds were shaped on seeds below
1000, which a measurement leaves out. A machine's file is right where its modulus is within 40 % of the truth
(the curves relax and lose work, which the ideal law does not know), a robot's where positions and forces on
the tool are the truth, a mesh's where its parts are asked for with their volumes, forces' where axes and unit
are the truth.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
import time
import warnings
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.evidence import Figure, rates
from palpate.diagnosis.other_simulator.frame import weighed_frame
from tests.support.exports import Export, export
from tests.support.strange_exports import strange_export

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
            draw = strange_export if seed % 2 else partial(export, mixed=True)
            made = draw(Path(folder), seed // 2)
            outcome = outcome_of(made)
            counts.setdefault(made.kind, Counter())[outcome] += 1
            sort = str(made.traits.get("strange") or made.traits.get("container", "text"))
            by_file.setdefault(sort, Counter())[outcome] += 1
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
            said = {"columns": made.columns, "units": made.units, **made.said}
            found = pp.material(made.path, tip_radius_m=made.tip_radius_m, fast=True, progress=False, **said)
            if not found.predicts:
                return "refused with a cure"
            assert made.young_modulus_pa is not None
            right = abs(np.log(found.young_modulus_pa / made.young_modulus_pa)) < np.log(1 + _TOLERANCE)
        elif made.kind == "parts":
            right = _asks_for_parts(made)
        elif made.kind == "frame":
            presses = pp.load("demo", progress=False).presses
            frame = weighed_frame(np.load(made.path), presses, presses.counted, axes="", unit=None, level=1.0)
            right = (frame.axes, frame.unit) == (made.traits["axes"], made.traits["unit"])
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


def _asks_for_parts(made: Export) -> bool:
    """Whether a mesh of parts is not made one, and its volumes are right."""
    try:
        pp.model_of(made.path, unit="mm", progress=False)
    except pp.OptionError as asked:
        told = [float(x) for x in re.findall(r"([\d.]+) cm³", str(asked))]
        return bool(np.allclose(told, made.traits["volumes_cm3"], rtol=0.01)) and "--modulus" in str(asked)
    return False
