"""A sparse symmetric factorisation whose ordering is found once: MKL Pardiso, or SuperLU where
there is none.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

try:
    from pypardiso import PyPardisoSolver
    from pypardiso.pardiso_wrapper import PyPardisoError
except (ImportError, OSError):
    PyPardisoSolver = None

DEFINITE, INDEFINITE = 2, -2
"""Kinds of real symmetric matrices, by MKL Pardiso's numbers."""


class Factor:
    """Factorise symmetric matrices of one pattern, given by their upper triangles (CSR, sorted)."""

    def __init__(self) -> None:
        self._solvers: dict[int, PyPardisoSolver] = {}
        self._back: Callable[[np.ndarray], np.ndarray] | None = None

    def refresh(self, upper: sp.csr_matrix) -> None:
        """Factorise; the fill-reducing ordering of the first matrix serves all later ones.

        Nearly every tangent is positive definite, and Cholesky takes two thirds of the time; the others get
        LDL'.
        """
        if PyPardisoSolver is None:
            full = upper + sp.triu(upper, 1).T
            self._back = sp.linalg.splu(full.tocsc(), permc_spec="MMD_AT_PLUS_A").solve
            return
        try:
            self._factorise(upper, DEFINITE)
        except PyPardisoError:
            self._factorise(upper, INDEFINITE)

    def _factorise(self, upper: sp.csr_matrix, kind: int) -> None:
        nothing = np.zeros((upper.shape[0], 1), order="F")
        solver = self._solvers.get(kind)
        if solver is None:
            solver = self._solvers[kind] = PyPardisoSolver(mtype=kind)
            # the factors live outside Python's memory
            weakref.finalize(self, solver.free_memory, everything=True)
            solver.set_phase(11)
            solver._call_pardiso(upper, nothing)
        solver.set_phase(22)
        solver._call_pardiso(upper, nothing)

        def back(b: np.ndarray) -> np.ndarray:
            solver.set_phase(33)
            right = np.asfortranarray(b.reshape(len(b), -1))
            return solver._call_pardiso(upper, right).reshape(b.shape)

        self._back = back

    def solve(self, b: np.ndarray) -> np.ndarray:
        """x with (matrix) x = b, b (n,) or (n, k); after `refresh`."""
        assert self._back is not None, "refresh comes first"
        return self._back(b)
