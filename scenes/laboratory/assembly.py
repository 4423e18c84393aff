"""The stiffness of a solid among its free degrees of freedom, assembled from its elements on one pattern."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp


class Assembly:
    """Where every element entry goes in the upper triangle of the free stiffness, found once.

    cells: (m, 10) node numbers. free: (3 n,) bool. springs: (3 n,) support stiffness on the diagonal, or
    None. pattern: that triangle, CSR, sorted.
    """

    def __init__(self, cells: np.ndarray, free: np.ndarray, springs: np.ndarray | None = None) -> None:
        self.free, self.springs = free, springs
        self.dofs = (3 * cells[:, :, None] + np.arange(3)).reshape(len(cells), 30)
        number = np.full(free.size, -1)
        n = int(free.sum())
        number[free] = np.arange(n)
        row = np.repeat(number[self.dofs], 30, axis=1)
        column = np.tile(number[self.dofs], (1, 30))
        self._use = (row >= 0) & (column >= row)
        keys = np.concatenate([(row * np.int64(n) + column)[self._use], np.arange(n) * np.int64(n + 1)])
        unique, self._into = np.unique(keys, return_inverse=True)
        indptr = np.searchsorted(unique // n, np.arange(n + 1)).astype(np.int32)
        indices = (unique % n).astype(np.int32)
        self.pattern = sp.csr_matrix((np.zeros(len(unique)), indices, indptr), shape=(n, n))

    def stiffness(self, elements: np.ndarray) -> np.ndarray:
        """(nnz,) values of `pattern` from element stiffness (m, 30, 30), springs with them."""
        diagonal = np.zeros(self.pattern.shape[0]) if self.springs is None else self.springs[self.free]
        values = np.concatenate([elements.reshape(len(elements), -1)[self._use], diagonal])
        return np.bincount(self._into, values, minlength=self.pattern.nnz)

    def residual(self, elements: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """(free,) resisting forces from those of the elements (m, 30), springs with them."""
        r = np.bincount(self.dofs.ravel(), elements.ravel(), minlength=self.free.size)
        if self.springs is not None:
            r += self.springs * displacement.ravel()
        return r[self.free]
