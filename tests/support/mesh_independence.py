"""Does the force depend on the mesh? One press at ten places of the paper's three samples on meshes of 10,
7, 5 mm.

Each place is pressed straight down to the same depth with the tip of 5 mm; forces for 20 kPa, finite-strain
dent. The change is (greatest - least) / mean over the meshes, place by place. `--point-load` shows the
paper's way beside it: a unit force on the nearest node of linear tetrahedra.
"""

from __future__ import annotations

import argparse
from functools import partial

import numpy as np

from benchmarks.timing import table
from palpate.mechanics.compliance.sites import touch_sites, touch_solver
from palpate.mechanics.contact.touch import touch_force
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.shape.tetmesh import TetMesh

from .sample_shapes import PLACES, sample_mesh, sample_places

NU, MODULUS, RADIUS = 0.49, 20e3, 0.005


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Sizes, depth."""
    parser.add_argument("--mesh-size", type=float, nargs="+", default=[0.010, 0.007, 0.005], metavar="M")
    parser.add_argument("--depth", type=float, default=0.005, help="of the press [m]", metavar="M")
    parser.add_argument("--sample", nargs="+", choices=sorted(PLACES), default=sorted(PLACES))
    parser.add_argument("--point-load", action="store_true", help="also the paper's point load")


def press(
    mesh: TetMesh, points: np.ndarray, normals: np.ndarray, bent: np.ndarray, depth: float
) -> np.ndarray:
    """(k,) N: force along the normal of a press at each place."""
    sites = touch_sites(mesh, points, normals, NU, solver=touch_solver(mesh, NU), curvature=bent)
    path = np.linspace(0, -depth, 60)[:, None]
    force = partial(
        touch_force, young_modulus_pa=MODULUS, poisson_ratio=NU, tip_radius_m=RADIUS, law="neo-hookean"
    )
    forces = [
        force(path * n, n, far, curvature=b)[-1] @ n
        for n, far, b in zip(normals, sites.far, bent, strict=True)
    ]
    return np.array(forces)


def point_force(mesh: TetMesh, points: np.ndarray, normals: np.ndarray, depth: float) -> np.ndarray:
    """(k,) N: the same by a force on the nearest node of the linear mesh."""
    mesh = mesh.linear()
    solver = Solver(mesh, NU)
    touchable = np.flatnonzero(mesh.touchable)
    forces = np.zeros((len(mesh.points), 3, len(points)))
    nodes = [touchable[np.argmin(np.linalg.norm(mesh.points[touchable] - p, axis=1))] for p in points]
    for k, (node, normal) in enumerate(zip(nodes, normals, strict=True)):
        forces[node, :, k] = normal
    moved = solver.solve(forces)
    compliance = np.array([moved[node, :, k] @ normals[k] for k, node in enumerate(nodes)])
    return MODULUS * depth / compliance


def run(arguments: argparse.Namespace) -> dict:
    """Print a table a sample: place, force on each mesh, change."""
    result: dict = {}
    for sample in arguments.sample:
        points, normals, bent = sample_places(sample)
        columns, paper, sizes = [], [], []
        for size in arguments.mesh_size:
            mesh = sample_mesh(sample, size)
            sizes.append(len(mesh.points))
            columns.append(press(mesh, points, normals, bent, arguments.depth))
            if arguments.point_load:
                paper.append(point_force(mesh, points, normals, arguments.depth))
        result[sample] = _report(sample, arguments, sizes, points, np.array(columns), "patch and dent")
        if arguments.point_load:
            result[sample + ", point load"] = _report(
                sample, arguments, sizes, points, np.array(paper), "point load"
            )
    return result


def _report(
    sample: str,
    arguments: argparse.Namespace,
    nodes: list[int],
    points: np.ndarray,
    forces: np.ndarray,
    way: str,
) -> dict:
    change = (forces.max(axis=0) - forces.min(axis=0)) / forces.mean(axis=0)
    head = ["place (mm)"] + [
        f"{1e3 * s:g} mm ({n} nodes), N" for s, n in zip(arguments.mesh_size, nodes, strict=True)
    ]
    rows = [
        [" ".join(f"{1e3 * x:.0f}" for x in p), *map(float, f), f"{100 * c:.1f} %"]
        for p, f, c in zip(points, forces.T, change, strict=True)
    ]
    worst, middle = 100 * change.max(), 100 * np.median(change)
    print(f"\n{sample}, {way}: greatest change {worst:.1f} %, median {middle:.1f} %")
    print(table([*head, "change"], rows), flush=True)
    return {"forces_n": forces, "change": change, "nodes": nodes}
