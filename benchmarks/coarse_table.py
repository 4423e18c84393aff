"""The table by which a touch begins, against the whole one: processor time, and force at drawn places.

A lumpy organ of 160 x 110 x 80 mm without a flat foot, sunk by 3 mm. first: until the loop could begin, by
the mesh's own elements where that is faster; halved: until there are as many places by halved ones; whole:
until all are solved. The stated error is that of the window, at 95 % of places.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._zoo_shapes import organ
from palpate.mechanics.compliance.coarse_table import CoarseCompliance, first_places
from palpate.mechanics.compliance.on_demand import OnDemandCompliance
from palpate.mechanics.compliance.stored_compliance import load_or_condense, load_or_solve, own_places
from palpate.mechanics.model.model import Model
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import coarse_error
from palpate.render.options import RenderOptions
from palpate.render.press import Stroke, press
from palpate.scenes.build import model_of
from palpate.scenes.scene import Scene

SIZE_MM = np.array([160.0, 110.0, 80.0])
CLEAR_M = 0.012
"""Above the support, of the places that are pressed."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Element size and number of places."""
    parser.add_argument("--mesh-size", type=float, default=0.010, help="element edges, m (default: 0.010)")
    parser.add_argument("--places", type=int, default=30, help="places pressed (default: 30)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Processor seconds, and errors in newtons."""
    with tempfile.TemporaryDirectory() as folder:
        model = _model(Path(folder) / "organ.stl", arguments.mesh_size)
        began = time.process_time()
        tables = {}
        own = own_places(model)
        if own is not None:
            own.solve(first_places(own.own_points))
            tables["first"] = CoarseCompliance(own), time.process_time() - began
        solved = load_or_solve(model)
        assert isinstance(solved, OnDemandCompliance), "nobody touched it before"
        solved.solve(first_places(solved.own_points))
        tables["halved"] = CoarseCompliance(solved), time.process_time() - began
        whole = FemRenderer(model, compliance=load_or_condense(model))
        result = {
            "nodes": len(model.mesh.points),
            "places": len(solved.own_points),
            "whole_cpu_s": round(time.process_time() - began, 1),
        }
        for name, (coarse, cpu_s) in tables.items():
            stated_n, depth_m = coarse_error(model, coarse, RenderOptions())
            quick = FemRenderer(model, compliance=coarse)
            missed, felt = _pressed(quick, whole, depth_m, arguments.places)
            result |= {
                f"{name}_cpu_s": round(cpu_s, 1),
                f"{name}_stated_n": stated_n,
                f"{name}_rms_n": float(np.sqrt((missed**2).mean())),
                f"{name}_worst_n": float(missed.max()),
            }
        result |= {"depth_m": depth_m, "force_rms_n": float(np.sqrt((felt**2).mean())), "pressed": len(felt)}
    print("  ".join(f"{key} {value:.4g}" for key, value in result.items()))
    return result


def _model(path: Path, mesh_size_m: float) -> Model:
    mesh = organ()
    mesh.apply_scale(SIZE_MM / mesh.extents)
    mesh.export(path)
    scene = Scene("organ", "mesh", str(path), unit="mm", sink_m=3e-3, mesh_size_m=mesh_size_m)
    return model_of(scene, cache=path.parent)


def _pressed(
    quick: FemRenderer, whole: FemRenderer, depth_m: float, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """(what the first table's force is off by (k,), the whole one's (k,)), N, at the deepest of presses along
    the normal."""
    arrays, support = whole.contact.arrays, whole.model.support
    touchable = np.unique(arrays.triangles[arrays.free > 0])
    above = support.height(arrays.vertices[touchable]) > CLEAR_M
    drawn = np.random.default_rng(5).choice(touchable[above], count, replace=False)
    missed, felt = [], []
    for vertex in drawn:
        at, into = arrays.vertices[vertex], -arrays.normals[vertex]
        if into @ support.normal > 0.2:  # from below, where the support is in the way
            continue
        one, other = (press(each, at, into, Stroke(depth_m, 0.02)) for each in (quick, whole))
        missed.append(np.linalg.norm(one.force[one.deepest] - other.force[other.deepest]))
        felt.append(np.linalg.norm(other.force[other.deepest]))
    return np.array(missed), np.array(felt)
