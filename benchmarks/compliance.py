"""The precompute against its limit and against its peers, for meshes of three sizes.

limit: the dense inverse (potrf, potri) of a matrix as large as the result. schur:
benchmarks._condensation.
Times are wall and CPU: on a shared machine the CPU ratios are the fairer ones. columns: a solve a column
from the same factor, one at a time (SOFA's way) and in batches; timed on a sample of columns and scaled.
Memory: the greatest resident set of a fresh process that condenses, less that before.
"""

from __future__ import annotations

import argparse
import multiprocessing
from multiprocessing.queues import Queue

import numpy as np

from benchmarks._condensation import condense, inverse
from benchmarks.evidence import Figure
from benchmarks.timing import measure, table
from palpate.mechanics.elastic.pardiso import Pardiso, available
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import OptionError
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.parallel.tasks import high_water_bytes


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Sizes, element, repeats."""
    parser.add_argument(
        "--touchable", type=int, nargs="+", default=[1000, 2000, 5400], help="touchable nodes, about"
    )
    parser.add_argument("--order", type=int, choices=(1, 2), default=2, help="element order (default: 2)")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument(
        "--no-memory", action="store_true", help="skip the fresh process that measures memory"
    )


def block(touchable: int, order: int) -> TetMesh:
    """A 105 x 105 x 47 mm block with about that many touchable nodes."""
    step = np.sqrt((0.105**2 + 4 * 0.105 * 0.047) / touchable) * order
    cells = tuple(max(1, round(length / step)) for length in (0.105, 0.105, 0.047))
    mesh = box_mesh(cells, (0.105, 0.105, 0.047))
    return mesh if order == 1 else mesh.quadratic()


def memory_of(touchable: int, order: int) -> tuple[float, float]:
    """(peak beyond the start, result and factor), bytes, of one condensation in this process."""
    mesh = block(touchable, order)
    factor = Pardiso(Solver(block(200, order), 0.49).matrix)  # loads the library before the start is read
    factor.free()
    before = high_water_bytes()
    result = condense(mesh, 0.49)
    peak = high_water_bytes() - before
    need = result.matrix.nbytes + 8.0 * Pardiso(Solver(mesh, 0.49).matrix).factor_nonzeros
    return peak, need


def _worker(touchable: int, order: int, queue: Queue[tuple[float, float]]) -> None:
    queue.put(memory_of(touchable, order))


def fresh_memory(touchable: int, order: int) -> tuple[float, float]:
    """`memory_of` in a new process."""
    context = multiprocessing.get_context("spawn")
    queue = context.Queue()
    process = context.Process(target=_worker, args=(touchable, order, queue))
    process.start()
    result = queue.get()
    process.join()
    return result


def one_size(touchable: int, order: int, repeats: int) -> dict[str, float]:
    """Seconds of each way for one mesh."""
    mesh = block(touchable, order)
    large = mesh.touchable.sum() > 3000
    repeats = 1 if large else repeats
    schur = measure(lambda: condense(mesh, 0.49), repeats=repeats, warm_up=0 if large else 1)
    n = 3 * int(mesh.touchable.sum())
    rng = np.random.default_rng(0)
    dense = rng.normal(size=(n, 200))
    dense = dense @ dense.T / 200 + np.eye(n)
    limit = measure(lambda: inverse(dense.copy()), repeats=repeats, warm_up=0 if large else 1)
    factor = measure(lambda: Solver(mesh, 0.49), repeats=1, warm_up=0)
    solver = Solver(mesh, 0.49)
    one = np.zeros((len(solver.free), 1))
    one[5] = 1
    many = np.zeros((len(solver.free), 96), order="F")
    many[np.arange(96) * 3, np.arange(96)] = 1
    single = measure(lambda: solver.solve_free(one), repeats=15)
    batch = measure(lambda: solver.solve_free(many), repeats=3)
    row: dict[str, float] = {"touchable_nodes": n // 3, "unknowns": len(solver.free)}
    for clock in ("median_s", "cpu_median_s"):
        name = clock.removesuffix("median_s")
        whole, least = getattr(schur, clock), getattr(limit, clock)
        columns = getattr(factor, clock) + n * getattr(single, clock)
        batches = getattr(factor, clock) + n * getattr(batch, clock) / 96
        row |= {
            f"schur_{name}s": whole,
            f"limit_{name}s": least,
            f"columns_{name}s": columns,
            f"columns_in_batches_{name}s": batches,
            f"{name}over_limit": whole / least,
            f"{name}columns_over_schur": columns / whole,
            f"{name}batches_over_schur": batches / whole,
        }
    return row | {"result_gb": 8e-9 * n * n}


def run(arguments: argparse.Namespace) -> dict:
    """Print one row a size."""
    if not available():
        raise OptionError("this benchmark compares ways of MKL Pardiso, which is not installed here")
    results = []
    for touchable in arguments.touchable:
        row = one_size(touchable, arguments.order, arguments.repeats)
        if not arguments.no_memory:
            peak, need = fresh_memory(touchable, arguments.order)
            row |= {"peak_gb": peak / 1e9, "peak_over_need": peak / need}
        results.append(row)
        print(table([k.replace("_", " ") for k in row], [list(row.values())]), flush=True)
    figures = []
    for row in results:
        nodes = f"{row['touchable_nodes']:.0f} touchable nodes"
        figures += [
            Figure(
                f"condensed compliance over the dense inverse's limit, CPU, {nodes}", row["cpu_over_limit"]
            ),
            Figure(f"column solves over it, CPU, {nodes}", row["cpu_columns_over_schur"]).at_least(1.0),
        ]
    return {"order": arguments.order, "sizes": results, "figures": figures}
