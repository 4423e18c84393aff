"""Sparse symmetric matrices condensed exactly onto a few unknowns: MKL Pardiso's Schur complement, or
SuperLU where there is none.
"""

from __future__ import annotations

import copy
import ctypes
import weakref
from functools import cache

import numpy as np
import scipy.sparse as sp

try:
    from pypardiso import PyPardisoSolver
    from pypardiso.pardiso_wrapper import PyPardisoError
except (ImportError, OSError):
    PyPardisoSolver = None

DEFINITE, INDEFINITE = 2, -2
"""Kinds of real symmetric matrices, by MKL Pardiso's numbers."""
FACTORISE, FORWARD, DIAGONAL, BACKWARD = 22, 331, 332, 333
"""Phases, by MKL Pardiso's numbers."""


class Condensation:
    """Matrices of one pattern, A = [[A_ii, A_ik], [A_ki, A_kk]], with the inner unknowns i eliminated.

    kept: (n,) bool, the unknowns k that stay. A x = b is solved in two halves: `forward` gives
    b_k - A_ki A_ii^-1 b_i, and once x_k is known, from whatever more acts on the kept unknowns, `backward`
    gives all of x.
    """

    def __init__(self, kept: np.ndarray) -> None:
        self.kept = np.asarray(kept, dtype=bool)
        self._solvers: dict[int, _Pardiso] = {}
        self._solver: _Pardiso | _SuperLU | None = None

    def refresh(self, upper: sp.csr_matrix) -> np.ndarray:
        """Factorise A, given by its upper triangle (CSR, sorted); the Schur complement (m, m) of the kept.

        The fill-reducing ordering of the first matrix serves all later ones. Nearly every tangent is positive
        definite, and Cholesky takes two thirds of the time; the others get LDL'.
        """
        if PyPardisoSolver is None:
            self._solver = _SuperLU(upper, self.kept)
            return self._solver.schur
        try:
            return self._factorise(upper, DEFINITE)
        except PyPardisoError:
            return self._factorise(upper, INDEFINITE)

    def _factorise(self, upper: sp.csr_matrix, kind: int) -> np.ndarray:
        if kind not in self._solvers:
            self._solvers[kind] = _Pardiso(kind, upper, self.kept)
        self._solver = solver = self._solvers[kind]
        return solver.factorise(upper)

    def forward(self, b: np.ndarray) -> np.ndarray:
        """(n,) what `backward` needs of b (n,); its kept entries are b_k - A_ki A_ii^-1 b_i."""
        assert self._solver is not None, "refresh comes first"
        return self._solver.forward(b)

    def backward(self, half: np.ndarray, kept: np.ndarray) -> np.ndarray:
        """x (n,) whose kept entries are `kept` (m,), from the result of `forward`."""
        assert self._solver is not None, "refresh comes first"
        return self._solver.backward(half, kept)


class _Pardiso:
    """One of MKL Pardiso's solvers; it keeps its ordering, and its factors live outside Python's memory."""

    def __init__(self, kind: int, upper: sp.csr_matrix, kept: np.ndarray) -> None:
        solver = copy.copy(_prototype())
        solver.pt, solver.mtype = np.zeros_like(solver.pt), kind
        solver.iparm = np.zeros(64, dtype=np.int32)
        # our own settings (1), nested dissection (2), perturbed pivots (10), no count of nonzeros (18); the
        # Schur complement with factors for later solves (36); no iterative refinement, which doubles a solve
        for number, value in ((1, 1), (2, 2), (10, 13 if kind == DEFINITE else 8), (36, 2)):
            solver.iparm[number - 1] = value
        solver.perm = kept.astype(np.int32)
        self._solver, self._kept, self._kind = solver, kept, kind
        self._upper = upper
        nothing = np.zeros((upper.shape[0], 1), order="F")
        weakref.finalize(self, solver.free_memory, everything=True)
        solver.set_phase(11)
        solver._call_pardiso(upper, nothing)

    def factorise(self, upper: sp.csr_matrix) -> np.ndarray:
        self._upper = upper
        size = int(self._kept.sum())
        schur = np.zeros((size, size))
        self._call(FACTORISE, np.zeros(upper.shape[0]), schur)
        return (schur + schur.T) / 2

    def forward(self, b: np.ndarray) -> np.ndarray:
        return self._call(FORWARD, b, np.zeros_like(b))

    def backward(self, half: np.ndarray, kept: np.ndarray) -> np.ndarray:
        half = half.copy()
        if self._kind == INDEFINITE:
            half = self._call(DIAGONAL, half, np.zeros_like(half))
        half[self._kept] = kept
        return self._call(BACKWARD, half, np.zeros_like(half))

    def _call(self, phase: int, b: np.ndarray, x: np.ndarray) -> np.ndarray:
        solver, upper, error = self._solver, self._upper, ctypes.c_int32(0)
        whole, real = ctypes.POINTER(ctypes.c_int32), ctypes.POINTER(ctypes.c_double)
        one = ctypes.byref(ctypes.c_int32(1))
        indptr, indices = upper.indptr.astype(np.int32) + 1, upper.indices.astype(np.int32) + 1
        solver._mkl_pardiso(
            solver.pt.ctypes.data_as(ctypes.POINTER(solver._pt_type[0])), one, one,
            ctypes.byref(ctypes.c_int32(self._kind)), ctypes.byref(ctypes.c_int32(phase)),
            ctypes.byref(ctypes.c_int32(upper.shape[0])), upper.data.ctypes.data_as(real),
            indptr.ctypes.data_as(whole), indices.ctypes.data_as(whole), solver.perm.ctypes.data_as(whole),
            one, solver.iparm.ctypes.data_as(whole), ctypes.byref(ctypes.c_int32(0)),
            np.ascontiguousarray(b).ctypes.data_as(real), x.ctypes.data_as(real), ctypes.byref(error),
        )  # fmt: skip
        if error.value:
            raise PyPardisoError(error.value)
        return x


@cache
def _prototype() -> PyPardisoSolver:
    """Found once: every new solver would look through the whole installation for the library."""
    return PyPardisoSolver()


class _SuperLU:
    """The same with SciPy alone; slower."""

    def __init__(self, upper: sp.csr_matrix, kept: np.ndarray) -> None:
        full = (upper + sp.triu(upper, 1).T).tocsr()
        self._kept, inner = kept, ~kept
        self._across = full[inner][:, kept]
        self._inner = sp.linalg.splu(full[inner][:, inner].tocsc(), permc_spec="MMD_AT_PLUS_A")
        self._solved = self._inner.solve(self._across.toarray())
        self.schur = full[kept][:, kept].toarray() - self._across.T @ self._solved

    def forward(self, b: np.ndarray) -> np.ndarray:
        half = np.empty_like(b)
        half[~self._kept] = self._inner.solve(b[~self._kept])
        half[self._kept] = b[self._kept] - self._across.T @ half[~self._kept]
        return half

    def backward(self, half: np.ndarray, kept: np.ndarray) -> np.ndarray:
        x = half.copy()
        x[self._kept] = kept
        x[~self._kept] -= self._solved @ kept
        return x
