"""Another simulator's flaw, tuned away on one shape and judged on others that it was not tuned on.

A setting of a simulator is made worse, and it presses the kit's cylinder. Then its settings are tuned, the
physics held (`palpate tune`), and beside it the usual way is gone with the same time: settings held, the
modulus identified. Both are judged on the kit's kidney and dome, whose true force is known to a bound.
Pressed is the way in of a path's first press, and its hold. No diagnosis says which setting to try first: one
press carries none.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
import time
from contextlib import chdir
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.diagnosis.other_simulator.runs import Runs, TruePath
from palpate.diagnosis.other_simulator.tuned import Judged, off, tuned
from palpate.operations.tune import path_of_body
from palpate.output import progress_bar
from palpate.render.options import BEST, DOCUMENTED, RenderOptions
from palpate.render.simulators.base import changed, over
from palpate.render.simulators.drake import Drake
from palpate.render.simulators.mujoco import MuJoCo
from palpate.render.simulators.newton import Newton
from palpate.render.simulators.scikit_fem import ScikitFem
from palpate.scenes.conformance.scaled import scaled_body

TUNED_ON, UNSEEN = "cylinder", ("kidney", "dome")
WITHIN_S = {"scikit-fem": 45.0, "mujoco": 60.0, "drake": 90.0, "newton": 75.0}
"""Of the processor, of tuning and of identifying alike, the judgement not in it."""
UNTIL_S = 0.17
"""Of a path: its way in, and its hold."""
CONTROLS = {
    "scikit-fem": (DOCUMENTED, {}),
    "mujoco": (BEST, {"edge_radii": "inf", "timestep_s": 0.004, "solref_s": 0.006, "density_kg_m3": 30}),
    "drake": (BEST, {"edge_radii": "inf", "timestep_s": 0.003, "sphere_radii": 0.3, "density_kg_m3": 30}),
    "newton": (BEST, {"edge_radii": "inf", "timestep_s": 0.004, "contact_n_per_m": 100}),
}
"""Settings whose flaw is planted: the kit's mesh is fine under its tip already. With a step of 5 ms Drake's
body rings and loses contact; Newton's contact diverges on this mesh at 3000 N/m, and from 30 to 1000 N/m, or
with a damping of 30 ms, what it misses on the cylinder changes by 0.1 mN: nothing to tune."""
ADAPTERS = {each.name: each for each in (ScikitFem, MuJoCo, Drake, Newton)}
PLANTED: dict[str, tuple[dict[str, float], ...]] = {
    "scikit-fem": ({"penalty": 0.3}, {"penalty": 0.6}, {"penalty": 1.0}, {"penalty": 1.8}),
    "mujoco": (
        {"solref_s": 0.03}, {"density_kg_m3": 1000.0}, {"damping_s": 0.03}, {"solref_s": 0.015},
        {"density_kg_m3": 300.0}, {"damping_s": 0.1},
    ),
    "drake": ({"sphere_radii": 1.0}, {"timestep_s": 0.02}, {"damping_s": 0.06}),
    "newton": ({"timestep_s": 0.016}, {"sweeps": 5}, {"contact_n_per_m": 1.0}),
}  # fmt: skip
RESTORED = 1.5
"""Ratio to the control within which a planted setting counts as restored."""
STILL = 2e-2
"""Change of the modulus below which identifying it ends."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which simulators; how many cases of each."""
    parser.add_argument("--only", nargs="+", choices=CONTROLS, default=list(CONTROLS))
    parser.add_argument("--cases", type=int, default=6, help="of each simulator, at most")
    parser.add_argument("--within", type=float, help="s of the processor, of a case (its simulator's usual)")
    parser.add_argument(
        "--work", type=Path, help="folder that keeps every case; those that lie there are not run"
    )
    parser.add_argument("--kept", action="store_true", help="run nothing, count what lies in --work")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Plant, tune, identify, judge; print the table."""
    rows = []
    work = None if arguments.work is None else arguments.work.resolve()
    cases = [(n, planted) for n in arguments.only for planted in PLANTED[n][: arguments.cases]]
    progress = progress_bar("cases")
    for done, (name, planted) in enumerate(cases):
        progress("cases", done / len(cases))
        key = "-".join([name, *(f"{k}-{v:g}" for k, v in planted.items())])
        path = None if work is None else work / f"{key}.json"
        if path is not None and path.exists():
            rows.append(json.loads(path.read_text()))
        elif not arguments.kept:
            # MuJoCo leaves its warnings in a file where it runs
            with tempfile.TemporaryDirectory() as folder, chdir(folder):
                rows.append(case(name, planted, arguments.within or WITHIN_S[name]))
            if path is not None:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(json.dumps(rows[-1], indent=1))
    progress.close()
    gaps = ["before", "tuned", "identified", "bound"]
    header = ["simulator", "planted", "moved", "shape", *gaps, "E moved by"]
    print(table(header, [line for row in rows for line in _lines(row)]))
    return {"figures": _figures(rows), "cases": rows}


def first_press(name: str) -> TruePath:
    """The first of the two presses of a body of the kit: the way in, and the hold."""
    return path_of_body(scaled_body(name), UNTIL_S)


@dataclass(frozen=True)
class _Identified:
    """factor: on the modulus. runs: of the simulator."""

    factor: float
    runs: int


def identified(runs: Runs, path: TruePath, within_s: float) -> _Identified:
    """The modulus with which the settings as they are come nearest to the force, by the factor on the force
    that each run asks for."""
    begun, factor, count = time.process_time(), 1.0, 0
    while time.process_time() - begun < within_s:
        sums, count = runs.run({}, stiffer(path, factor)).sums, count + 1
        factor *= float(np.clip(sums.scale, 0.25, 4.0))
        if abs(sums.scale - 1) < STILL:
            break
    return _Identified(factor, count)


def stiffer(path: TruePath, factor: float) -> TruePath:
    """The same press of a body that is given another modulus; its true force stays."""
    return replace(path, model=path.model.with_modulus(factor * path.model.material.young_modulus_pa))


def case(name: str, planted: dict[str, float], within_s: float) -> dict[str, Any]:
    """One planted flaw, tuned away and identified away."""
    settings, control = CONTROLS[name]
    options = RenderOptions(simulator_settings=settings, simulator_set=over("", {**control, **planted}))
    runs = Runs(name, options, time.process_time)
    path, unseen = first_press(TUNED_ON), [first_press(n) for n in UNSEEN]
    began = time.process_time()
    # the bound is a 95 % half width: half of it is what one may expect
    result = tuned(
        runs, path.model, Judged([path], [], []), noise_n=0.5 * (path.bound_n or 0.0), law_n=0.0,
        within_s=within_s, now=time.process_time,
    )  # fmt: skip
    spent = time.process_time() - began
    other = identified(runs, path, within_s)
    return {
        "simulator": name, "planted": planted, "cpu_s": spent, "trials": result.trials,
        "moved": {m.name: [m.before, m.after] for m in result.moved},
        "modulus_moved": result.modulus_moved, "modulus_would": result.scale - 1,
        "modulus_identified": other.factor - 1, "runs_identified": other.runs,
        "shapes": [
            {
                "name": each.name, "bound_n": each.bound_n,
                "before_n": off(runs, result.began, [each]).gap_n,
                "tuned_n": off(runs, result.settings, [each]).gap_n,
                "identified_n": off(runs, {}, [stiffer(each, other.factor)]).gap_n,
            }
            for each in (path, *unseen)
        ],
    }  # fmt: skip


def _lines(row: dict[str, Any]) -> list[list[Any]]:
    planted = ", ".join(f"{k}={v:g}" for k, v in row["planted"].items())
    moved = ", ".join(f"{k}={after:.3g}" for k, (_, after) in row["moved"].items()) or "nothing"
    return [
        [
            *((row["simulator"], planted, moved) if k == 0 else ("", "", "")), s["name"],
            *(f"{1e3 * s[key]:.2f} mN" for key in ("before_n", "tuned_n", "identified_n", "bound_n")),
            f"{100 * row['modulus_identified']:+.0f} %" if k == 0 else "",
        ]
        for k, s in enumerate(row["shapes"])
    ]  # fmt: skip


def _restored(row: dict[str, Any]) -> bool:
    """Whether what was planted ends near where its control has it."""
    settings, control = CONTROLS[row["simulator"]]
    own = changed(ADAPTERS[row["simulator"]].settings[settings], over("", control))
    ends = {name: row["moved"].get(name, [value, value])[1] for name, value in row["planted"].items()}
    return all(
        abs(math.log(end / getattr(own, name))) <= math.log(RESTORED) + 1e-9 for name, end in ends.items()
    )


def _figures(rows: list[dict[str, Any]]) -> list[Figure]:
    figures = []
    for name in ("", *dict.fromkeys(row["simulator"] for row in rows)):
        own = [row for row in rows if not name or row["simulator"] == name]
        said = f"{name}: " if name else ""
        shapes = [s for row in own for s in row["shapes"] if s["name"] != TUNED_ON]
        if not shapes:
            continue
        alone = [set(row["moved"]) == set(row["planted"]) for row in own]
        what = f"{said}what was planted is moved, and no other, {sum(alone)} of {len(alone)}"
        figures.append(Figure(what, 100 * float(np.mean(alone)), unit="%"))
        back = [_restored(row) for row in own]
        what = f"{said}planted setting restored within a factor of {RESTORED:g}, {sum(back)} of {len(back)}"
        figures.append(Figure(what, 100 * float(np.mean(back)), unit="%"))
        won = [s["tuned_n"] < s["identified_n"] for s in shapes]
        what = f"{said}tuned settings beat an identified modulus on unseen shapes, {sum(won)} of {len(won)}"
        figures.append(Figure(what, 100 * float(np.mean(won)), unit="%").at_least(90))
        better = [s["tuned_n"] / s["before_n"] for s in shapes]
        figures += [
            Figure(f"{said}unseen shapes, error after over before, median", float(np.median(better))),
            Figure(
                f"{said}unseen shapes, error with an identified modulus over before, median",
                float(np.median([s["identified_n"] / s["before_n"] for s in shapes])),
            ),
            Figure(
                f"{said}unseen shapes, error after tuning over the truth's bound, median",
                float(np.median([s["tuned_n"] / s["bound_n"] for s in shapes])),
            ),
        ]
    if rows:
        most = 100 * max(abs(r["modulus_moved"]) for r in rows)
        figures += [
            Figure("modulus moved by tuning, greatest", most, unit="%").at_most(2),
            Figure(
                "modulus that a fit would still move by once tuned, median",
                100 * float(np.median([abs(r["modulus_would"]) for r in rows])), unit="%",
            ),
            Figure(
                "modulus moved by identifying it, median",
                100 * float(np.median([abs(r["modulus_identified"]) for r in rows])), unit="%",
            ),
            Figure(f"tuning, processor time of a case, median of {len(rows)}",
                   float(np.median([r["cpu_s"] for r in rows])), unit="s"),
        ]  # fmt: skip
    return figures
