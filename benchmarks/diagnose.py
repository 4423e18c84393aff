"""The blind benchmark: sealed recordings of the virtual laboratory, verdicts first, truths opened after.

Sizes: quick (for CI), medium, full. Every case is simulated with its truth sealed, reconstructed, diagnosed,
and its
verdict written to the work folder before the truth is opened; a run that was interrupted goes on where it
stopped.
Rates carry Wilson's 95 % intervals. Baselines on the same recordings: the best in-sample fit by BIC, and for
the gap a
regression of the residual on place, depth, rate and history.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._diagnosis_scores import FAMILIES, pictures, show, summarise
from mechanics.errors import PalpateError
from mechanics.files import atomic_file

SUMMARY = "blind diagnosis of sealed recordings: detection, names, false alarms, gap closed"
INSTRUMENT = (
    "time_delay",
    "backlash",
    "tool_compliance",
    "force_bias",
    "force_drift",
    "force_gain",
    "tool_gravity_inertia",
)
CHEAP = (*INSTRUMENT, "viscoelasticity", "adhesion", "surface_offset", "mullins_softening")
SOLID = ("finite_strain", "inclusion", "modulus_gradient", "skin_layer", "poisson_ratio", "unbonded_base",
         "compliant_base", "tip_radius", "friction_slip", "strain_stiffening")  # fmt: skip


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Size, work folder, seed."""
    parser.add_argument("--size", choices=("quick", "medium", "full"), default="quick", help="how many cases")
    parser.add_argument(
        "--work", default="bench-diagnose", help="folder of recordings and verdicts (resumed)"
    )
    parser.add_argument("--phantom", action="append", help="phantoms to use (repeatable; default: by size)")
    parser.add_argument(
        "--fast", action=argparse.BooleanOptionalAction, default=None, help="diagnose with --fast"
    )
    parser.add_argument(
        "--limit", type=int, help="stop after this many new cases (the table shows what is there)"
    )
    parser.add_argument("--picture", metavar="PNG", help="confusion matrix and calibration as a picture")
    parser.add_argument("--seed", type=int, default=0, help="first seed")


def cases(size: str, phantoms: list[str] | None, seed: int) -> list[dict[str, Any]]:
    """The cases of a size: phantom, effects with strengths, what is left out of the library, seed."""
    named = {"quick": CHEAP[:6], "medium": CHEAP, "full": (*CHEAP, *SOLID)}[size]
    strengths = {"quick": (1.0,), "medium": (0.5, 1.0, 2.0), "full": (0.25, 0.5, 1.0, 2.0, 4.0)}[size]
    shapes = (
        phantoms
        or {"quick": ["cylinder"], "medium": ["cylinder"], "full": ["cylinder", "block", "dome", "bean"]}[
            size
        ]
    )
    controls = {"quick": 2, "medium": 12, "full": 150}[size]
    found: list[dict[str, Any]] = []
    number = seed
    for shape in shapes:
        for _ in range(max(1, controls // len(shapes))):
            found.append({"kind": "control", "phantom": shape, "effects": {}, "without": "", "seed": number})
            number += 1
        for strength in strengths:
            for name in named:
                found.append(
                    {
                        "kind": "single",
                        "phantom": shape,
                        "effects": {name: strength},
                        "without": "",
                        "seed": number,
                    }
                )
                number += 1
        if size != "quick":
            for name in named:
                found.append(
                    {
                        "kind": "left-out",
                        "phantom": shape,
                        "effects": {name: 2.0},
                        "without": name,
                        "seed": number,
                    }
                )
                number += 1
            for name in FAMILIES:
                found.append(
                    {
                        "kind": "absent",
                        "phantom": shape,
                        "effects": {name: 2.0},
                        "without": "",
                        "seed": number,
                    }
                )
                number += 1
            pairs = [
                ("time_delay", "force_bias"),
                ("viscoelasticity", "tool_compliance"),
                ("adhesion", "force_gain"),
            ]
            for a, b in pairs:
                found.append(
                    {
                        "kind": "pair",
                        "phantom": shape,
                        "effects": {a: 1.5, b: 1.5},
                        "without": "",
                        "seed": number,
                    }
                )
                number += 1
    return found


def key_of(case: dict[str, Any]) -> str:
    """A file name for a case."""
    effects = "+".join(f"{k}={v:g}" for k, v in case["effects"].items()) or "none"
    left = f"-without-{case['without']}" if case["without"] else ""
    return f"{case['phantom']}-{effects}{left}-{case['seed']}".replace("/", "_")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Run what is missing, open the truths, print the table."""
    work = Path(arguments.work)
    fast = arguments.size == "quick" if arguments.fast is None else arguments.fast
    todo = cases(arguments.size, arguments.phantom, arguments.seed)
    fresh = 0
    for number, case in enumerate(todo):
        verdict = work / f"{key_of(case)}.verdict.json"
        if verdict.exists():
            continue
        if arguments.limit is not None and fresh >= arguments.limit:
            break
        begun = time.perf_counter()
        result = judge(case, work, fast)
        fresh += 1
        with atomic_file(verdict) as temporary:
            temporary.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        print(f"{number + 1}/{len(todo)} {key_of(case)}: {result.get('kind')} {result.get('effects')} "
              f"({time.perf_counter() - begun:.0f} s)", flush=True)  # fmt: skip
    opened_cases = [opened_case(c, work) for c in todo if (work / f"{key_of(c)}.verdict.json").exists()]
    summary = summarise(opened_cases)
    summary["size"] = {"asked": len(todo), "done": len(opened_cases), "fast": fast}
    show(summary)
    if arguments.picture:
        print(f"picture: {pictures(summary, arguments.picture)}")
    return summary


def judge(case: dict[str, Any], work: Path, fast: bool) -> dict[str, Any]:
    """Simulate sealed, reconstruct, diagnose; the truth stays shut. Errors are a verdict too."""
    from diagnose.baselines import best_by_bic, regressed_gap
    from diagnose.pipeline import DiagnoseOptions, diagnose
    from mechanics.recording import read_recording
    from reconstruct.pipeline import ReconstructOptions, reconstruct
    from scenes.laboratory.sealing import write_sealed
    from scenes.laboratory.simulate import SimulateOptions, simulate
    from scenes.phantoms import phantom

    work.mkdir(parents=True, exist_ok=True)
    (work / "truth").mkdir(exist_ok=True)
    stem = work / f"{key_of(case)}.csv.gz"
    if not stem.exists():
        rng = np.random.default_rng(case["seed"])
        modulus = float(rng.uniform(15e3, 40e3))
        options = SimulateOptions(young_modulus_pa=modulus, frame=True)
        made = simulate(phantom(case["phantom"]), case["effects"], options, seed=case["seed"], sizes=True)
        write_sealed(stem, made.recording, made.truth, work / "truth" / f"{key_of(case)}.json")
    try:
        recording = read_recording(stem)
        model = reconstruct(recording, ReconstructOptions())
        result = diagnose(recording, model, DiagnoseOptions(fast=fast, without=case["without"]))
    except PalpateError as error:
        return {"kind": "failed", "effects": [], "candidates": [], "why": str(error)}
    data = result.as_json()
    assert (
        result.attribution is not None and result.forward is not None and result.residual_before is not None
    )
    return {
        **data["verdict"],
        "gap_before_n": data["gap_before_n"],
        "gap_after_n": data["gap_after_n"],
        "gap_closed": data["gap_closed"],
        "gap_closed_ci95": data["gap_closed_ci95"],
        "noise_n": data["noise_n"],
        "parameters": {
            e["name"]: e["parameters"] for e in data["effects"] if e["name"] in data["verdict"]["effects"]
        },
        "probability": {e["name"]: e["probability"] for e in data["effects"]},
        "young_modulus_pa": data["young_modulus_pa"],
        "bic": best_by_bic(result.attribution),
        "regression_gap_n": regressed_gap(result.forward, result.residual_before),
        "seconds": sum(data["seconds"].values()),
    }


def opened_case(case: dict[str, Any], work: Path) -> dict[str, Any]:
    """The verdict with its truth, checked against the seal."""
    from scenes.laboratory.sealing import opened

    verdict = json.loads((work / f"{key_of(case)}.verdict.json").read_text(encoding="utf-8"))
    truth = opened(work / f"{key_of(case)}.sealed", work / "truth" / f"{key_of(case)}.json")
    return {"key": key_of(case), "case": case, "verdict": verdict, "truth": truth}
