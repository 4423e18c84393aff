"""A stiff nodule that is dragged: a low-rank update against a full recompute of the same table, CPU seconds.

How every surface place of a block of 100 x 100 x 50 mm on 10 mm elements moves the others, for a new place of
the nodule. (That it is felt as it should be is a test: tests/mechanics/test_inclusion.py.)
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import measure, table
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.compliance.sites import patch_width
from palpate.mechanics.compliance.surface_compliance import patch_blocks
from palpate.mechanics.elastic.inclusion import StiffenedElements
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import inclusion_ratio, mixed_ratio, share_inside
from palpate.mechanics.shape.tetmesh import box_mesh

NU = 0.49


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Radius, stiffness, reach."""
    parser.add_argument("--radius", type=float, default=0.010, help="of the nodule [m]", metavar="M")
    parser.add_argument("--ratio", type=float, default=6.0, help="of its modulus to the rest's")
    parser.add_argument("--reach", type=float, default=0.020, help="radius of the region [m]", metavar="M")


def dragged(arguments: argparse.Namespace) -> dict[str, float]:
    """Times of one move, of a recompute and of the preparation."""
    mesh = box_mesh((10, 10, 5), (0.1, 0.1, 0.05)).quadratic()
    middle = np.array([0.0, 0.0, 0.028])
    there = middle + [0.004, -0.002, 0.001]
    places = mesh.points[np.unique(mesh.touchable_surface[:, :3])]
    t, width = len(places), patch_width(mesh)
    plain = patch_blocks(Solver(mesh, NU), places, width).transpose(0, 2, 1, 3).reshape(3 * t, 3 * t)
    started = time.process_time()
    pool = np.flatnonzero(share_inside(mesh, middle, arguments.reach) > 0)
    region = StiffenedElements(Solver(mesh, NU), pool, PatchSampler(mesh, width).matrix(places))
    prepare = time.process_time() - started

    def move() -> np.ndarray:
        share = share_inside(mesh, there, arguments.radius, region.elements)
        return region.updated(plain, mixed_ratio(share, arguments.ratio))

    def recompute() -> np.ndarray:
        ratio = inclusion_ratio(mesh, there, arguments.radius, arguments.ratio)
        return patch_blocks(Solver(mesh, NU, ratio), places, width)

    moves, again = measure(move, repeats=7), measure(recompute, repeats=1, warm_up=0)
    full = recompute().transpose(0, 2, 1, 3).reshape(3 * t, 3 * t)
    return {
        "places": t,
        "elements_of_region": len(pool),
        "prepare_once_s": prepare,
        "move_s": moves.cpu_median_s,
        "move_wall_s": moves.median_s,
        "recompute_s": again.cpu_median_s,
        "recompute_over_move": again.cpu_median_s / moves.cpu_median_s,
        "error": float(np.abs(move() - full).max() / np.abs(full).max()),
    }


def run(arguments: argparse.Namespace) -> dict:
    """Print and return the times."""
    row = dragged(arguments)
    print(table([k.replace("_", " ") for k in row], [list(row.values())]), flush=True)
    what = "recomputing the table over moving the nodule, CPU"
    return {"dragged": row, "figures": [Figure(what, row["recompute_over_move"], unit="1")]}
