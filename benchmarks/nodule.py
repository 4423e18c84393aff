"""Dragging a stiff nodule: the low-rank update of the servo's tables against a full recompute.

A block of 100 x 100 x 50 mm on 10 mm elements; a nodule of 10 mm radius, 6 times as stiff, moves within a
region.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks.timing import measure, table
from mechanics.box_mesh import box_mesh
from mechanics.inclusion import Region, inclusion_ratio, share_inside
from mechanics.patch import PatchSampler
from mechanics.sites import patch_width
from mechanics.solver import Solver
from mechanics.surface_compliance import patch_blocks

SUMMARY = "moving a nodule by a low-rank update against a full recompute"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Radius, stiffness, reach."""
    parser.add_argument("--radius", type=float, default=0.010, help="of the nodule [m]", metavar="M")
    parser.add_argument("--ratio", type=float, default=6.0, help="of its modulus to the rest's")
    parser.add_argument("--reach", type=float, default=0.020, help="radius of the region [m]", metavar="M")


def run(arguments: argparse.Namespace) -> dict:
    """Print times, ratio and the error against the recompute."""
    mesh = box_mesh((10, 10, 5), (0.1, 0.1, 0.05)).quadratic()
    middle = np.array([0.0, 0.0, 0.028])
    places = mesh.points[np.unique(mesh.touchable_surface[:, :3])]
    width = patch_width(mesh)
    average = PatchSampler(mesh, width).matrix(places)
    t = len(places)

    def recompute(centre: np.ndarray) -> np.ndarray:
        ratio = inclusion_ratio(mesh, centre, arguments.radius, arguments.ratio)
        blocks = patch_blocks(Solver(mesh, 0.49, ratio), places, width)
        return blocks.transpose(0, 2, 1, 3).reshape(3 * t, 3 * t)

    plain = patch_blocks(Solver(mesh, 0.49), places, width)
    plain = plain.transpose(0, 2, 1, 3).reshape(3 * t, 3 * t).astype(float)
    pool = np.flatnonzero(share_inside(mesh, middle, arguments.reach) > 0)
    started = time.perf_counter()
    region = Region(Solver(mesh, 0.49), pool, average)
    prepare = time.perf_counter() - started
    centre = middle + [0.004, -0.002, 0.001]
    factor = inclusion_ratio(mesh, centre, arguments.radius, arguments.ratio)[pool]
    update = measure(lambda: region.updated(plain, factor), repeats=3).median_s
    x, _ = region.change(factor)
    started = time.perf_counter()
    full = recompute(centre)
    again = time.perf_counter() - started
    error = np.abs(region.updated(plain, factor) - full).max() / np.abs(full).max()
    result = {
        "surface_places": t,
        "elements_changed": int((factor != 1).sum()),
        "rank": x.shape[1],
        "prepare_region_s": prepare,
        "update_s": update,
        "recompute_s": again,
        "recompute_over_update": again / update,
        "error": float(error),
    }
    print(table([k.replace("_", " ") for k in result], [list(result.values())]))
    return result
