"""A local change of modulus as a low-rank change of the compliance: no new precompute.

With K' = K + P dK P' on the d degrees of freedom of the changed elements (Woodbury, exact):
    C' = C - X M X',  X = W K^-1 P,  M = (I + dK G)^-1 dK,  G = P' K^-1 P,
where W reads the outputs (nodes or patch means). X and G are solved for once for a whole region;
afterwards any change inside it costs dense algebra of its own size.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from mechanics.elasticity import element_stiffness
from mechanics.errors import MeshError
from mechanics.progress import Progress, silent
from mechanics.solver import Solver
from mechanics.tetmesh import TetMesh

_COLUMNS = 96

# points that share a tetrahedron evenly: centres of the 20 tetrahedra and holes of a cut in three
_GRID = np.array(
    [[i, j, k, 3 - i - j - k] for i in range(4) for j in range(4 - i) for k in range(4 - i - j)], dtype=float
)
_SAMPLES = (_GRID + 0.25) / 4


def share_inside(mesh: TetMesh, centre_m: np.ndarray, radius_m: float) -> np.ndarray:
    """(m,) share of each tetrahedron that lies in a sphere, from 20 points in each."""
    corners = mesh.points[mesh.tetrahedra[:, :4]]
    points = np.einsum("qc,mcx->mqx", _SAMPLES, corners)
    return (np.linalg.norm(points - centre_m, axis=2) < radius_m).mean(axis=1)


def inclusion_ratio(mesh: TetMesh, centre_m: np.ndarray, radius_m: float, modulus_ratio: float) -> np.ndarray:
    """(m,) modulus over the global one of a sphere `modulus_ratio` times as stiff.

    A tetrahedron that the sphere cuts takes the geometric mean by volume, between the bounds of Voigt and
    Reuss.
    """
    return modulus_ratio ** share_inside(mesh, centre_m, radius_m)


class Region:
    """Green's functions of some elements, for changing their moduli again and again.

    solver: of the unchanged object. elements: (e,) those that may change. outputs: (q, n) sparse, rows of
    weights over the nodes (a selection of nodes, or patch means). Costs a solve a degree of freedom of the
    region.
    """

    def __init__(
        self, solver: Solver, elements: np.ndarray, outputs: sp.csr_matrix, *, progress: Progress = silent
    ) -> None:
        mesh = solver.mesh
        self.elements = np.asarray(elements)
        nodes = np.unique(mesh.tetrahedra[self.elements])
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        place = np.minimum(np.searchsorted(solver.free, dofs), len(solver.free) - 1)
        kept = solver.free[place] == dofs  # held nodes never move
        self._dofs, place = dofs[kept], place[kept]
        if not len(place):
            raise MeshError("the region holds no node that can move")
        self._matrices = element_stiffness(
            mesh.points[mesh.tetrahedra[self.elements][:, :4]], mesh.order, solver.poisson_ratio
        )
        k = 3 * mesh.tetrahedra.shape[1]
        self._matrices = self._matrices.reshape(len(self.elements), k, k)
        if solver.modulus_ratio is not None:
            self._matrices *= solver.modulus_ratio[self.elements][:, None, None]
        element_dofs = (3 * mesh.tetrahedra[self.elements][:, :, None] + np.arange(3)).reshape(-1, k)
        local = np.full(3 * len(mesh.points), -1)
        local[self._dofs] = np.arange(len(self._dofs))
        self._local = local[element_dofs]
        read = sp.kron(outputs, sp.eye(3), format="csr")[:, solver.free]
        d = len(place)
        self._green = np.empty((d, d))
        self._read = np.empty((read.shape[0], d))
        for start in range(0, d, _COLUMNS):
            part = slice(start, min(start + _COLUMNS, d))
            loads = np.zeros((len(solver.free), part.stop - start), order="F")
            loads[place[part], np.arange(loads.shape[1])] = 1.0
            moved = solver.solve_free(loads)
            self._green[:, part] = moved[place]
            self._read[:, part] = read @ moved
            progress("region", part.stop / d)

    def change(self, factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(X (3q, d), M (d, d)) for each element's modulus times factor (e,): C' = C - X M X'."""
        factor = np.asarray(factor, dtype=float)
        if factor.shape != self.elements.shape or not (factor > 0).all():
            raise MeshError(
                f"factor must hold {len(self.elements)} positive values, one an element of the region"
            )
        changed = np.flatnonzero(factor != 1)
        used = np.unique(self._local[changed])
        used = used[used >= 0]
        index = np.full(len(self._dofs) + 1, len(used))  # the last place collects held degrees of freedom
        index[used] = np.arange(len(used))
        delta = np.zeros((len(used) + 1, len(used) + 1))
        for element in changed:
            rows = index[self._local[element]]
            delta[np.ix_(rows, rows)] += (factor[element] - 1) * self._matrices[element]
        delta = delta[:-1, :-1]
        green = self._green[np.ix_(used, used)]
        system = np.eye(len(used)) + delta @ green
        middle = la.solve(system, delta)
        return self._read[:, used], 0.5 * (middle + middle.T)

    def updated(self, compliance: np.ndarray, factor: np.ndarray) -> np.ndarray:
        """The compliance (3q, 3q) of the outputs after the change."""
        x, middle = self.change(factor)
        return compliance - (x @ middle) @ x.T

    def updated_own(self, own: np.ndarray, factor: np.ndarray) -> np.ndarray:
        """The diagonal blocks (q, 3, 3) of the outputs after the change."""
        x, middle = self.change(factor)
        x = x.reshape(len(own), 3, -1)
        return own - np.einsum("qad,qbd->qab", x @ middle, x)
