"""Instruments told from laboratory recordings on something known, their faults drawn at random.

Each case is an exploration of a phantom of known modulus with a common gain and cross-talk, a bending tool,
a delay and a bias, all drawn; or, with --plates, presses on a rigid plate by a tool that bends, has play and
reads late. Told: error and whether the 95 % interval holds the truth.
"""

from __future__ import annotations

import argparse
import dataclasses
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.evidence import rates
from benchmarks.timing import table
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import delayed

TIP_M, RATE_HZ, NOISE_N = 0.004, 500.0, 0.005
STIFF = "stiffness_n_per_m"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many, on what."""
    parser.add_argument("--count", type=int, default=3, help="laboratory recordings (default: 3)")
    parser.add_argument("--plates", type=int, default=20, help="rigid plates (default: 20)")
    parser.add_argument("--phantom", default="block", help="of the laboratory (default: block)")
    parser.add_argument("--seed", type=int, default=0, help="of the first case")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Both kinds of case, a row a parameter."""
    rows: list[dict[str, Any]] = []
    for k in range(arguments.plates):
        rows += _plate(arguments.seed + k)
    for k in range(arguments.count):
        rows += _phantom(arguments.seed + k, arguments.phantom)
    found: dict[str, Any] = {}
    for name in dict.fromkeys(row["name"] for row in rows):
        own = [row for row in rows if row["name"] == name]
        told = [row for row in own if row["found"] is not None]
        covered = [row["covered"] for row in told if row["covered"] is not None]
        widths = [row["width"] for row in told if row["width"] is not None]
        found[name] = {
            "cases": len(own),
            "told": len(told),
            "median_error": float(np.median([row["error"] for row in told])) if told else None,
            "median_width": float(np.median(widths)) if widths else None,
            "covered": sum(covered),
            "of": len(covered),
        }
    head = ["parameter", "cases", "told", "median error", "interval's width", "interval covers"]
    cells = []
    for name, f in found.items():
        error, width = ("" if f[key] is None else f[key] for key in ("median_error", "median_width"))
        cells.append([name, f["cases"], f["told"], error, width, f"{f['covered']} of {f['of']}"])
    print(table(head, cells))
    covered95 = {f"{name}: interval holds the truth": (f["covered"], f["of"]) for name, f in found.items()}
    return {"rows": rows, "parameters": found, "figures": rates(covered95)}


def _judged(name: str, true: float, value: float | None, interval: Any, unit: float) -> dict[str, Any]:
    """unit: what the error is over; the truth where it is a share."""
    covered = width = None
    if interval is not None and value is not None:
        covered = bool(min(interval) <= true <= max(interval))
        width = float(max(interval) - min(interval)) / unit
    error = None if value is None else abs(value - true) / unit
    return {
        "name": name, "true": true, "found": value, "error": error, "covered": covered, "width": width,
    }  # fmt: skip


def _plate(seed: int) -> list[dict[str, Any]]:
    """One rigid plate. Errors: stiffness over its own, play in m, delay in s."""
    rng = np.random.default_rng([21, seed])
    stiffness, play = float(np.exp(rng.uniform(np.log(500), np.log(8000)))), float(rng.uniform(0, 3e-4))
    late = float(rng.uniform(-0.01, 0.025))
    recording = plate(stiffness, play, late, rng)
    made = pp.calibrate(recording, rigid=True, progress=False)
    between = made.interval
    return [
        _judged("plate: stiffness, share", stiffness, made.stiffness_n_per_m, between.get(STIFF), stiffness),
        _judged("plate: play, m", play, made.play_m, between.get("play_m"), 1.0),
        _judged("plate: delay, s", late, made.delay_s, between.get("delay_s"), 1.0),
    ]  # fmt: skip


def plate(stiffness: float, play: float, late: float, rng: np.random.Generator) -> Recording:
    """Presses at nine places of a rigid plate z = 0: the tip stays on it, and the handle goes on by force
    over stiffness."""
    paths, places = [], 0.01 * np.array([[x, y] for x in range(3) for y in range(3)])
    for place in places:
        lasts = rng.uniform(0.8, 2.5)
        t = np.arange(0, lasts, 1 / RATE_HZ)
        far = min(4.0 / stiffness * rng.uniform(0.5, 1.5), 0.006)
        deep = (far + 0.0015) * np.sin(np.pi * t / lasts) ** 2 - 0.0015
        paths.append(np.column_stack([np.tile(place, (len(t), 1)), deep]))
    path = np.concatenate(paths)
    deep, count = path[:, 2], len(path)
    tip = np.empty(count)
    tip[0] = deep[0]
    for i in range(1, count):
        tip[i] = min(max(tip[i - 1], deep[i] - play / 2), deep[i] + play / 2)
    force = np.zeros((count, 3))
    force[:, 2] = stiffness * np.maximum(tip, 0)
    t = np.arange(count) / RATE_HZ
    read = delayed([slice(None)], t, force, late) + NOISE_N * rng.standard_normal(force.shape)
    return Recording(
        t=t, position=np.column_stack([path[:, :2], TIP_M - deep]), force_on_tool=read,
        sample_rate_hz=RATE_HZ, tip_radius_m=TIP_M, force_noise_std_n=NOISE_N, object_name="plate",
    )  # fmt: skip


def _phantom(seed: int, name: str) -> list[dict[str, Any]]:
    """One exploration of the laboratory, its instrument spoilt afterwards, as an instrument does."""
    rng = np.random.default_rng([22, seed])
    made = pp.simulate(name, seed=seed, sizes=False, progress=False)
    clean = made.recording
    stiffness = float(np.exp(rng.uniform(np.log(600), np.log(4000))))
    gain, talk = float(rng.uniform(0.85, 1.15)), 0.03 * rng.standard_normal((3, 3))
    np.fill_diagonal(talk, 0.0)
    matrix = gain * (np.eye(3) + talk)
    late, bias = float(rng.uniform(0, 0.03)), rng.uniform(-0.1, 0.1, 3)
    read = delayed([slice(None)], clean.t, clean.force_on_tool @ matrix.T + bias, late)
    spoilt = dataclasses.replace(
        clean,
        position=clean.position - clean.force_on_tool / stiffness,
        force_on_tool=read,
        path=None,
        sha256="",
    )
    found = pp.calibrate(
        spoilt, modulus_pa=float((clean.truth or {})["young_modulus_pa"]), seed=seed, progress=False
    )
    between, told = found.interval, found.stiffness_n_per_m
    common = float(np.trace(found.matrix)) / 3 if found.matrix is not None else None
    off = None if found.matrix is None else float(np.abs(found.matrix - matrix).max())
    return [
        _judged("object: common gain, share", gain, common, between.get("common_gain"), gain),
        _judged("object: worst of the matrix", 0.0, off, None, 1.0),
        _judged("object: stiffness, share", stiffness, told, between.get(STIFF), stiffness),
        _judged("object: delay, s", late, found.delay_s, between.get("delay_s"), 1.0),
        _judged("object: bias, N", 0.0, _off(found.bias_n, bias), None, 1.0),
    ]  # fmt: skip


def _off(found: np.ndarray | None, true: np.ndarray) -> float | None:
    return None if found is None else float(np.abs(found - true).max())
