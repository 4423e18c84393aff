"""A local change of modulus as a low-rank change of the compliance: no new precompute.

With K' = K + P dK P' on the d degrees of freedom of the changed elements (Woodbury, exact):
    C' = C - X M X',  X = W K^-1 P,  M = (I + dK G)^-1 dK,  G = P' K^-1 P,
where W reads the outputs (nodes or patch means). X and G are solved for once for a whole region, and X is
split into Q R, less what no output tells apart. R M R' itself has a low rank and is found from
its action on random vectors (Halko, Martinsson & Tropp 2011), checked on fresh ones. Afterwards any change
inside costs dense algebra of the size of what changed. Exact to about 1e-7 of the greatest entry.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from palpate.mechanics.elastic.elasticity import element_stiffness
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import MeshError
from palpate.mechanics.progress import Progress, silent

_COLUMNS = 96
_NEGLIGIBLE = 1e-6  # singular values of X over the greatest one
_PROBES = 240  # directions in which a change of a few centimetres is sought, before all are
_MISSED = 1e-7


class StiffenedElements:
    """Green's functions of some elements, for changing their moduli again and again.

    solver: of the unchanged object. elements: (e,) those that may change; `extend` adds to them. outputs:
    (q, n) sparse, rows of weights over the nodes (a selection of nodes, or patch means). Costs a solve a
    degree of freedom of the region.
    """

    def __init__(
        self, solver: Solver, elements: np.ndarray, outputs: sp.csr_matrix, *, progress: Progress = silent
    ) -> None:
        self._solver = solver
        self._outputs = sp.kron(outputs, sp.eye(3), format="csr")[:, solver.free]
        dofs = 3 * len(solver.mesh.points)
        self._place = np.full(dofs, -1)  # among the free; held nodes never move
        self._place[solver.free] = np.arange(len(solver.free))
        self._column = np.full(dofs, -1)  # among those that were solved for
        self._places = np.zeros(0, dtype=np.int64)
        self._green = np.zeros((0, 0))
        self._read = np.zeros((self._outputs.shape[0], 0))
        k = 3 * solver.mesh.tetrahedra.shape[1]
        self.elements = np.zeros(0, dtype=np.int64)
        self._element_dofs = np.zeros((0, k), dtype=np.int64)
        self._matrices = np.zeros((0, k, k))
        self.extend(elements, progress)
        if not len(self._places):
            raise MeshError("the region holds no node that can move")

    def extend(self, elements: np.ndarray, progress: Progress = silent) -> None:
        """Let further elements change, after those that may already: a solve a degree of freedom is new."""
        solver, mesh = self._solver, self._solver.mesh
        elements = np.asarray(elements)
        new = elements[~np.isin(elements, self.elements)]
        if not len(new):
            return
        k = self._matrices.shape[1]
        matrices = element_stiffness(
            mesh.points[mesh.tetrahedra[new][:, :4]], mesh.order, solver.poisson_ratio
        )
        matrices = matrices.reshape(len(new), k, k)
        if solver.modulus_ratio is not None:
            matrices = matrices * solver.modulus_ratio[new][:, None, None]
        dofs = (3 * mesh.tetrahedra[new][:, :, None] + np.arange(3)).reshape(-1, k)
        unsolved = np.unique(dofs)
        unsolved = unsolved[(self._place[unsolved] >= 0) & (self._column[unsolved] < 0)]
        self._solve(unsolved, progress)
        self.basis, self._mixed = _split(self._read)
        self.elements = np.concatenate([self.elements, new])
        self._element_dofs = np.concatenate([self._element_dofs, dofs])
        self._matrices = np.concatenate([self._matrices, matrices])
        self._local = self._column[self._element_dofs]

    def _solve(self, dofs: np.ndarray, progress: Progress) -> None:
        """Green's functions of further degrees of freedom, after those that are there."""
        before, place = len(self._places), self._place[dofs]
        self._places = np.concatenate([self._places, place])
        self._column[dofs] = before + np.arange(len(dofs))
        d = len(self._places)
        green, read = np.empty((d, d)), np.empty((len(self._read), d))
        green[:before, :before], read[:, :before] = self._green, self._read
        for start in range(0, len(dofs), _COLUMNS):
            part = slice(start, min(start + _COLUMNS, len(dofs)))
            loads = np.zeros((len(self._solver.free), part.stop - part.start), order="F")
            loads[place[part], np.arange(loads.shape[1])] = 1.0
            moved = self._solver.solve_free(loads)
            green[:, before + part.start : before + part.stop] = moved[self._places]
            read[:, before + part.start : before + part.stop] = self._outputs @ moved
            progress("region", part.stop / len(dofs))
        green[before:, :before] = green[:before, before:].T
        self._green, self._read = green, read

    def change(self, factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(B (3q, r), T (r, r)) for each element's modulus times factor (e,): C' = C - B T B'; float32 B."""
        factor = np.asarray(factor, dtype=float)
        if factor.shape != self.elements.shape or not (factor > 0).all():
            raise MeshError(
                f"factor must hold {len(self.elements)} positive values, one an element of the region"
            )
        changed = np.flatnonzero(factor != 1)
        local = self._local[changed]
        used = np.unique(local)
        used = used[used >= 0]
        size = len(used)
        index = np.full(len(self._places) + 1, size)  # the last place collects held degrees of freedom
        index[used] = np.arange(size)
        rows = index[local]
        flat = (rows[:, :, None] * (size + 1) + rows[:, None, :]).ravel()
        values = self._matrices[changed] * (factor[changed] - 1)[:, None, None]
        delta = np.bincount(flat, values.ravel(), (size + 1) ** 2).reshape(size + 1, size + 1)[:-1, :-1]
        system = np.eye(size) + self._green[np.ix_(used, used)] @ delta
        lu = la.lu_factor(system, overwrite_a=True, check_finite=False)
        mixed = self._mixed[:, used]

        def apply(vectors: np.ndarray) -> np.ndarray:
            return mixed @ (delta @ la.lu_solve(lu, mixed.T @ vectors, check_finite=False))

        k = len(mixed)
        if k > 1.5 * _PROBES:
            seen = apply(np.random.default_rng(0).normal(size=(k, _PROBES + 4)))
            range_ = la.qr(seen[:, :_PROBES], mode="economic", check_finite=False)[0]
            fresh = seen[:, _PROBES:]
            missed = np.linalg.norm(fresh - range_ @ (range_.T @ fresh)) / np.linalg.norm(fresh)
            if missed < _MISSED:
                middle = range_.T @ apply(range_)
                return self.basis @ range_.astype(np.float32), 0.5 * (middle + middle.T)
        middle = apply(np.eye(k))
        return self.basis, 0.5 * (middle + middle.T)

    def updated(self, compliance: np.ndarray, factor: np.ndarray) -> np.ndarray:
        """The compliance (3q, 3q) of the outputs after the change, in its own type."""
        basis, middle = self.change(factor)
        return compliance - (basis @ middle.astype(np.float32)) @ basis.T


def _split(seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(Q (p, k) float32, R (k, d)) with seen = Q R but for what is negligible."""
    wide = seen.shape[0] <= seen.shape[1]
    squares, vectors = la.eigh(seen @ seen.T if wide else seen.T @ seen, check_finite=False)
    vectors = vectors[:, squares > _NEGLIGIBLE**2 * squares[-1]]
    if wide:
        return vectors.astype(np.float32), vectors.T @ seen
    q = seen @ vectors
    size = np.linalg.norm(q, axis=0)
    return (q / size).astype(np.float32), size[:, None] * vectors.T
