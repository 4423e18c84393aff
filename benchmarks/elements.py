"""Which tetrahedron: linear, quadratic, quadratic with mean dilatation, on a thin bonded block near nu =
0.5.

The give of a 100 x 100 x 30 mm block, bonded below, under a Gaussian patch of 15 mm at the middle of its
top, over that of the finest quadratic mesh; and degrees of freedom. An element that locks is too stiff: a
ratio below 1.
"""

from __future__ import annotations

import argparse

import numpy as np

from benchmarks.timing import table
from mechanics.box_mesh import box_mesh
from mechanics.patch import PatchSampler
from mechanics.solver import Solver
from mechanics.tetmesh import TetMesh

SUMMARY = "locking: linear, quadratic and mean-dilatation tetrahedra near nu = 0.5"
KINDS = {"linear": (1, False), "quadratic": (2, False), "quadratic, mean dilatation": (2, True)}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Poisson's ratios."""
    parser.add_argument("--poisson-ratio", type=float, nargs="+", default=[0.3, 0.49, 0.499])


def give(mesh: TetMesh, nu: float, mean_dilatation: bool) -> tuple[float, int]:
    """(compliance of the patch for unit modulus 1/m, degrees of freedom)."""
    solver = Solver(mesh, nu, mean_dilatation=mean_dilatation)
    nodes, weights = PatchSampler(mesh, 0.015).weights(np.array([0.0, 0.0, 0.03]))
    force = np.zeros_like(mesh.points)
    force[nodes, 2] = weights
    return float((solver.solve(force) * force).sum()), len(solver.free)


def run(arguments: argparse.Namespace) -> dict:
    """Print give over the finest quadratic mesh's, element by element and mesh by mesh."""
    sizes = {"15 mm": (7, 7, 2), "10 mm": (10, 10, 3), "7.5 mm": (13, 13, 4)}
    result: dict = {}
    for nu in arguments.poisson_ratio:
        finest, _ = give(box_mesh((18, 18, 6), (0.1, 0.1, 0.03)).quadratic(), nu, False)
        rows = []
        for kind, (order, mean) in KINDS.items():
            row: list = [kind]
            for name, cells in sizes.items():
                mesh = box_mesh(cells, (0.1, 0.1, 0.03))
                value, dofs = give(mesh if order == 1 else mesh.quadratic(), nu, mean)
                row += [value / finest, dofs]
                result[f"{nu} {kind} {name}"] = value / finest
            rows.append(row)
        print(f"Poisson's ratio {nu}")
        print(table(["element"] + [h for name in sizes for h in (name, "unknowns")], rows))
    return result
