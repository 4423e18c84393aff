"""Stiffness assembled on one pattern, and dense systems condensed exactly onto few unknowns."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp


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
