"""Tissue as robots probe it: the finite-element model with a field against the better 1D model, held out.

Phantoms of the virtual laboratory (benchmarks/_robot_tissue.py: a random field of the modulus, in half of all
cases layers, a surface that wanders by 1 to 3 mm) are pressed at 70 to 120 places up to some 1 N, 5 to 12
rows a place, without a time. They come in as anybody's quasi-static points on a slab of stated thickness.
Held out are folds over places. The gap is the rms error of the force beyond the sensor's noise: what counts
is gap squared less noise squared, of the model over that of the better 1D model; aim: at most 0.9 in 9 of 10.
With --dense, some phantoms are sampled again with 10 and with 100 rows a place: aim: as good to 5 % where
both tell as much, the noise of the ten divided by the root of ten; what the same noise costs is said beside.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks._robot_tissue import RobotTissue, robot_tissue
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.diagnosis.compare.models import HOMOGENEOUS, MODELS, RIVALS, predicted, prepare, rms
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.output import progress_bar
from palpate.reconstruction.presses_on_model import presses_on

_EDGE_M, _MARGIN_M = 0.011, 0.030
BETTER, ALIKE = 0.9, 1.05
_QUIETER = {"that tell as much": 10**0.5, "of the same noise": 1.0}
"""By what the noise of ten rows is divided."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many phantoms, which."""
    parser.add_argument("--cases", type=int, default=10, help="phantoms (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the first (default: %(default)s)")
    parser.add_argument("--folds", type=int, default=4, help="over places (default: %(default)s)")
    parser.add_argument("--places", type=int, help="a phantom (default: 70 to 120, as drawn)")
    parser.add_argument(
        "--dense", type=int, default=2, help="phantoms sampled with 10 and 100 rows too (default: 2)"
    )


def held_out(made: RobotTissue, rows: int | None, seed: int, folds: int) -> dict[str, float]:
    """rms error, N, of every model over presses that it has not seen; "noise": the vector noise; "fields":
    folds that asked for a field."""
    recording = made.sampled(rows, seed)
    model = _slab(made)
    prepared = prepare(presses_on(recording, model), model)
    presses = prepared.presses
    fold = np.random.default_rng(seed).permutation(np.arange(len(presses)) % folds)
    missed = {name: np.zeros(len(presses.press)) for name in MODELS}
    fields = 0
    for k in range(folds):
        held = np.flatnonzero(fold == k)
        found, fem = predicted(prepared, np.flatnonzero(fold != k), held, "rbf", "read")
        fields += fem.field is not None
        at = presses.rows(held)
        for name in MODELS:
            missed[name][at] = ((found[name] - presses.force[at]) ** 2).sum(axis=1)
    errors = {name: float(np.sqrt(squares.mean())) for name, squares in missed.items()}
    return {**errors, "noise": made.noise_n * 3**0.5, "fields": fields, "force": rms(presses.force)}


def _slab(made: RobotTissue) -> Model:
    """What a robot's owner knows: a slab of that thickness under the places."""
    low, high = made.centre[:, :2].min(axis=0), made.centre[:, :2].max(axis=0)
    size = np.append(high - low + 2 * _MARGIN_M, made.height_m)
    x, y, z = (max(3, round(length / _EDGE_M)) for length in size)
    box = box_mesh((x, y, z), tuple(size))
    middle = np.append((low + high) / 2, 0.0)
    mesh = TetMesh(box.points + middle, box.tetrahedra, box.fixed, box.touchable).quadratic()
    up = np.array([0.0, 0.0, 1.0])
    return Model(
        mesh,
        ObjectMaterial(made.modulus_pa, 0.49),
        Support(np.zeros(3), up),
        Tool(made.tip_radius_m),
        _EDGE_M,
    )


def _gap(found: dict[str, float], name: str) -> float:
    """Of a model: error squared less noise squared, N^2."""
    return max(found[name] ** 2 - found["noise"] ** 2, 1e-12)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure, print a row a phantom, return the figures."""
    cases: list[dict[str, Any]] = []
    dense: dict[str, list[float]] = {what: [] for what in _QUIETER}
    progress = progress_bar("phantoms")
    for k in range(arguments.cases):
        seed = arguments.seed + k
        made = robot_tissue(seed, places=arguments.places)
        found = held_out(made, None, seed, arguments.folds)
        best = min(RIVALS, key=lambda name: found[name])
        ratio = _gap(found, "fem") / _gap(found, best)
        cases.append({"seed": seed, **made.about, **found, "best_1d": best, "ratio": ratio})
        words = ", ".join(f"{name} {1e3 * found[name]:.1f}" for name in MODELS)
        print(f"phantom {seed}: {words} mN, noise {1e3 * found['noise']:.1f}; ratio {ratio:.2f}", flush=True)
        if k < arguments.dense:
            hundred = held_out(made, 100, seed, arguments.folds)
            for what, quieter in _QUIETER.items():
                ten = held_out(replace(made, noise_n=made.noise_n / quieter), 10, seed, arguments.folds)
                dense[what].append(np.sqrt(_gap(ten, "fem") / _gap(hundred, "fem")))
                print(f"phantom {seed}: ten rows over a hundred, {what}: {dense[what][-1]:.3f}", flush=True)
        progress("phantoms", (k + 1) / arguments.cases)
    progress.close()
    header = ["phantom", "places", "FEM with a field", "best 1D", "one modulus", "noise", "ratio"]
    names = ("fem", "best", HOMOGENEOUS, "noise")
    rows = [
        [c["seed"], int(c["places"]), *(f"{1e3 * {**c, 'best': c[c['best_1d']]}[n]:.1f} mN" for n in names),
         f"{c['ratio']:.2f}"]
        for c in cases
    ]  # fmt: skip
    print(table(header, rows))
    return {"cases": cases, "dense": dense, "figures": _figures(cases, dense)}


def _figures(cases: list[dict[str, Any]], dense: dict[str, list[float]]) -> list[Figure]:
    ratios = np.array([c["ratio"] for c in cases])
    won = int((ratios <= BETTER).sum())
    what = "gap squared less noise squared, FEM with a field over the better 1D model"
    figures = [
        Figure(f"{what}, median of {len(ratios)} phantoms", float(np.median(ratios)), _ends(ratios)),
        Figure(f"phantoms of {len(ratios)} where that is at most {BETTER:g}", won).at_least(
            0.9 * len(ratios)
        ),
    ]
    for noise, found in dense.items():
        if found:
            what = f"gap with ten rows a place over that with a hundred, {noise}, median of {len(found)}"
            figure = Figure(what, float(np.median(found)), _ends(np.array(found)))
            figures.append(figure.at_most(ALIKE) if _QUIETER[noise] > 1 else figure)
    return figures


def _ends(values: np.ndarray) -> tuple[float, float]:
    return float(values.min()), float(values.max())
