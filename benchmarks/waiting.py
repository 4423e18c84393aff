"""How long one waits for the long answers: processor time of `compare`, `diagnose` and `material`.

`compare` and `diagnose` are of tissue on a slab whose modulus differs from place to place, probed by a robot
at 110 places with 10 rows each; `material` is of nine curves of 5,000 rows. Each is a process of its own on
one thread, user and system time together. A first, small call of `material` fills the caches of compiled
kernels. With every repeat comes another slab and other curves, so the spread is that of cases. Beside the
waits stands what the comparison found, so that no time is won by a worse answer.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._tissue import NU, tissue
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.child import module_command
from palpate.diagnosis.compare.models import RIVALS
from palpate.mechanics.disk.toml_text import dump_toml
from palpate.mechanics.recording.recording import Recording, description_table
from palpate.output import progress_bar

PLACES, ROWS = 110, 10
CURVES, CURVE_ROWS, CURVE_TIP_M = 9, 5000, 1e-3


def robot_probing(folder: Path, seed: int, places: int = PLACES, rows: int = ROWS) -> Path:
    """The recording of points without a time over a slab of known thickness, written to a folder: each place
    pressed once, in `rows` rows from just above the surface to the deepest."""
    slab = tissue(seed, raster=int(np.ceil(np.sqrt(places))))
    presses = slab.presses
    each = int(np.diff(presses.starts)[0])
    chosen = np.linspace(1, each // 2 - 1, rows).round().astype(int)
    at = (presses.starts[:places, None] + chosen).ravel()
    recording = Recording(
        t=np.arange(len(at)) / 100.0,
        position=presses.position[at],
        force_on_tool=presses.force[at],
        sample_rate_hz=100.0,
        tip_radius_m=presses.tip_radius_m,
        force_noise_std_n=slab.about["noise_n"],
        object_name="slab",
        poisson_ratio=NU,
    )
    path = recording.save(folder / "robot.csv")
    told = description_table(recording)
    told["recording"]["quasi_static"] = True
    told["object"]["slab_m"] = slab.about["height_m"]
    path.with_suffix(".toml").write_text(dump_toml(told), encoding="utf-8")
    return path


def machine_curves(folder: Path, seed: int, curves: int = CURVES, rows: int = CURVE_ROWS) -> list[Path]:
    """Tables of a sphere's indentations at one place: in, held, out, in 5 s each; a solid that relaxes."""
    random, files = np.random.default_rng(seed), []
    radius, modulus, share, tau = CURVE_TIP_M, 30e3, 0.3, 0.5
    for k in range(curves):
        t = np.linspace(0.0, 5.0, rows)
        deepest = random.uniform(1.6e-4, 2.4e-4)
        depth = np.interp(t, [0.0, 0.5, 1.5, 3.5, 4.5, 5.0], [-2e-5, -2e-5, deepest, deepest, -2e-5, -2e-5])
        spring = 4 / 3 * modulus / (1 - NU**2) * np.sqrt(radius) * np.maximum(depth, 0.0) ** 1.5
        memory, keeps = np.zeros(rows), np.exp(-(t[1] - t[0]) / tau)
        for i in range(1, rows):
            memory[i] = keeps * memory[i - 1] + share * (spring[i] - spring[i - 1])
        force = (1 - share) * spring + memory + 2e-5 * random.standard_normal(rows)
        path = folder / f"curve_{k + 1}.csv"
        table = np.column_stack([t, 1e6 * depth, 1e3 * force])
        np.savetxt(path, table, "%.6g", ",", header="Time (s),Indentation (um),Load (mN)", comments="")
        files.append(path)
    return files


LIMITS_S = {"compare": 60.0, "diagnose": 120.0, "material": 20.0}
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Repeats, places, and which."""
    parser.add_argument("--repeats", type=int, default=1, help="cases of each kind (default: 1)")
    parser.add_argument("--seed", type=int, default=3, help="of the first case (default: 3)")
    parser.add_argument("--places", type=int, default=PLACES, help=f"pressed on a slab (default: {PLACES})")
    parser.add_argument(
        "--only", choices=sorted(LIMITS_S), action="append", help="these alone (repeatable; default: all)"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure; print a row a command; return the figures."""
    wanted = arguments.only or list(LIMITS_S)
    seconds: dict[str, list[float]] = {name: [] for name in wanted}
    ratios: list[float] = []
    with tempfile.TemporaryDirectory() as place, progress_bar("waiting") as tell:
        for k in range(arguments.repeats):
            folder = Path(place) / str(k)
            folder.mkdir()

            def say(words: str, part: float, k: int = k) -> None:
                tell(words, (k + part) / arguments.repeats)

            if "material" in wanted:
                say("material", 0.0)
                seconds["material"].append(_material(folder, arguments.seed + k))
            if {"compare", "diagnose"} & set(wanted):
                say("the slab's model", 0.1)
                recording = robot_probing(folder, arguments.seed + k, arguments.places)
                _spent("reconstruct", recording, "-o", folder / "model")
                for name, begun in (("compare", 0.2), ("diagnose", 0.5)):
                    if name in wanted:
                        say(name, begun)
                        answer = folder / f"{name}.json"
                        # what one call keeps beside a model spares the next one work
                        model = shutil.copytree(folder / "model", folder / f"{name}-model")
                        words = ("--model", model, "--json", answer)
                        seconds[name].append(_spent(name, recording, *words))
                if "compare" in wanted:
                    rms = json.loads((folder / "compare.json").read_text())["rmse_n"]
                    ratios.append(rms["fem"] / min(rms[name] for name in RIVALS))
    figures = [_figure(name, each, arguments.places) for name, each in seconds.items()]
    if ratios:
        what = "compare: held-out error of FEM with a field over the best 1D model's"
        figures.append(Figure(what, float(np.median(ratios)), (min(ratios), max(ratios))).at_most(1.0))
    rows = [[f.what, f.value, *(f.spread or ()), f.target, f.met] for f in figures]
    print(table(["what", "median", "least", "most", "target", "met"], rows))
    return {"figures": figures}


def _figure(name: str, seconds: list[float], places: int) -> Figure:
    of = f"{CURVES} curves of {CURVE_ROWS} rows" if name == "material" else f"{places} presses on a slab"
    what = f"{name}, {of}, CPU"
    return Figure(what, float(np.median(seconds)), (min(seconds), max(seconds)), "s").at_most(LIMITS_S[name])


def _material(folder: Path, seed: int) -> float:
    """s, after a small call that compiles what is not compiled yet."""
    radius = ("--tip-radius", CURVE_TIP_M, "--json", folder / "material.json")
    small = folder / "small"
    small.mkdir()
    _spent("material", *machine_curves(small, seed, 6, 600), *radius)
    return _spent("material", *machine_curves(folder, seed), *radius)


def _spent(*words: Any) -> float:
    """s of user and system time of a command."""

    def used() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = used()
    environment = dict(os.environ, **ONE_THREAD)
    command = module_command("palpate", *map(str, words))
    subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    return used() - before
