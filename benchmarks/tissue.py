"""Tissue as robots probe it: the finite-element model with a field against the better 1D model, held out.

Phantoms of the virtual laboratory (`robot_tissue`: a random field of the modulus, in half of all
cases layers, a surface that wanders by 1 to 3 mm) are pressed at 70 to 120 places up to some 1 N, 5 to 12
rows a place, without a time. They come in as anybody's quasi-static points on a slab of stated thickness.
Held out are folds over places. The gap is the rms error of the force beyond the sensor's noise: what counts
is gap squared less noise squared, of the model over that of the better 1D model; aim: at most 0.9 in 9 of 10.
With --dense, some phantoms are sampled again with 10 and with 100 rows a place: aim: as good to 5 % where
both tell as much, the noise of the ten divided by the root of ten; what the same noise costs is said beside.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.diagnosis.compare.models import HOMOGENEOUS, MODELS, RIVALS, predicted, prepare
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.output import progress_bar
from palpate.reconstruction.presses_on_model import presses_on
from palpate.render.replay import rms_n
from palpate.scenes.laboratory.curves import PathJob, SolvedPath, Solving, curves
from palpate.scenes.laboratory.effects import EffectContext, effect
from palpate.scenes.laboratory.specimen import Fineness, Specimen
from palpate.scenes.laboratory.surface import TriangleSurface
from palpate.scenes.phantoms import Phantom, column, rectangle, stacked

CHEAP = Fineness(finest=3.0, reach=5.0, growth=1.2)
"""Half a second a place."""
PEAK_N, RATE_HZ = 1.0, 100.0
_STATES = 15
_WALL_M = 0.015


@dataclass(frozen=True)
class RobotTissue:
    """A phantom that is solved, to be sampled as often as one likes. centre: (p, 3) m, of the tip at first
    touch; curves: one a place, for unit modulus; modulus_pa: of the matrix; about: what was drawn."""

    centre: np.ndarray
    curves: tuple[SolvedPath, ...]
    modulus_pa: float
    height_m: float
    tip_radius_m: float
    noise_n: float
    about: dict[str, float]

    def sampled(self, rows: int | None, seed: int) -> Recording:
        """Each place's rows from about first touch to some 1 N. rows: a place; None: 5 to 12, as drawn."""
        rng = np.random.default_rng([71, seed])
        position, force = [], []
        for centre, curve in zip(self.centre, self.curves, strict=True):
            deep = -1e-3 * curve.travel[:, 2]
            push = 1e-6 * self.modulus_pa * curve.force
            top = rng.uniform(0.8, 1.2) * PEAK_N * (0.1 if rng.uniform() < 0.02 else 1.0)
            last = float(np.interp(min(top, push[-1, 2]), push[:, 2], deep))
            first = rng.uniform(-0.1, 0.25) * last
            count = int(rng.integers(5, 13))
            into = np.linspace(first, last, rows or count)
            read = PchipInterpolator(deep, push)(np.maximum(into, 0.0))
            position.append(centre - into[:, None] * [0.0, 0.0, 1.0])
            force.append(read + rng.normal(0, self.noise_n, read.shape))
        samples = np.concatenate(position)
        return Recording(
            t=np.arange(len(samples)) / RATE_HZ,
            position=samples,
            force_on_tool=np.concatenate(force),
            sample_rate_hz=RATE_HZ,
            tip_radius_m=self.tip_radius_m,
            object_name="robot-tissue",
            poisson_ratio=0.49,
            description={"recording": {"quasi_static": True}, "object": {"slab_m": self.height_m}},
        )


def robot_tissue(seed: int, *, places: int | None = None, solving: Solving | None = None) -> RobotTissue:
    """The phantom of a seed. places: about how many; None: 70 to 120, as drawn."""
    rng = np.random.default_rng([37, seed])
    spacing, height = rng.uniform(0.006, 0.009), rng.uniform(0.018, 0.035)
    tip = float(rng.choice([0.004, 0.005, 0.006]))
    count = places or int(rng.integers(70, 121))
    along = max(2, round(np.sqrt(count * rng.uniform(0.7, 1.4))))
    across = max(2, round(count / along))
    phantom = _phantom(rng, np.array([along - 1, across - 1]) * spacing + 2 * _WALL_M, height)
    strength = rng.uniform(0.6, 1.4)
    varies = effect("stiffness_field")
    keys = varies.parameters(strength, EffectContext(phantom, phantom.young_modulus_pa, tip, (), rng))
    assert varies.in_solid is not None
    specimen = varies.in_solid(Specimen(tip_radius=1e3 * tip), keys)
    points, normals = _touched(phantom, rng, along, across, spacing)
    deepest = 1e3 * min(0.3 * height, 1.2 * tip)
    travel = -deepest * np.linspace(0, 1, _STATES)[:, None] ** 1.3 * [0.0, 0.0, 1.0]
    jobs = [PathJob(point, normal, travel) for point, normal in zip(points, normals, strict=True)]
    chosen = replace(solving or Solving(workers=1, label="laboratory"), fineness=CHEAP)
    solved = tuple(curves(phantom, specimen, jobs, chosen))
    # the middle place reaches 1 N at a depth that is drawn
    there = rng.uniform(0.4, 0.75) * deepest
    unit = [1e-6 * np.interp(there, -c.travel[:, 2], c.force[:, 2]) for c in solved]
    modulus, noise = PEAK_N / float(np.median(unit)), rng.uniform(0.004, 0.012)
    wander = float(np.ptp(points[:, 2]))
    about = {
        "places": len(points), "spacing_m": spacing, "height_m": height, "tip_m": tip, "noise_n": noise,
        "log_sd": keys["log_sd"], "length_m": keys["length_m"], "layers": len(keys["layers"]),
        "wander_m": 1e-3 * wander, "modulus_pa": modulus,
    }  # fmt: skip
    centre = 1e-3 * (points + 1e3 * tip * normals)
    mean = float(1e-3 * points[:, 2].mean())
    return RobotTissue(
        centre, solved, modulus, mean, tip, float(noise), {k: float(v) for k, v in about.items()}
    )


def _phantom(rng: np.random.Generator, size: np.ndarray, height: float) -> Phantom:
    """A slab whose top wanders by 1 to 3 mm from its lowest to its highest place."""
    waves = rng.normal(0, 1 / 0.035, (6, 2))
    phases = rng.uniform(0, 2 * np.pi, 6)
    half = size / 2
    grid = np.stack(np.meshgrid(*(np.linspace(-h, h, 60) for h in half)), -1)

    def raw(xy: np.ndarray) -> np.ndarray:
        return np.cos(xy @ waves.T + phases).sum(axis=-1)

    low, high = float(raw(grid).min()), float(raw(grid).max())
    wander = rng.uniform(0.001, 0.003)

    def top(xy: np.ndarray, z: np.ndarray) -> np.ndarray:
        return z * (1 + wander * ((raw(xy) - low) / (high - low) - 0.5) / height)

    profile = column(float(half.max()), height)
    vertices, faces = stacked(rectangle(*size), profile, top)
    return Phantom("robot-tissue", "slab with a wandering top", vertices, faces, 10e3)


def _touched(
    phantom: Phantom, rng: np.random.Generator, along: int, across: int, spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    """(points (p, 3) mm on the top, outward normals (p, 3)), row by row."""
    x, y = ((np.arange(n) - (n - 1) / 2) * spacing for n in (along, across))
    flat = np.array([[a, b] for a in x for b in y]) + rng.normal(0, 0.0003, (along * across, 2))
    above = 1e3 * np.column_stack([flat, np.full(len(flat), phantom.height_m)])
    surface = TriangleSurface(phantom.vertices * 1e3, phantom.faces)
    points = surface.nearest(above)[0].round(3)
    return points, surface.normals(points)


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
    return {**errors, "noise": made.noise_n * 3**0.5, "fields": fields, "force": rms_n(presses.force)}


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
