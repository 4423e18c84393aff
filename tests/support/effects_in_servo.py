"""Improved models through the real servo process: what a tick costs, and whether the effect is felt.

A scene's model with each effect at the contract's strength 1, written, read back and run through the servo
along a scripted path, beside the plain model in the same run.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import table
from palpate.devices.registry import DeviceChoice
from palpate.diagnosis.apply import with_effects
from palpate.mechanics.compliance.stored_compliance import load_or_condense
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import write_recording
from palpate.servo.client import Servo

from .effects_felt import Case, cases, felt_on, path_of

BUDGET_US = 1000.0
POLL_S = 0.5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which effects, on what."""
    parser.add_argument("--effects", nargs="*", default=[], help="(default: all)")
    parser.add_argument("--scene", default="silicone-1", help="whose model is improved (default: silicone-1)")
    parser.add_argument("--work", metavar="FOLDER", help="keeps models (default: a temporary folder)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure, print, return."""
    from palpate.scenes.build import model_of
    from palpate.scenes.scene import load_scene

    with tempfile.TemporaryDirectory() as temporary:
        work = Path(arguments.work or temporary)
        work.mkdir(parents=True, exist_ok=True)
        rows = run_all(model_of(load_scene(arguments.scene)), work, arguments.effects)
    show(rows)
    return {"servo": rows}


def run_all(model: Model, work: Path, only: list[str]) -> list[dict[str, Any]]:
    """The plain model and every case, one after the other; a row each. work: where models are kept."""
    plain = model.with_material(dent_law="linear").replaced(effects={}, path=None)
    path = write_recording(work / "path.csv.gz", path_of(plain))
    base = _one("plain", plain, path, work)
    rows = [base]
    for case in cases(plain):
        if only and case.name not in only:
            continue
        row = _one(case.name, with_effects(plain, case.effects), path, work)
        row |= _judged(case, row["felt"], base["felt"])
        row["ratio"] = row["median_us"] / base["median_us"]
        rows.append(row)
        print(f"{case.name}: {row['felt_as']} {row['value']:.3g} ({'right' if row['right'] else 'WRONG'}), "
              f"{row['median_us']:.1f} us", flush=True)  # fmt: skip
    return rows


def _judged(case: Case, own: dict[str, float], plain: dict[str, float]) -> dict[str, Any]:
    value = case.felt(own, plain)
    return {"felt_as": case.sense, "value": value, "right": bool(case.right(value))}


def _one(name: str, model: Model, path: Path, work: Path) -> dict[str, Any]:
    """Write, read back, condense where that is new, and run through the servo along the path."""
    folder = work / name.replace(", ", "+")
    if not (folder / "model.toml").exists():
        write_model(folder, model)
        for kept in work.glob("*/compliance-*.bin"):  # named by content: one that does not fit is not read
            if not (folder / kept.name).exists():
                shutil.copy(kept, folder)
    again = read_model(folder)
    clock, cpu = time.perf_counter(), time.process_time()
    load_or_condense(again)
    row: dict[str, Any] = {
        "effect": name,
        "condense_s": time.perf_counter() - clock,
        "condense_cpu_s": time.process_time() - cpu,
    }
    seconds = path_of(model).t[-1] + 0.5
    with Servo(folder, device=DeviceChoice("replay", {"recording": str(path)})) as servo:
        servo.start()
        servo.enable()
        start = time.perf_counter()
        rows, following = [], 0  # from the first tick: the recording plays since the device was opened
        while time.perf_counter() - start < seconds:
            time.sleep(POLL_S)
            some, following = servo.history(following)
            rows.append(some)
        report = servo.report()
    ticks = np.concatenate(rows)
    # the time that a row holds is of the tick before
    touched = np.flatnonzero(ticks["touching"][:-1] > 0) + 1
    cost = 1e6 * ticks["compute_s"][touched]
    return row | {
        "ticks": report.ticks,
        "touching_ticks": len(touched),
        "missed": report.missed_ticks,
        "median_us": float(np.median(cost)),
        "p99_us": float(np.quantile(cost, 0.99)),
        "max_us": float(cost.max()),
        "felt": felt_on(model, ticks["tip"], ticks["rendered"]),
    }


def show(rows: list[dict[str, Any]]) -> None:
    """The table."""
    header = ["effect", "what is felt", "value", "as it must be", "us a tick, median", "99 %", "greatest"]
    header += ["share of 1 ms (99 %)", "over the plain (median)", "condensing, CPU s"]
    shown = [
        [
            row["effect"],
            row.get("felt_as", "-"),
            row.get("value", "-"),
            ("yes" if row["right"] else "NO") if "right" in row else "-",
            row["median_us"],
            row["p99_us"],
            row["max_us"],
            f"{row['p99_us'] / BUDGET_US:.1%}",
            row.get("ratio", 1.0),
            row["condense_cpu_s"],
        ]
        for row in rows
    ]
    print(table(header, shown))
