"""Large surfaces: the smoothed compliance as a low-rank factor, from a few random loads instead of all.

Under a patch of width s the compliance of a body of size L is smooth: some (L / s)^2 load patterns hold
all of it. With r random patterns O, Y = C O costs r solves, and C ~ Y (O'Y)^-1 Y' = U U' (Nystroem;
symmetric, positive semidefinite, from below). t places then take 3 t r numbers instead of 9 t^2, and a
query 6 r products.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from numba import njit

from mechanics.patch import PatchSampler
from mechanics.progress import Progress, silent
from mechanics.solver import Solver

_COLUMNS = 96


@dataclass(frozen=True)
class LowRankCompliance:
    """factor: (t, 3, r) float32, unit modulus; block (i, j) = factor[i] @ factor[j].T, 1/m.

    patch_width_m: of the places' patches. error: greatest error of the own block of some places that were
    solved for exactly, over the block's norm.
    """

    factor: np.ndarray
    patch_width_m: float
    error: float

    def block(self, i: int, j: int) -> np.ndarray:
        """(3, 3) 1/m: displacement at place i for a unit force at place j."""
        return self.factor[i].astype(float) @ self.factor[j].astype(float).T

    def own(self) -> np.ndarray:
        """(t, 3, 3) 1/m: every place under its own patch."""
        return np.einsum("iar,ibr->iab", self.factor, self.factor, optimize=True)


@njit(cache=True, error_model="numpy", fastmath=True)
def between_low_rank(factor, corners_p, weights_p, corners_q, weights_q, out):
    """out (3, 3) 1/m: as surface_compliance.between_block, from the factor."""
    rank = factor.shape[2]
    for a in range(3):
        for b in range(3):
            out[a, b] = 0.0
    mixed = np.zeros((6, rank), dtype=np.float32)
    for a in range(3):
        for i in range(3):
            for k in range(rank):  # innermost and contiguous: the compiler vectorises it
                mixed[a, k] += np.float32(weights_p[i]) * factor[corners_p[i], a, k]
                mixed[3 + a, k] += np.float32(weights_q[i]) * factor[corners_q[i], a, k]
    for a in range(3):
        for b in range(3):
            total = 0.0
            for k in range(rank):
                total += mixed[a, k] * mixed[3 + b, k]
            out[a, b] = total


def compress(
    solver: Solver,
    points: np.ndarray,
    width_m: float,
    rank: int,
    *,
    checked: int = 24,
    seed: int = 0,
    progress: Progress = silent,
) -> LowRankCompliance:
    """Factor the compliance between patches of `width_m` at surface points (t, 3).

    rank: load patterns, at most 3 t. checked: places solved for exactly to state the error. The same seed
    gives the same factor.
    """
    mesh = solver.mesh
    average = PatchSampler(mesh, width_m).matrix(points)
    t = len(points)
    rank = min(rank, 3 * t)
    rng = np.random.default_rng(seed)
    patterns = rng.normal(size=(t, 3, rank))
    answers = np.empty((t, 3, rank))
    free = solver.free
    for start in range(0, rank, _COLUMNS):
        part = slice(start, min(start + _COLUMNS, rank))
        count = part.stop - start
        loads = (average.T @ patterns[:, :, part].reshape(t, 3 * count)).reshape(len(mesh.points) * 3, count)
        moved = np.zeros((3 * len(mesh.points), count))
        moved[free] = solver.solve_free(loads[free])
        answers[:, :, part] = (average @ moved.reshape(len(mesh.points), -1)).reshape(t, 3, count)
        progress("load patterns", 0.9 * part.stop / rank)
    y = answers.reshape(3 * t, rank)
    core = patterns.reshape(3 * t, rank).T @ y
    core = 0.5 * (core + core.T)
    shift = 1e-12 * np.trace(core) / rank  # keeps rounding from making the core indefinite
    root = la.cholesky(core + shift * np.eye(rank), lower=True)
    factor = la.solve_triangular(root, y.T, lower=True, overwrite_b=False).T.astype(np.float32)
    result = LowRankCompliance(factor.reshape(t, 3, rank), float(width_m), float("nan"))
    probe = rng.choice(t, min(checked, t), replace=False)
    loads = np.zeros((len(mesh.points), 3, len(probe), 3))
    for axis in range(3):
        loads[:, axis, :, axis] = average[probe].toarray().T
    exact = solver.quadratic_forms(loads.reshape(-1, len(probe), 3)[free])
    found = result.own()[probe]
    error = np.linalg.norm(found - exact, axis=(1, 2)) / np.linalg.norm(exact, axis=(1, 2))
    progress("load patterns", 1.0)
    return LowRankCompliance(result.factor, float(width_m), float(error.max()))
