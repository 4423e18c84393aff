"""Sparse symmetric matrices condensed exactly onto few unknowns, by MKL Pardiso or SciPy."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from palpate.mechanics.elastic import pardiso


class SuperLuFactor:
    """pardiso.PartialFactor with SciPy alone; slower."""

    def __init__(self, upper: sp.csr_matrix, kept: np.ndarray) -> None:
        self._pattern, self._kept = upper, np.asarray(kept)
        self._inner = np.setdiff1d(np.arange(upper.shape[0]), kept)

    def refresh(self, values: np.ndarray) -> np.ndarray:
        """Factorise the matrix of these values (nnz,); the Schur complement (k, k) on the kept unknowns."""
        upper = sp.csr_matrix((values, self._pattern.indices, self._pattern.indptr), self._pattern.shape)
        full = (upper + sp.triu(upper, 1).T).tocsr()
        self._across = full[self._inner][:, self._kept]
        self._factor = spla.splu(full[self._inner][:, self._inner].tocsc(), permc_spec="MMD_AT_PLUS_A")
        self._solved = self._factor.solve(self._across.toarray())
        schur = full[self._kept][:, self._kept].toarray() - self._across.T @ self._solved
        return 0.5 * (schur + schur.T)

    def forward(self, right: np.ndarray) -> np.ndarray:
        """(n,) what `backward` needs of b (n,); its kept entries are b_k - A_ki A_ii^-1 b_i."""
        half = np.empty_like(right)
        half[self._inner] = self._factor.solve(right[self._inner])
        half[self._kept] = right[self._kept] - self._across.T @ half[self._inner]
        return half

    def backward(self, half: np.ndarray, kept: np.ndarray) -> np.ndarray:
        """x (n,) whose kept entries are `kept` (k,), from the result of `forward`."""
        x = half.copy()
        x[self._kept] = kept
        x[self._inner] -= self._solved @ kept
        return x


def partial_factor(upper: sp.csr_matrix, kept: np.ndarray) -> pardiso.PartialFactor | SuperLuFactor:
    """A factor of matrices of this pattern that keeps the unknowns `kept` (k,), ascending, to the last."""
    return pardiso.PartialFactor(upper, kept) if pardiso.available() else SuperLuFactor(upper, kept)
