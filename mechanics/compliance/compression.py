"""Large surfaces: the smoothed compliance as a low-rank factor, from a few random loads instead of all.

Under a patch of width s the compliance of a body of size L is smooth: some (L / s)^2 load patterns hold
all of it. With r random patterns O, Y = C O costs r solves, and C ~ Y (O'Y)^-1 Y' = U U' (Nystroem;
symmetric, positive semidefinite, from below). t places then take 3 t r numbers instead of 9 t^2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numba import njit

from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import MeshError
from palpate.mechanics.kernels import kernel
from palpate.mechanics.progress import Progress, silent

_AT_ONCE = 128  # patches that are solved for together
_STEP = 120  # load patterns before the first look at the error; then a third more each time


@dataclass(frozen=True)
class LowRankCompliance:
    """factor: (t, 3, r) float32, unit modulus; block (i, j) = factor[i] @ factor[j].T, 1/m.

    error: greatest error of the own block of some places that were solved for exactly, over the block's
    norm; loads: how many patterns were solved for.
    """

    factor: np.ndarray
    error: float
    loads: int

    def block(self, i: int, j: int) -> np.ndarray:
        """(3, 3) 1/m: displacement at place i for a unit force at place j."""
        return self.factor[i].astype(float) @ self.factor[j].astype(float).T

    def own(self) -> np.ndarray:
        """(t, 3, 3) 1/m: every place under its own patch."""
        return np.einsum("iar,ibr->iab", self.factor, self.factor, optimize=True)


def compress(
    solver: Solver,
    points: np.ndarray,
    width_m: float,
    *,
    tolerance: float = 0.005,
    most: int = 3000,
    checked: int = 32,
    seed: int = 0,
    progress: Progress = silent,
) -> LowRankCompliance:
    """Factor the compliance between patches of `width_m` at surface points (t, 3).

    Patterns are added until the own blocks of `checked` places, solved for exactly, agree to `tolerance`;
    then those that the tolerance does not need are dropped. The same seed gives the same factor. Raises
    MeshError where `most` patterns do not suffice.
    """
    average = PatchSampler(solver.mesh, width_m).matrix(points)
    t = len(points)
    rng = np.random.default_rng(seed)
    probe = np.sort(rng.choice(t, min(checked, t), replace=False))
    exact = own_compliance(solver, average[probe])
    patterns, answers = np.empty((3 * t, 0)), np.empty((3 * t, 0))
    rows = (3 * probe[:, None] + np.arange(3)).ravel()
    while True:
        loads = patterns.shape[1]
        new = rng.normal(size=(3 * t, min(max(_STEP, loads // 3), 3 * t - loads)))
        patterns = np.hstack([patterns, new])
        answers = np.hstack([answers, _answer(solver, average, new)])
        factor = _factor(patterns, answers)
        errors = _errors_by_rank(factor[rows].reshape(len(probe), 3, -1), exact)
        loads = patterns.shape[1]
        progress("load patterns", min(0.99, tolerance / errors[-1]))
        if errors[-1] <= 0.8 * tolerance or loads == 3 * t:
            break
        if loads >= most:
            raise MeshError(
                f"{loads} load patterns leave an error of {errors[-1]:.2g} where {tolerance:.2g} is allowed: "
                "take a wider patch or a larger tolerance"
            )
    rank = int(np.argmax(errors <= max(tolerance, errors[-1]))) + 1
    kept = np.ascontiguousarray(factor[:, :rank].reshape(t, 3, rank), dtype=np.float32)
    progress("load patterns", 1.0)
    return LowRankCompliance(kept, float(errors[rank - 1]), loads)


def own_compliance(solver: Solver, average: sp.csr_matrix) -> np.ndarray:
    """(k, 3, 3) 1/m: mean displacement of every patch for a unit force on itself; weights (k, n)."""
    return solver.quadratic_forms(sp.kron(average, sp.eye(3), format="csc").T.tocsr()[solver.free])


def own_blocks(
    solver: Solver,
    points: np.ndarray,
    width: float,
    tell: Callable[[float], None] = lambda share: None,
    *,
    sampler: PatchSampler | None = None,
) -> np.ndarray:
    """(t, 3, 3) 1/m: mean displacement of every patch for a unit force on itself; surface points (t, 3).

    sampler: of the solver's mesh and that width, where there is one.
    """
    average = (sampler or PatchSampler(solver.mesh, width)).matrix(points)
    own = np.empty((len(points), 3, 3))
    for start in range(0, len(points), _AT_ONCE):
        part = slice(start, min(start + _AT_ONCE, len(points)))
        own[part] = own_compliance(solver, average[part])
        tell(part.stop / len(points))
    return own


def unit_loads(average: sp.csr_matrix) -> np.ndarray:
    """(n, 3, k, 3) nodal forces of unit loads x, y, z on each of k patches, from weights (k, n)."""
    dense = average.toarray().T
    loads = np.zeros((len(dense), 3, dense.shape[1], 3))
    for axis in range(3):
        loads[:, axis, :, axis] = dense
    return loads


def _answer(solver: Solver, average: sp.csr_matrix, patterns: np.ndarray) -> np.ndarray:
    """(3t, r) mean displacements of the patches for forces (3t, r) on them."""
    t, n = average.shape
    r = patterns.shape[1]
    loads = (average.T @ patterns.reshape(t, 3 * r)).reshape(3 * n, r)
    moved = np.zeros((3 * n, r))
    moved[solver.free] = solver.solve_free(loads[solver.free])
    return (average @ moved.reshape(n, 3 * r)).reshape(3 * t, r)


def _factor(patterns: np.ndarray, answers: np.ndarray) -> np.ndarray:
    """U (3t, r) of the Nystroem approximation, its columns from the most to the least important."""
    core = patterns.T @ answers
    core = 0.5 * (core + core.T)
    core += 1e-12 * np.trace(core) / len(core) * np.eye(len(core))  # rounding must not make it indefinite
    root = la.cholesky(core, lower=True)
    factor = la.solve_triangular(root, answers.T, lower=True).T
    _, turned = la.eigh(factor.T @ factor)
    return factor @ turned[:, ::-1]


def _errors_by_rank(rows: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """(r,) greatest relative error of own blocks (k, 3, 3) with the first 1 .. r columns of (k, 3, r)."""
    left = np.broadcast_to(exact[..., None], (*exact.shape, rows.shape[2])).copy()
    left -= np.cumsum(rows[:, :, None, :] * rows[:, None, :, :], axis=3)
    size = np.linalg.norm(exact, axis=(1, 2))
    return (np.linalg.norm(left, axis=(1, 2)) / size[:, None]).max(axis=0)


# kernels of the 1 kHz loop: a place is three corners of the surface, negative where held (they do not move),
# with three weights


@kernel
def mix_factor(factor, corners, weights, out):
    """out (3, r): the rows of a low-rank factor (t, 3, r) at a place."""
    for a in range(3):
        for k in range(factor.shape[2]):
            out[a, k] = 0.0
    for i in range(3):
        if corners[i] >= 0:
            for a in range(3):
                for k in range(factor.shape[2]):
                    out[a, k] += weights[i] * factor[corners[i], a, k]


@njit(cache=True, error_model="numpy", fastmath=True)
def between_mixed(mixed_p, mixed_q, out):
    """out (3, 3) 1/m: displacement at p for a unit force at q, from `mix_factor` at both."""
    for a in range(3):
        for b in range(3):
            total = 0.0
            for k in range(mixed_p.shape[1]):
                total += mixed_p[a, k] * mixed_q[b, k]
            out[a, b] = total
