"""Factorise a mesh's stiffness once, then solve many loads: MKL Pardiso where present, SuperLU elsewhere."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from palpate.mechanics.elastic import pardiso
from palpate.mechanics.elastic.dissected import DissectedFactor, products
from palpate.mechanics.elastic.elasticity import LOCAL_BULK, stiffness_blocks
from palpate.mechanics.elastic.held_base import BaseHold
from palpate.mechanics.elastic.membrane import membrane_stiffness
from palpate.mechanics.errors import MeshError, OptionError
from palpate.mechanics.shape.tetmesh import TetMesh

BACKENDS = ("pardiso", "superlu")
LARGE = 8_000
"""Nodes from which a mesh is dissected by us: below, that costs more than it saves."""


class Solver:
    """Displacements for nodal forces on a mesh with a fixed base, for unit Young's modulus.

    modulus_ratio: (m,) or None. backend: 'pardiso', 'superlu' or None for the best that is there.
    local_bulk: see `element_stiffness`. hold: how the base is held; None: bonded. stretch_m: of a skin
    (mechanics.elastic.membrane). The factorisation is done in the constructor. Raises MeshError where nothing
    is fixed (rigid motion).
    """

    def __init__(
        self,
        mesh: TetMesh,
        poisson_ratio: float,
        modulus_ratio: np.ndarray | None = None,
        *,
        backend: str | None = None,
        local_bulk: float = LOCAL_BULK,
        hold: BaseHold | None = None,
        stretch_m: float = 0.0,
    ) -> None:
        self.mesh = mesh
        self.poisson_ratio = poisson_ratio
        self.hold = hold
        self.modulus_ratio = None if modulus_ratio is None else np.asarray(modulus_ratio, dtype=float)
        self.backend = backend or ("pardiso" if pardiso.available() else "superlu")
        if self.backend not in BACKENDS:
            raise OptionError(f"backend is '{backend}'; allowed are {', '.join(BACKENDS)}")
        self.free = free_dofs(mesh, hold)
        full = stiffness_blocks(mesh, poisson_ratio, modulus_ratio, local_bulk=local_bulk)
        springs = None if hold is None else hold.stiffness(mesh)
        if springs is not None:
            full = full + springs.tobsr((3, 3))
        if stretch_m:
            ratio = 1.0 if self.modulus_ratio is None else self.modulus_ratio[mesh.touchable_elements]
            full = full + membrane_stiffness(mesh, poisson_ratio, stretch_m * ratio).tobsr((3, 3))
        self.matrix = _of_nodes(full, self.free[::3] // 3)
        self._factor: Any
        try:
            if self.backend == "pardiso" and len(self.free) < 3 * LARGE:
                self._factor = pardiso.Pardiso(self.matrix, group=3)
            elif self.backend == "pardiso":
                self._factor = DissectedFactor(self.matrix)
            else:
                self._factor = spla.splu(
                    self.matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
                )
        except (ArithmeticError, RuntimeError) as error:
            raise MeshError(
                f"the stiffness cannot be factorised ({error}): fix at least three nodes that are not in "
                "line, in every connected part of the mesh"
            ) from error

    @property
    def uniform(self) -> bool:
        """Whether all elements are of one modulus."""
        ratio = self.modulus_ratio
        return ratio is None or not np.ptp(ratio) > 1e-9 * ratio.max()

    @cached_property
    def plain(self) -> Solver:
        """The same object of unit modulus throughout: another factorisation, made once."""
        return Solver(self.mesh, self.poisson_ratio, hold=self.hold)

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Nodal displacements times the modulus, m Pa; forces (n, 3) or (n, 3, r), N."""
        forces = np.asarray(forces, dtype=float)
        flat = forces.reshape(3 * len(self.mesh.points), -1)
        result = np.zeros_like(flat)
        result[self.free] = self.solve_free(flat[self.free]).reshape(len(self.free), -1)
        return result.reshape(forces.shape)

    def quadratic_forms(self, right: np.ndarray | sp.csr_matrix) -> np.ndarray:
        """(r, c, c) of r groups of c loads (f, r, c) over the free degrees of freedom: b' K^-1 b, N^2 / m.

        Sparse (f, 3 r): groups of three. Half the cost of solving, and a third of that for loads on few nodes
        of a large mesh, where the factor is Pardiso's. What a group gives does not hang, to the bit, on which
        others there are.
        """
        if isinstance(right, sp.csr_matrix):
            f, r, c = right.shape[0], right.shape[1] // 3, 3
        else:
            f, r, c = right.shape
            right = right.transpose(1, 2, 0).reshape(r * c, f).T  # without a copy where it is in this order
        if isinstance(self._factor, DissectedFactor):
            return self._factor.quadratic_forms(sp.csr_matrix(right), c)
        flat: np.ndarray = right.toarray(order="F") if isinstance(right, sp.csr_matrix) else right
        if self.backend == "pardiso":
            return products(self._factor.half_solve(flat), c)
        solution = self.solve_free(flat).reshape(f, r, c)
        result = np.einsum("fri,frj->rij", flat.reshape(f, r, c), solution, optimize=True)
        return 0.5 * (result + result.transpose(0, 2, 1))

    def solve_free(self, right: np.ndarray) -> np.ndarray:
        """Solutions (f, r) for right-hand sides (f, r) over the free degrees of freedom (`.free`,
        ascending)."""
        return self._factor.solve(np.asfortranarray(right, dtype=float))


def _of_nodes(matrix: sp.bsr_matrix, nodes: np.ndarray) -> sp.csr_matrix:
    """(3k, 3k), the rows and columns of nodes (k,)."""
    n = matrix.shape[0] // 3
    place = np.arange(len(matrix.indices))
    kept = sp.csr_matrix((place, matrix.indices, matrix.indptr), shape=(n, n))[nodes][:, nodes]
    size = 3 * len(nodes)
    return sp.bsr_matrix((matrix.data[kept.data], kept.indices, kept.indptr), shape=(size, size)).tocsr()


def free_dofs(mesh: TetMesh, hold: BaseHold | None = None) -> np.ndarray:
    """Indices of the degrees of freedom that are not fixed and belong to some element."""
    used = np.zeros(len(mesh.points), dtype=bool)
    used[mesh.tetrahedra.ravel()] = True
    if mesh.fixed[used].sum() < 3:
        raise MeshError("fewer than 3 nodes are fixed: the object would move as a rigid body")
    held = mesh.fixed if hold is None else hold.held_nodes(mesh)
    nodes = np.flatnonzero(used & ~held)
    return (3 * nodes[:, None] + np.arange(3)).ravel()
