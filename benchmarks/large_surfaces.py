"""Large surfaces: memory, precompute, query time and error of the low-rank form against the dense one.

The block of the paper, refined towards its surface. Every touchable node is a place. Dense: 9 t^2 numbers
in float32; its precompute is 3 t solves, timed on a sample and scaled. Error: the greatest of places
solved exactly.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks.timing import measure, table
from mechanics.box_mesh import box_mesh
from mechanics.compression import between_low_rank, compress
from mechanics.refine import refined_near_surface
from mechanics.solver import Solver

SUMMARY = "low-rank compliance of 1,000 to 20,000 touchable nodes"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Surface edges, width, rank."""
    parser.add_argument("--edge", type=float, nargs="+", default=[0.011, 0.006, 0.0026], metavar="M")
    parser.add_argument("--width", type=float, default=0.009, help="of the load patch [m]", metavar="M")
    parser.add_argument("--rank", type=int, default=600)


def run(arguments: argparse.Namespace) -> dict:
    """Print one row a mesh."""
    rows = []
    for edge in arguments.edge:
        linear, _ = refined_near_surface(box_mesh((10, 10, 5), (0.105, 0.105, 0.047)), edge)
        mesh = linear.quadratic()
        started = time.perf_counter()
        solver = Solver(mesh, 0.49)
        factor_s = time.perf_counter() - started
        places = mesh.points[mesh.touchable]
        loads = np.random.default_rng(1).normal(size=(len(solver.free), 48))
        solve_s = (
            measure(lambda solver=solver, loads=loads: solver.solve_free(loads), repeats=1).median_s / 48
        )
        started = time.perf_counter()
        compressed = compress(solver, places, arguments.width, arguments.rank)
        took = time.perf_counter() - started
        t = len(places)
        rng = np.random.default_rng(0)
        pairs = [rng.integers(0, t, (2, 3)) for _ in range(200)]
        weights, out = np.full(3, 1 / 3), np.empty((3, 3))
        between_low_rank(compressed.factor, pairs[0][0], weights, pairs[0][1], weights, out)

        def ask(pairs=pairs, factor=compressed.factor, weights=weights, out=out):  # type: ignore[no-untyped-def]
            for p, q in pairs:
                between_low_rank(factor, p, weights, q, weights, out)

        rows.append(
            {
                "touchable_nodes": t,
                "nodes": len(mesh.points),
                "factor_s": factor_s,
                "precompute_s": took,
                "dense_precompute_s": 3 * t * solve_s,
                "low_rank_gb": compressed.factor.nbytes / 1e9,
                "dense_gb": 36e-9 * t * t,
                "error": compressed.error,
                "query_us": 1e6 * measure(ask, repeats=5).median_s / len(pairs),
            }
        )
        print(table([k.replace("_", " ") for k in rows[-1]], [list(rows[-1].values())]), flush=True)
        del solver, compressed
    return {"width_m": arguments.width, "rank": arguments.rank, "sizes": rows}
