"""The precompute of a touch against its peer: a solve a column from the same factor, as SOFA does it.

surface: both tables of a block's surface, from nothing (mechanics.compliance.surface_compliance). columns:
displacements of the touchable nodes for a unit force on each, one at a time and in batches; timed on a
sample and scaled. On a shared machine the ratios of processor time are the fairer ones.
"""

from __future__ import annotations

import argparse

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import measure, table
from palpate.mechanics.compliance.surface_compliance import surface_compliance
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh

NU, BATCH = 0.49, 96


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Sizes, repeats."""
    parser.add_argument(
        "--touchable", type=int, nargs="+", default=[1000, 2000, 5400], help="touchable nodes, about"
    )
    parser.add_argument("--repeats", type=int, default=3)


def block(touchable: int) -> TetMesh:
    """A 105 x 105 x 47 mm block of quadratic tetrahedra with about that many touchable nodes."""
    step = 2 * np.sqrt((0.105**2 + 4 * 0.105 * 0.047) / touchable)
    cells = tuple(max(1, round(length / step)) for length in (0.105, 0.105, 0.047))
    return box_mesh(cells, (0.105, 0.105, 0.047)).quadratic()


def one_size(touchable: int, repeats: int) -> dict[str, float]:
    """Processor seconds of each way for one mesh."""
    mesh = block(touchable)
    nodes = int(mesh.touchable.sum())
    surface = measure(lambda: surface_compliance(mesh, NU), repeats=1 if nodes > 3000 else repeats)
    factor = measure(lambda: Solver(mesh, NU), repeats=1, warm_up=0)
    solver = Solver(mesh, NU)
    loads = np.zeros((len(solver.free), BATCH), order="F")
    loads[np.arange(BATCH) * 3, np.arange(BATCH)] = 1
    single = measure(lambda: solver.solve_free(loads[:, :1]), repeats=15)
    batch = measure(lambda: solver.solve_free(loads), repeats=3)
    columns = factor.cpu_median_s + 3 * nodes * single.cpu_median_s
    batches = factor.cpu_median_s + 3 * nodes * batch.cpu_median_s / BATCH
    own, (least, most) = surface.cpu_median_s, surface.cpu_spread_s
    return {
        "touchable_nodes": nodes, "unknowns": len(solver.free), "surface_s": own, "columns_s": columns,
        "columns_in_batches_s": batches, "columns_over_surface": columns / own, "least": columns / most,
        "most": columns / least, "batches_over_surface": batches / own,
    }  # fmt: skip


def run(arguments: argparse.Namespace) -> dict:
    """Print one row a size."""
    results = [one_size(touchable, arguments.repeats) for touchable in arguments.touchable]
    print(table([k.replace("_", " ") for k in results[0]], [list(row.values()) for row in results]))
    figures = []
    for row in results:
        where = f"the surface's tables, CPU, {row['touchable_nodes']:.0f} touchable nodes"
        spread = (row["least"], row["most"])
        ratio = Figure(f"a solve a column over {where}", row["columns_over_surface"], spread)
        figures += [
            ratio.at_least(1.0),
            Figure(f"columns in batches over {where}", row["batches_over_surface"]),
        ]
    return {"sizes": results, "figures": figures}
