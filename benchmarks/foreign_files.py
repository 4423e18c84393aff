"""Files as people export them: how many are understood and right, asked about, refused, or wrong in
silence.

Machines' curves and robots' logs, with units, signs, axes, separators, decimal signs, headers and clocks
drawn at random (tests/support/exports.py), as text, spreadsheets (xlsx, ods), NumPy (npz, npy), MATLAB, ROS
bags and MCAP. Every other file is of what nobody had tried (tests/support/strange_exports.py): tips of other
forms, stated or not, curves and robots' logs from 10 Hz, words beside numbers, tests side by side, no time,
meshes of several parts, another simulator's forces in axes and a unit of its own. What is asked is answered
with the truth, the command that a refusal names is run, and the answer is judged. Thresholds were shaped on
seeds below 1000, which a measurement leaves out.

Right is: of a machine's curves the modulus within 40 % (they relax and lose work, which the ideal law does
not know), of clean ones within 15 %, all tests read; of a robot's table its positions and forces on the tool;
of a log of presses the modulus within 15 % and every press; of a mesh the volume and modulus of each part; of
forces their axes and unit.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.evidence import Figure, rates
from palpate.diagnosis.other_simulator.frame import weighed_frame
from tests.support.exports import Export, export
from tests.support.strange_exports import strange_export

_RELAXED, _CLEAN = 0.4, 0.15
OUTCOMES = (
    "understood and right",
    "asked, and right when answered",
    "refused with a cure",
    "refused without",
    "asked in vain",
    "wrong in silence",
)
_ANSWERS = 5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """--files, --seed."""
    parser.add_argument("--files", type=int, default=600, help="how many (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1000, help="of the first file (default: %(default)s)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """{"outcomes": counts by kind, "wrong": names, "figures"}."""
    counts: dict[str, Counter[str]] = {}
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
            if outcome in OUTCOMES[3:]:
                wrong.append({"seed": seed, "outcome": outcome, **made.traits})
            shutil.rmtree(made.path) if made.path.is_dir() else made.path.unlink()
    for kind, each in (*counts.items(), *sorted(by_file.items())):
        print(f"{kind}: " + ", ".join(f"{name} {each[name]}" for name in OUTCOMES))
    total = sum(counts.values(), Counter())
    figures = rates({name: (total[name], arguments.files) for name in OUTCOMES})
    figures[0] = figures[0].at_least(80)
    figures[3:6] = [figure.at_most(0) for figure in figures[3:6]]
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
    """What becomes of one file, whose owner answers what is asked."""
    said: dict[str, Any] = dict(made.said)
    for asked in range(_ANSWERS):
        try:
            right = _JUDGES[made.kind](made, said)
        except pp.PalpateError as refused:
            answer = _answer(made, refused, said)
            if answer and asked + 1 < _ANSWERS:
                said |= answer
                continue
            if "press slower" in str(refused):
                return "refused with a cure"
            if asked:
                return "asked in vain"
            return "refused with a cure" if "--" in str(refused) else "refused without"
        if right is None:  # an answer that says itself what it is not, and what to do
            return "refused with a cure"
        if right:
            return OUTCOMES[1] if asked else OUTCOMES[0]
        return "asked in vain" if asked else "wrong in silence"
    raise AssertionError("the last answer was judged")


def _answer(made: Export, refused: pp.PalpateError, said: Mapping[str, Any]) -> dict[str, Any]:
    """What the owner says to a question, by option; {} where nothing is asked, or it was said before."""
    option = str(getattr(refused, "option", None))
    if (named := re.search(r"--(simulated-axes|simulated-unit|modulus) ", str(refused))) is not None:
        option = named[1]
    answer = made.traits.get("answers", {}).get(option)
    return {} if answer is None or said.get(option) == answer else {option: answer}


def _curves(made: Export, said: Mapping[str, Any]) -> bool | None:
    """None where the answer says itself that it does not predict."""
    given: dict[str, Any] = {"columns": made.columns, "units": made.units, "tip_radius_m": made.tip_radius_m}
    found = pp.material(made.path, fast=True, progress=False, **{**given, **said})
    if not found.predicts:
        return None
    assert made.young_modulus_pa is not None
    off = abs(np.log(found.young_modulus_pa / made.young_modulus_pa))
    strange = "strange" in made.traits
    every = not strange or found.curves == made.traits.get("tests", made.traits.get("count"))
    return bool(off < np.log(1 + (_CLEAN if strange else _RELAXED)) and every)


def _table(made: Export, said: Mapping[str, Any]) -> bool:
    given: dict[str, Any] = {"columns": made.columns, "units": made.units, "tip_radius_m": made.tip_radius_m}
    read = pp.read_table(made.path, **{**given, **said})
    assert made.position is not None and made.force_on_tool is not None
    return (
        read.position.shape == made.position.shape
        and np.allclose(read.position, made.position, atol=1e-6)
        and np.allclose(read.force_on_tool, made.force_on_tool, atol=1e-4)
    )


def _log(made: Export, said: Mapping[str, Any]) -> bool | None:
    """As it is opened; where a refusal names the command for its tip, by that."""
    try:
        found = pp.open(
            made.path, half_space=True, tip_radius_m=made.tip_radius_m, progress=False, **said
        ).result
    except pp.PalpateError as refused:
        named = re.search(r"palpate material \S+ --tip (\w+) --tip-(radius|angle)", str(refused))
        if named is None:
            raise
        size = {"tip_radius_m": made.tip_radius_m if named[2] == "radius" else None}
        units = {"units": said.get("units") or {"position": made.traits["answers"]["units"]["position"]}}
        angle = {"tip_angle_deg": 45.0} if named[2] == "angle" else {}
        return _curves(made, {"tip": named[1], **units, **angle, **size})
    if not getattr(found, "predicts", False):
        return None
    every = len(found.model.presses) == made.traits["count"]
    assert made.young_modulus_pa is not None
    return bool(abs(np.log(found.young_modulus_pa / made.young_modulus_pa)) < np.log(1 + _CLEAN) and every)


def _parts(made: Export, said: Mapping[str, Any]) -> bool:
    """Volume and modulus of each part, as the model's tetrahedra have them."""
    found = pp.model_of(made.path, said.get("modulus"), unit="mm", progress=False)
    moduli = np.array(list(made.traits["answers"]["modulus"].values()))
    volumes = 1e-6 * np.array(made.traits["volumes_cm3"])
    own = found.material.young_modulus_pa * found.element_ratio
    return bool(np.isclose(found.mesh.volumes @ own, volumes @ moduli, rtol=0.05))


def _frame(made: Export, said: Mapping[str, Any]) -> bool | None:
    """None where newtons are kept, and the flag that mends it is said."""
    presses = pp.load("demo", progress=False).presses
    axes, unit = said.get("simulated-axes", ""), said.get("simulated-unit")
    force = np.load(made.path)
    frame = weighed_frame(force, presses, presses.counted, axes=axes, unit=unit, level=1.0)
    wanted = made.traits["answers"]["simulated-axes"], made.traits["answers"]["simulated-unit"]
    if frame.axes == wanted[0] and f"--simulated-unit {wanted[1]}" in " ".join(frame.notes):
        return None
    return (frame.axes, frame.unit) == wanted


_JUDGES = {"curves": _curves, "recording": _table, "log": _log, "parts": _parts, "frame": _frame}
