"""Large surfaces: memory, precompute, query time and error of the compressed tables against the dense ones.

The block of the paper, refined towards its surface; the tables that `load_or_condense` makes of it by itself
beyond some 2,000 corners. Dense: the mutual table of all corners in float32; its precompute is a solve a
column, timed on a sample and scaled. Errors are against solves: of the force of a press of 5 mm at
corners of the table and at places drawn at random (interpolated), greatest and root mean square; and of how
one place moves another, over the compliance of a place under itself.
Times are CPU seconds. A tick is a step of the finite-element renderer with 1 and with 8 tips in contact.
"""

from __future__ import annotations

import argparse
import time
from functools import partial

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import measure, table
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.compliance.sites import LoadPatch, patch_loads, touch_sites
from palpate.mechanics.compliance.stored_compliance import ComplianceOptions
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance, surface_compliance
from palpate.mechanics.contact.touch import TouchedPlaces, touch_forces
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.model.material import Material
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.nearest import closest
from palpate.mechanics.shape.refine import refined_near_surface
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.render.fem.renderer import FemRenderer

NU, MODULUS, RADIUS = 0.49, 20e3, 0.005


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Surface edges, tolerance, places."""
    parser.add_argument("--edge", type=float, nargs="+", default=[0.006, 0.004], metavar="M")
    parser.add_argument("--low-rank-error", type=float, default=ComplianceOptions().low_rank_error)
    parser.add_argument("--places", type=int, default=24, help="solved for exactly, to state the errors")
    parser.add_argument("--seed", type=int, default=0)


def press_errors(
    made: SurfaceCompliance, solver: Solver, points: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """(k,) relative error of the force of a press of 5 mm at places, against solves there."""
    width = float(made.own_width_m[0])
    sites = touch_sites(
        solver.mesh, points, normals, NU, solver=solver, patch=LoadPatch(width), curvature=0.0
    )
    path = (-np.linspace(0, 0.005, 60)[:, None] * normals[:, None]).reshape(-1, 3)
    starts = 60 * np.arange(len(points) + 1)
    force = partial(
        touch_forces, young_modulus_pa=MODULUS, poisson_ratio=NU, tip_radius_m=RADIUS, law="neo-hookean"
    )
    served, solved = (
        np.linalg.norm(force(path, starts, TouchedPlaces(normals, far))[59::60], axis=1)
        for far in (made.far_at(points, normals), sites.far)
    )
    return np.abs(served / solved - 1)


def errors(made: SurfaceCompliance, solver: Solver, places: int, seed: int) -> dict[str, float]:
    """Errors of force and of mutual compliance at random places, against solves there."""
    rng = np.random.default_rng(seed)
    corners = rng.choice(len(made.own_points), places, replace=False)
    at_corners = press_errors(made, solver, made.own_points[corners], made.own_normals[corners])
    faces = made.own_points[made.own_triangles]
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    area = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(faces), places, p=area / area.sum())
    points = np.einsum("kc,kcx->kx", rng.dirichlet(np.ones(3), places), faces[chosen])
    between = press_errors(made, solver, points, normals[chosen] / area[chosen, None])
    sampler = PatchSampler(solver.mesh, float(made.patch_width_m[0]))
    patches = [sampler.weights(p) for p in points[:8]]
    moved = solver.solve(patch_loads(solver.mesh, patches))
    _, triangle, weights = closest(made.points, made.triangles, points[:8])
    worst = 0.0
    for j in range(8):
        under = moved[:, :, 3 * j : 3 * j + 3]
        own = np.einsum("n,nar->ar", patches[j][1], under[patches[j][0]])
        for i in set(range(8)) - {j}:
            exact = np.einsum("n,nar->ar", patches[i][1], under[patches[i][0]])
            found = np.zeros((3, 3))
            for corner, weight in zip(made.triangles[triangle[j]], weights[j], strict=True):
                for axis in range(3):
                    compliance = made.displacement(corner, np.eye(3)[axis])[made.triangles[triangle[i]]]
                    found[:, axis] += weight * (weights[i] @ compliance)
            worst = max(worst, float(np.linalg.norm(found - exact) / np.linalg.norm(own)))
    return {
        "corner_error_greatest": float(at_corners.max()),
        "corner_error_rms": float(np.sqrt((at_corners**2).mean())),
        "force_error_greatest": float(between.max()),
        "force_error_rms": float(np.sqrt((between**2).mean())),
        "mutual_error_greatest": float(worst),
    }


def tick_us(mesh: TetMesh, made: SurfaceCompliance, tips: int) -> float:
    """Microseconds of a step with so many tips pressed into the top and sliding."""
    model = Model(
        mesh=mesh,
        material=Material(MODULUS, NU),
        support=Support(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        tool=Tool(RADIUS),
        mesh_size_m=0.01,
    )
    renderer = FemRenderer(model, compliance=made)
    t = np.arange(600)
    height = mesh.points[:, 2].max() + RADIUS + 1e-3 - 3e-3 * np.minimum(t / 200, 1)
    across = 0.01 * np.maximum(t - 200, 0) / 400
    path = np.zeros((600, tips, 3))
    for k in range(tips):
        path[:, k] = np.stack([0.012 * (k - tips / 2 + 0.5) + across, across, height], axis=1)
    steps = np.full(600, 1e-3)
    state = renderer.start([RADIUS] * tips)
    renderer.follow(state, path[:300], steps[:300])
    started = time.perf_counter()
    renderer.follow(state, path[300:], steps[300:])
    return 1e6 * (time.perf_counter() - started) / 300


def run(arguments: argparse.Namespace) -> dict:
    """Print one row a mesh."""
    rows = []
    for edge in arguments.edge:
        mesh, _ = refined_near_surface(box_mesh((10, 10, 5), (0.105, 0.105, 0.047)), edge)
        started = time.process_time()
        made = surface_compliance(mesh, NU, low_rank_error=arguments.low_rank_error)
        took = time.process_time() - started
        quadratic = mesh.quadratic()
        solver = Solver(quadratic, NU)
        loads = np.random.default_rng(1).normal(size=(len(solver.free), 48))
        solve = measure(partial(solver.solve_free, loads), repeats=1).cpu_median_s / 48
        corners = len(made.points)
        rows.append(
            {
                "touchable_nodes": int(quadratic.touchable.sum()),
                "nodes": len(quadratic.points),
                "corners": corners,
                "rank": made.factor.shape[2],
                "served_mb": sum(a.nbytes for a in made.arrays().values()) / 1e6,
                "dense_mb": 36e-6 * corners**2,
                "precompute_s": took,
                "dense_mutual_s": 3 * corners * solve,
                **errors(made, solver, arguments.places, arguments.seed),
                "tick_1_us": tick_us(mesh, made, 1),
                "tick_8_us": tick_us(mesh, made, 8),
            }
        )
        print(table([k.replace("_", " ") for k in rows[-1]], [list(rows[-1].values())]), flush=True)
        del solver, made
    figures = []
    for row in rows:
        nodes = f"{row['touchable_nodes']} touchable nodes"
        rms, most = 100 * row["force_error_rms"], 100 * row["force_error_greatest"]
        figures += [
            Figure(f"table served, {nodes}", row["served_mb"], unit="MB").at_most(row["dense_mb"], "dense"),
            Figure(
                f"force against a solve at the place, rms (to the greatest), {nodes}", rms, (rms, most), "%"
            ),
        ]
    return {"low_rank_error": arguments.low_rank_error, "sizes": rows, "figures": figures}
