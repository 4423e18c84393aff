"""Stiffness assembled on one pattern, and dense systems condensed exactly onto few unknowns.

A body in two zones: near a tip at finite strain, the rest linear and condensed onto what joins them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from palpate.mechanics.elastic.partial_factor import partial_factor
from palpate.mechanics.press_solver.graded_mesh import GradedMesh
from palpate.mechanics.press_solver.solid import Response, SolidElements


class BodyAssembly:
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


@dataclass(frozen=True)
class BodyMaterial:
    """poisson_ratio; stiffening and coupled: the law at finite strain (Solid); ratio: (m,) modulus of each
    cell over the global one; local_bulk: see Solid."""

    poisson_ratio: float
    stiffening: float
    coupled: bool
    ratio: np.ndarray
    local_bulk: float = 0.0


class PressedBody:
    """A graded mesh with a material, condensed as far as it can be.

    near: (m,) bool, the cells that are solved at finite strain; none of them: the small-strain solid.
    kept_nodes: (c,) nodes that a tip may press, ascending; where cells are near, of these.
    Displacements are those of the free unknowns (size,); `kept` tells which of these a tip may press.
    """

    def __init__(
        self, mesh: GradedMesh, material: BodyMaterial, near: np.ndarray, kept_nodes: np.ndarray
    ) -> None:
        def solid(cells: np.ndarray) -> SolidElements:
            law = (material.poisson_ratio, material.stiffening, material.ratio[cells], material.coupled)
            return SolidElements(mesh.points, mesh.cells[cells], *law, material.local_bulk)

        self._count = len(mesh.points)
        free = ~mesh.fixed
        mine = np.unique(mesh.cells[near]) if near.any() else kept_nodes
        self.number = _numbered(mine[free[mine]], self._count)
        self.size = int(self.number.max()) + 1
        self._free = np.flatnonzero(self.number >= 0)
        kept = self.number.reshape(-1, 3)[kept_nodes].ravel()
        self.kept = kept[kept >= 0]
        self._near = solid(np.flatnonzero(near))
        far = np.flatnonzero(~near)
        shared = np.zeros(0, dtype=np.int64)
        block = np.zeros((0, 0))
        if len(far):
            rest = np.unique(mesh.cells[far])
            joint = np.intersect1d(rest, mine) if near.any() else kept_nodes
            joint = joint[free[joint]]
            shared = self.number.reshape(-1, 3)[joint].ravel()
            block = self._condensed(mesh, solid(far), rest[free[rest]], joint)
        self._shared, self._block = shared, block
        if len(self._near):
            self._assembly = BodyAssembly(self._near.cells, self.number, shared)
            self._assembly.add_block(block)
            self._factor = partial_factor(self._assembly.pattern, self.kept)
        self._schur: np.ndarray | None = None if len(self._near) else block

    def _condensed(
        self, mesh: GradedMesh, rest: SolidElements, nodes: np.ndarray, joint: np.ndarray
    ) -> np.ndarray:
        number = _numbered(nodes, self._count)
        assembly = BodyAssembly(rest.cells, number)
        response = rest.respond(np.zeros_like(mesh.points), tangent=True)
        assert response is not None
        factor = partial_factor(assembly.pattern, number.reshape(-1, 3)[joint].ravel())
        return factor.refresh(assembly.values(response.stiffness))

    @property
    def linear(self) -> bool:
        """Whether every cell is at small strain: its stiffness never changes."""
        return not len(self._near)

    def whole(self, u: np.ndarray) -> np.ndarray:
        """(n, 3) m of all nodes of the mesh from the unknowns (size,); zero elsewhere."""
        all_of_it = np.zeros(3 * self._count)
        all_of_it[self._free] = u
        return all_of_it.reshape(-1, 3)

    def resist(self, u: np.ndarray) -> tuple[np.ndarray, float, Response | None] | None:
        """(resisting forces (size,), stored energy, the elements' answer), in units of Young's modulus; None
        where an element is turned inside out."""
        far = self._block @ u[self._shared]
        forces, energy = np.zeros(self.size), 0.5 * float(u[self._shared] @ far)
        forces[self._shared] = far
        if self.linear:
            return forces, energy, None
        response = self._near.respond(self.whole(u))
        if response is None:
            return None
        return forces + self._assembly.gathered(response.forces), energy + response.energy, response

    def foretold_pressure(self, response: Response | None, step: np.ndarray) -> np.ndarray | None:
        """(m,) what Newton's method makes of the elements' pressures in a step (size,) of the unknowns."""
        if response is None:
            return None
        local = self.whole(step)[self._near.cells].reshape(-1, 30)
        return response.pressure + response.slope * np.einsum("er,er->e", response.growth, local)

    def linearise(self, u: np.ndarray, pressure: np.ndarray | None) -> bool:
        """Take the tangent at u, with these pressures in it; whether it could be taken."""
        if self.linear:
            return True
        response = self._near.respond(self.whole(u), tangent=True, pressure=pressure)
        if response is None:
            return False
        self._schur = self._factor.refresh(self._assembly.values(response.stiffness))
        return True

    @property
    def schur(self) -> np.ndarray:
        """(k, k) stiffness of the kept unknowns, of the last tangent."""
        assert self._schur is not None, "linearise comes first"
        return self._schur

    def forward(self, right: np.ndarray) -> np.ndarray:
        """See pardiso.PartialFactor."""
        return right if self.linear else self._factor.forward(right)

    def backward(self, half: np.ndarray, kept: np.ndarray) -> np.ndarray:
        """See pardiso.PartialFactor."""
        return kept if self.linear else self._factor.backward(half, kept)


def _numbered(nodes: np.ndarray, count: int) -> np.ndarray:
    """(3 count,) numbers of the unknowns of `nodes`, in their order; -1 elsewhere."""
    number = np.full((count, 3), -1)
    number[nodes] = np.arange(3 * len(nodes)).reshape(-1, 3)
    return number.ravel()
