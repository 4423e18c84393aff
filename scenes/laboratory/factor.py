"""A sparse symmetric factorisation whose ordering is found once: MKL Pardiso, or SuperLU where
there is none.
"""

from __future__ import annotations

import weakref

import numpy as np
import scipy.sparse as sp

try:
    from pypardiso import PyPardisoSolver
except (ImportError, OSError):
    PyPardisoSolver = None


class Factor:
    """Factorise symmetric matrices of one pattern, given by their upper triangles (CSR, sorted)."""

    def __init__(self) -> None:
        self._solver = None
        self._matrix: sp.csr_matrix | None = None

    def refresh(self, upper: sp.csr_matrix) -> None:
        """Factorise; the fill-reducing ordering of the first matrix serves all later ones."""
        if PyPardisoSolver is None:
            full = upper + sp.triu(upper, 1).T
            self._solver = sp.linalg.splu(full.tocsc(), permc_spec="MMD_AT_PLUS_A")
            return
        first = self._solver is None
        if first:
            self._solver = PyPardisoSolver(mtype=-2)
            # the factors live outside Python's memory
            weakref.finalize(self, self._solver.free_memory, everything=True)
        self._matrix = upper
        nothing = np.zeros((upper.shape[0], 1), order="F")
        if first:
            self._solver.set_phase(11)
            self._solver._call_pardiso(upper, nothing)
        self._solver.set_phase(22)
        self._solver._call_pardiso(upper, nothing)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """x with (matrix) x = b, b (n,) or (n, k)."""
        if PyPardisoSolver is None:
            return self._solver.solve(b)
        right = np.asfortranarray(b.reshape(len(b), -1))
        self._solver.set_phase(33)
        return self._solver._call_pardiso(self._matrix, right).reshape(b.shape)
