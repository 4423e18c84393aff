"""What an object costs by the size of its elements: a liver's surface of 160 x 110 x 80 mm, drawn here.

Each part runs in a process of its own on one thread: processor time, user and system together, and the
greatest resident memory. model: `palpate model`, most of it meshing. first and later press: `palpate press`
at one place, 6 mm deep, of a MODEL of which nothing is kept yet, and again. factorise: the fine mesh.
condense: the whole surface, from nothing. surface: the kept contact surface read back. The product itself
takes a size that is too dear coarser; what was taken stands in the table.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from benchmarks.evidence import Figure
from benchmarks.timing import table
from benchmarks.waiting import ONE_THREAD
from palpate.child import module_command
from palpate.mechanics.compliance.fine_corners import fine_corners
from palpate.mechanics.compliance.stored_compliance import load_or_condense
from palpate.mechanics.model.files import read_model
from palpate.parallel.tasks import high_water_bytes
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.render.press import Stroke, press
from palpate.render.surface.snapping import touched_surface

SIZES_MM = (12.0, 10.0, 8.0)
PRESS_CPU_S, CONDENSE_CPU_S = {10.0: 8.0, 6.0: 25.0}, {10.0: 30.0, 6.0: 120.0, 4.0: 400.0}
MEMORY_GB, SURFACE_CPU_S = 2.0, 1.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Sizes, and whether to condense."""
    parser.add_argument(
        "--sizes", type=float, nargs="+", default=list(SIZES_MM), help="edges of the tetrahedra, mm"
    )
    parser.add_argument("--no-condense", action="store_true", help="leave out the whole surface")


def liver() -> trimesh.Trimesh:
    """81,920 triangles, mm, closed, cut flat below."""
    ball = trimesh.creation.icosphere(subdivisions=6, radius=1.0)
    x, y, z = ball.vertices.T
    lumps = 1 + 0.12 * np.sin(2.5 * x + 0.7) * np.cos(2 * y) + 0.08 * np.sin(3 * z + 1.5 * x)
    at = ball.vertices * lumps[:, None] * [80, 55, 45]
    at[:, 1] += 0.15 * at[:, 0] * np.sin(at[:, 0] / 60)
    at[:, 2] = np.maximum(at[:, 2], -28)
    return trimesh.Trimesh(at, ball.faces, process=False)


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure; print a row a size as it comes; return rows and figures."""
    rows: list[dict[str, float]] = []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "liver.stl"
        liver().export(file)
        for size in arguments.sizes:
            rows.append(_one_size(file, size, not arguments.no_condense))
            print(table([name.replace("_", " ") for name in rows[-1]], [list(rows[-1].values())]), flush=True)
    figures = [figure for row in rows for figure in _figures(row)]
    result: dict[str, Any] = {"sizes": rows, "figures": figures}
    if len(rows) > 1 and not arguments.no_condense:
        nodes, spent = (np.log([row[name] for row in rows]) for name in ("places", "condense_cpu_s"))
        result["exponent"] = float(np.polyfit(nodes, spent, 1)[0])
        figures.append(Figure("exponent of condensing over the places of the surface", result["exponent"]))
        print(f"condensing grows with the places to the power of {result['exponent']:.2f}")
    return result


def _one_size(file: Path, size_mm: float, whole: bool) -> dict[str, float]:
    model = file.parent / f"{size_mm:g}mm"
    words = ("model", file, "--unit", "mm", "--mesh-size", 1e-3 * size_mm, "-o", model)
    row: dict[str, float] = {"asked_mm": size_mm} | _command("model", *words)
    pressed = ("press", model, "--depth", 0.006, "--json", file.parent / "press.json")
    _command("warm", *pressed)  # compiles what is not compiled yet
    _forget(model)
    row |= _command("first_press", *pressed) | _command("later_press", *pressed)
    row |= _apart(_surface, model) | _apart(_factorise, model)
    _forget(model)
    if whole:
        row |= _apart(_condense, model)
    shutil.rmtree(model)
    return row


def _forget(model: Path) -> None:
    """What is kept beside the model; its own files stay."""
    for pattern in ("places-*.bin", "contact-*.bin", "curvature-*.bin", "compliance-*.bin"):
        for path in model.glob(pattern):
            path.unlink()


def _command(name: str, *words: Any) -> dict[str, float]:
    """CPU s and peak GB of a command and its children."""
    command = module_command("palpate", *map(str, words))
    environment = dict(os.environ, **ONE_THREAD)
    quiet = subprocess.DEVNULL
    child = subprocess.Popen(command, env=environment, stdout=quiet, stderr=quiet)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode not in (0, 1):
        raise subprocess.CalledProcessError(child.returncode, command)
    return {f"{name}_cpu_s": usage.ru_utime + usage.ru_stime, f"{name}_gb": 1024e-9 * usage.ru_maxrss}


def _apart(work: Callable[[Path], dict[str, float]], model: Path) -> dict[str, float]:
    """What `work` tells of a model, in a fresh process on one thread."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            return pool.apply(work, (model,))
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})


def _surface(folder: Path) -> dict[str, float]:
    model = read_model(folder)
    began = time.process_time()
    touched_surface(model, RenderOptions())
    return {"surface_cpu_s": time.process_time() - began}


def _factorise(folder: Path) -> dict[str, float]:
    model = read_model(folder)
    began = time.process_time()
    fine = fine_corners(model.mesh, model.material.poisson_ratio)
    return {
        "taken_mm": 1e3 * float(model.mesh_size_m or np.nan),
        "nodes": len(model.mesh.points),
        "fine_nodes": len(fine.solver.mesh.points),
        "places": len(fine.points),
        "factorise_cpu_s": time.process_time() - began,
    }


def _condense(folder: Path) -> dict[str, float]:
    model = read_model(folder)
    began = time.process_time()
    compliance = load_or_condense(model)
    row = {"condense_cpu_s": time.process_time() - began, "condense_gb": 1e-9 * high_water_bytes()}
    renderer = FemRenderer(model, compliance=compliance)
    top = model.mesh.points.mean(axis=0)
    for _ in range(2):  # the first one compiles
        began = time.process_time()
        pressed = press(renderer, top, -model.support.normal, Stroke(0.006, 0.01))
        row["tick_us"] = 1e6 * (time.process_time() - began) / len(pressed.force)
    return row


def _figures(row: dict[str, float]) -> list[Figure]:
    asked = row["asked_mm"]
    of = f"{asked:g} mm asked, {row['taken_mm']:.3g} mm taken, {row['nodes']:.0f} nodes"
    limits = {
        "first_press_cpu_s": PRESS_CPU_S.get(asked),
        "condense_cpu_s": CONDENSE_CPU_S.get(asked),
        "surface_cpu_s": SURFACE_CPU_S,
        "model_gb": MEMORY_GB,
        "condense_gb": MEMORY_GB,
    }
    found = []
    for name in row.keys() - {"asked_mm", "taken_mm", "nodes", "warm_cpu_s", "warm_gb"}:
        what, unit = name, "1"
        for ending, its_unit in (("_cpu_s", "s"), ("_gb", "GB"), ("_us", "us")):
            if name.endswith(ending):
                what, unit = name.removesuffix(ending), its_unit
        figure = Figure(f"{what.replace('_', ' ')}, {of}", row[name], unit=unit)
        limit = limits.get(name)
        found.append(figure if limit is None else figure.at_most(limit))
    return sorted(found, key=lambda figure: figure.what)
