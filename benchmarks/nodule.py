"""A stiff nodule: is it felt as it should be, and can it be dragged?

Felt: a press on the axis of the paper's cylinder (linear dent law) over a nodule below, the force over that
without the nodule; on elements of 10 mm against an axisymmetric solution on elements of 0.25 mm that follow
the nodule's boundary, in another library.

Dragged: how every surface place of a block of 100 x 100 x 50 mm on 10 mm elements moves the others, for a new
place of the nodule, by a low-rank update against a full recompute of the same table; CPU seconds.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks._axisymmetric_nodule import press_force
from benchmarks._sample_shapes import sample_mesh
from benchmarks.timing import measure, table
from mechanics.box_mesh import box_mesh
from mechanics.inclusion import Region
from mechanics.material import Ball
from mechanics.moduli import inclusion_ratio, mixed_ratio, share_inside
from mechanics.patch import PatchSampler
from mechanics.sites import patch_width, touch_sites, touch_solver
from mechanics.solver import Solver
from mechanics.surface_compliance import patch_blocks
from mechanics.touch import touch_force

SUMMARY = "a stiff nodule: its contrast against a fine reference, and moving it against a recompute"
NU, TIP, UP = 0.49, 0.005, np.array([0.0, 0.0, 1.0])


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Radius, stiffness, depths, reach."""
    parser.add_argument("--radius", type=float, default=0.010, help="of the nodule [m]", metavar="M")
    parser.add_argument("--ratio", type=float, default=6.0, help="of its modulus to the rest's")
    parser.add_argument(
        "--centre",
        type=float,
        nargs="+",
        default=[0.014, 0.018, 0.024],
        help="below the top [m]",
        metavar="M",
    )
    parser.add_argument("--depth", type=float, default=0.004, help="of the press [m]", metavar="M")
    parser.add_argument("--mesh-size", type=float, default=0.010, metavar="M")
    parser.add_argument("--reach", type=float, default=0.020, help="radius of the region [m]", metavar="M")


def press_on_axis(solver: Solver, height_m: float, depth_m: float) -> float:
    """N, for unit modulus: the force of a press at the middle of the top."""
    point = np.array([[0.0, 0.0, height_m]])
    far = touch_sites(solver.mesh, point, UP[None], NU, solver=solver, curvature=0.0).far[0]
    path = -np.linspace(0, depth_m, 80)[:, None] * UP
    force = touch_force(path, UP, far, young_modulus_pa=1.0, poisson_ratio=NU, tip_radius_m=TIP, law="linear")
    return float(force[-1, 2])


def felt(arguments: argparse.Namespace) -> list[dict[str, float]]:
    """One row a depth of the nodule."""
    mesh = sample_mesh("cylinder", arguments.mesh_size)
    press = {"tip_radius_m": TIP, "poisson_ratio": NU, "radius_m": 0.04, "height_m": 0.08}
    reference = {
        (centre, ratio): press_force(
            arguments.depth,
            modulus_ratio=ratio,
            depth_of_centre_m=centre,
            nodule_radius_m=arguments.radius,
            **press,
        )
        for centre in arguments.centre
        for ratio in (1.0, arguments.ratio)
    }
    rows = []
    plain = press_on_axis(touch_solver(mesh, NU), 0.08, arguments.depth)
    for centre in arguments.centre:
        place = np.array([0, 0, 0.08 - centre])
        ball = Ball(tuple(place), arguments.radius, arguments.ratio)
        stiff = press_on_axis(touch_solver(mesh, NU, balls=[ball]), 0.08, arguments.depth)
        contrast = stiff / plain - 1
        known = reference[centre, arguments.ratio] / reference[centre, 1.0] - 1
        rows.append(
            {
                "centre_below_top_mm": 1e3 * centre,
                "plain_force_over_reference": plain / reference[centre, 1.0],
                "contrast": contrast,
                "reference": known,
                "contrast_over_reference": contrast / known,
            }
        )
        print(table([k.replace("_", " ") for k in rows[-1]], [list(rows[-1].values())]), flush=True)
    return rows


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
    region = Region(Solver(mesh, NU), pool, PatchSampler(mesh, width).matrix(places))
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
    """Print both tables."""
    result: dict = {"felt": felt(arguments), "dragged": dragged(arguments)}
    row = result["dragged"]
    print(table([k.replace("_", " ") for k in row], [list(row.values())]), flush=True)
    return result
