"""How an effect would be named by one score and one null, beside the rules that name it today.

The score is the log predictive density of places that were not fitted, with the variances of our own errors
estimated for each recording; the null is drawn from the fit. docs/diagnosis-benchmark.md says what was
measured, and why the diagnosis does not decide so yet.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.model import read_model
from mechanics.recording import read_recording
from palpate.benchmarks.timing import table

SUMMARY = "predictive density of held-out places for each effect, against the recording's own null"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recordings, their models, effects that are taken as given."""
    parser.add_argument("recordings", nargs="+", metavar="REC", help="recordings")
    parser.add_argument("--models", type=Path, help="folder of models, each named as its recording's file")
    parser.add_argument("--given", default="", help="effects that are there already, comma separated")
    parser.add_argument("--seed", type=int, default=0, help="seed of the null's draws")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """One step of the search for every recording; print what gains most."""
    result = {}
    for path in map(Path, arguments.recordings):
        name = path.name.split(".")[0]
        answer = weighed_step(
            path, arguments.models and arguments.models / name, arguments.given, arguments.seed
        )
        print(f"{name}: over {' and '.join(answer['given']) or 'nothing'}; the null's best of all effects "
              f"{answer['null_median']:.1f}, {answer['null_98']:.1f} in 2 % of draws; "
              f"best {answer['best']}, p {answer['p']:.4f}")  # fmt: skip
        ranked = sorted(answer["gains"], key=lambda n: -answer["gains"][n])
        print(table(["effect", "gain", "linear", "confidence set p"], [
            [n, f"{answer['gains'][n]:.1f}", f"{answer['linear'].get(n, np.nan):.1f}",
             f"{answer['standing'][n]:.3f}"]
            for n in ranked]))  # fmt: skip
        print("own errors over their usual size: "
              + ", ".join(f"{k} {v:.2f}" for k, v in answer["own_errors"].items()))  # fmt: skip
        result[name] = answer
    return result


def weighed_step(path: Path, model_path: Path | None, given: str, seed: int) -> dict[str, Any]:
    """One step over the better of linear and neo-Hookean, and over the effects that are given."""
    from diagnose.forward import build_forward
    from diagnose.freeair import free_air_of
    from diagnose.instrument_offsets import find_instrument_offsets
    from diagnose.misfit import misfit_of
    from diagnose.rigid import rigid_of
    from diagnose.shape import site_stiffness_sd
    from diagnose.touches import touches_of
    from diagnose.whiten import NuisanceOptions
    from mechanics.effects.base import Role
    from mechanics.effects.registry import effect, effects
    from palpate.benchmarks._density_fits import Weighing
    from palpate.benchmarks._density_search import step
    from reconstruct.pipeline import ReconstructOptions, reconstruct
    from reconstruct.placing import presses_on

    recording = read_recording(path)
    model = read_model(model_path) if model_path else reconstruct(recording, ReconstructOptions())
    presses = presses_on(recording, model)
    forward = build_forward(touches_of(presses), model)
    rigid = rigid_of(recording, presses, model.support.normal)
    offsets = find_instrument_offsets(forward, free_air_of(recording, presses), rigid, set())
    site_sd = site_stiffness_sd(forward.touches, model, NuisanceOptions())
    weighing = Weighing(forward, site_sd, model.material.young_modulus_pa)
    known = next(e for e in effects() if e.role is Role.KNOWN)
    there = [effect(n.strip()) for n in given.split(",") if n.strip()]
    weighing.settle(weighing.judge([known, *there]))
    both = [weighing.judge(there), weighing.judge([known, *there])]
    current = max(both, key=lambda j: j.held.sum())
    weighing.settle(current)
    current = weighing.judge(current.found.effects)
    tried = [e for e in effects() if e.role is Role.SEARCHED and e.name not in offsets.names]
    misfit = misfit_of(forward, current.found, site_sd)
    weighing.starts = {e.name: e.seek(forward, misfit) for e in tried if e.seek is not None}
    found = step(weighing, current, tried, known, seed)
    return {
        "given": [*offsets.names, *current.names],
        "finite_strain_gain": float((both[1].held - both[0].held).sum()),
        "best": found.best,
        "p": found.p,
        "gains": found.gains,
        "linear": found.linear,
        "standing": found.standing,
        "null_median": float(np.median(found.null)),
        "null_98": float(np.quantile(found.null, 0.98)),
        "own_errors": current.weighed.sizes,
    }
