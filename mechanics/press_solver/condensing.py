"""Stiffness assembled on one pattern and condensed exactly onto few unknowns, by MKL Pardiso or SciPy."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from mechanics.elastic import pardiso


class Assembly:
    """Where every element entry goes in the upper triangle of the stiffness of the free unknowns, found once.

    cells: (m, 10) node numbers. number: (3 n,) the unknown of each degree of freedom, -1 where it is held.
    dense: unknowns (k,) that a dense block joins, ascending, or none.
    """

    def __init__(self, cells: np.ndarray, number: np.ndarray, dense: np.ndarray | None = None) -> None:
        self.dofs = number[(3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), 30)]
        self.size = int(number.max()) + 1
        n = np.int64(self.size)
        row, column = np.repeat(self.dofs, 30, axis=1), np.tile(self.dofs, (1, 30))
        self._use = np.flatnonzero((row >= 0) & (column >= row))
        keys = [row.ravel()[self._use] * n + column.ravel()[self._use], np.arange(n) * (n + 1)]
        dense = np.zeros(0, dtype=np.int64) if dense is None else dense
        self._triangle = np.triu_indices(len(dense))
        keys.append(dense[self._triangle[0]] * n + dense[self._triangle[1]])
        unique, into = np.unique(np.concatenate(keys), return_inverse=True)
        self._into, self._block = into[: len(self._use)], into[len(self._use) + self.size :]
        indptr = np.searchsorted(unique // n, np.arange(n + 1)).astype(np.int32)
        indices = (unique % n).astype(np.int32)
        self.pattern = sp.csr_matrix((np.zeros(len(unique)), indices, indptr), shape=(n, n))
        self._constant = np.zeros(len(unique))

    def add_block(self, block: np.ndarray) -> None:
        """A dense stiffness (k, k) of the `dense` unknowns that stays the same."""
        self._constant[self._block] += block[self._triangle]

    def values(self, stiffness: np.ndarray) -> np.ndarray:
        """(nnz,) of the pattern, from the elements' stiffness (m, 30, 30)."""
        each = stiffness.reshape(-1)[self._use]
        return self._constant + np.bincount(self._into, each, minlength=len(self._constant))

    def gathered(self, forces: np.ndarray) -> np.ndarray:
        """(size,) sums of the elements' forces (m, 30) over the free unknowns."""
        held = self.dofs < 0
        return np.bincount(
            np.where(held, self.size, self.dofs).ravel(), forces.ravel(), minlength=self.size + 1
        )[: self.size]


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


class Condensed:
    """A dense system (k, k) condensed onto its unknowns `few`, ascending, when the others carry nothing more.

    stiffness: (f, f).
    """

    def __init__(self, dense: np.ndarray, few: np.ndarray) -> None:
        self._few, self._others = few, np.setdiff1d(np.arange(len(dense)), few)
        self.stiffness = dense[np.ix_(few, few)]
        if len(self._others):
            self._across = dense[np.ix_(self._others, few)]
            self._factor = la.cho_factor(
                dense[np.ix_(self._others, self._others)], lower=True, check_finite=False
            )
            self._solved = la.cho_solve(self._factor, self._across, check_finite=False)
            self.stiffness = self.stiffness - self._across.T @ self._solved

    def pull(self, load: np.ndarray) -> np.ndarray:
        """(f,) what a load (k,) is on the few."""
        if not len(self._others):
            return load
        return load[self._few] - self._solved.T @ load[self._others]

    def spread(self, few: np.ndarray, load: np.ndarray) -> np.ndarray:
        """(k,) all unknowns from the few, under that load."""
        if not len(self._others):
            return few
        whole = np.empty(len(load))
        own = la.cho_solve(self._factor, load[self._others], check_finite=False)
        whole[self._few], whole[self._others] = few, own - self._solved @ few
        return whole
