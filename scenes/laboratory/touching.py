"""The stiffness of a solid among its free degrees of freedom, assembled from its elements on one pattern.

What presses on an object's nodes, and the equilibrium of an object that is condensed onto these nodes.

The object may be linear, or a solid at finite strain linearised about some displacement: either answers a
load f on its kept unknowns by u = w - C f, with w what it would do without. The sphere and the floor are
not linearised. Units: mm, E mm^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from palpate.scenes.laboratory.contact import Anchors, SphereContact


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


@dataclass(frozen=True)
class Pressed:
    """An equilibrium of the kept unknowns: displacement u (m,) mm, load (m,) that it resists, force on the
    sphere (3,), the sum of the sizes of all contact forces, and the contact's state.
    """

    u: np.ndarray
    load: np.ndarray
    force: np.ndarray
    scale: float
    grip: Anchors


class Touching:
    """A sphere on the faces that it may meet, and a floor below that only pushes.

    contact: as built for the whole mesh; faces with a node that is not free are left out. free: (3 n,) bool.
    floor: (3 n,) stiffness against negative displacement, or None. kept: (free,) bool, what has to stay of
    the free unknowns.
    """

    def __init__(self, contact: SphereContact, free: np.ndarray, floor: np.ndarray | None = None) -> None:
        nodes = np.unique(contact.faces)
        nodes = nodes[free.reshape(-1, 3)[nodes].all(axis=1)]
        local = np.full(len(contact.points), -1)
        local[nodes] = np.arange(len(nodes))
        faces = local[contact.faces]
        friction = None if contact.friction < 0 else contact.friction
        self.contact = SphereContact(
            contact.points[nodes], faces[(faces >= 0).all(axis=1)], contact.radius, friction
        )
        stays = np.zeros(free.size, dtype=bool)
        mine = (3 * nodes[:, None] + np.arange(3)).ravel()
        stays[mine] = True
        if floor is not None:
            stays |= floor > 0
        self.kept = stays[free]
        rank = np.cumsum(stays) - 1
        self._on_faces = rank[mine]
        self._dofs = self._on_faces[(3 * self.contact.faces[:, :, None] + np.arange(3)).reshape(-1, 18)]
        self._size = int(stays.sum())
        self._floor = np.zeros(self._size) if floor is None else floor[stays]

    def evaluate(
        self, u: np.ndarray, centre: np.ndarray, held: Anchors, arrivals: bool = True
    ) -> tuple[Pressed, np.ndarray]:
        """(load and contact at displacement u (m,), stiffness of every face (k, 18, 18))."""
        forces, face_k, force, grip = self.contact.evaluate(self._of_nodes(u), centre, held, True, arrivals)
        load = np.bincount(self._dofs.ravel(), forces.ravel(), minlength=self._size)
        load += self._floor * np.minimum(u, 0.0)
        return Pressed(u, load, force, float(np.abs(forces).sum()), grip), face_k

    def expect(self, u: np.ndarray, centre: np.ndarray, held: Anchors) -> None:
        """Arrivals that displacement u (m,) brings to the sphere, see SphereContact."""
        self.contact.expect(self._of_nodes(u), centre, held)

    def _of_nodes(self, u: np.ndarray) -> np.ndarray:
        return u[self._on_faces].reshape(-1, 3)

    def settle(
        self, compliance: np.ndarray, free_motion: np.ndarray, u: np.ndarray, centre: np.ndarray,
        held: Anchors, *, predict: bool = True, release: bool = True,
    ) -> Pressed | None:  # fmt: skip
        """Newton's method for u = w - C f(u) with C (m, m) and w (m,), from u; None where it does not settle.

        held: the contact at the load step's start; expected arrivals and, with `release`, points let go
        are noted in it.
        predict: first carry along what is held already, then look for arrivals where that leads.
        """
        arrivals = not predict or not held.active.any()
        if predict and arrivals:
            self.expect(u, centre, held)
        step, last, cut, least = np.zeros_like(u), u, 1.0, float("inf")
        for iteration in range(90):
            now, face_k = self.evaluate(u, centre, held, arrivals)
            given = compliance @ now.load
            r = u - free_motion + given
            size = float(np.linalg.norm(r))
            if size < 1e-7 * max(float(np.linalg.norm(given)), 1e-3) and arrivals and iteration:
                if release and held.let_go(now.grip):
                    continue
                return now
            if iteration > 20:
                held.settle(now.grip)
            if size > 1.5 * least and cut > 0.1 and arrivals:
                # sticking and sliding in turn: go back along the last step
                cut *= 0.5
                u = last + cut * step
                continue
            least = size if arrivals else np.inf
            on, stiffness = self._stiffness(face_k, u)
            if len(on):
                inner = np.eye(len(on)) + compliance[np.ix_(on, on)] @ stiffness
                r = r + compliance[:, on] @ (stiffness @ np.linalg.solve(inner, -r[on]))
            # points that arrive and leave in turn are calmed by shorter steps
            calm = 1.0 if iteration < 25 else 0.5
            step = -r * min(calm, 5.0 / max(float(np.abs(r).max()), 1e-12))
            last, cut = u, 1.0
            u = u + step
            if not arrivals:
                arrivals = True
                self.expect(u, centre, held)
        return None

    def _stiffness(self, face_k: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(unknowns on which something presses, its stiffness among them)."""
        faces = np.flatnonzero(np.abs(face_k).max(axis=(1, 2)) > 0)
        floor = np.flatnonzero(self._floor * (u < 0))
        on = np.unique(np.concatenate([self._dofs[faces].ravel(), floor]))
        local, below = np.searchsorted(on, self._dofs[faces]), np.searchsorted(on, floor)
        matrix = np.zeros((len(on), len(on)))
        np.add.at(matrix, (local[:, :, None], local[:, None, :]), face_k[faces])
        matrix[below, below] += self._floor[floor]
        return on, matrix

    def tip_stiffness(
        self, compliance: np.ndarray, u: np.ndarray, centre: np.ndarray, grip: Anchors
    ) -> np.ndarray:
        """(3, 3) d(force on the tip) / d(tip position) with the contact as it is; symmetric, negative."""
        _, face_k = self.evaluate(u, centre, grip)
        face_k = (face_k + face_k.transpose(0, 2, 1)) / 2
        on, stiffness = self._stiffness(face_k, u)
        # moving the tip is moving every node of a face back
        per_face = face_k @ np.tile(np.eye(3), (6, 1))
        coupling = np.zeros((self._size, 3))
        np.add.at(coupling, self._dofs.ravel(), per_face.reshape(-1, 3))
        own, coupling = np.einsum("fajk->jk", per_face.reshape(-1, 6, 3, 3)), coupling[on]
        inner = np.eye(len(on)) + compliance[np.ix_(on, on)] @ stiffness
        moved = np.linalg.solve(inner, compliance[np.ix_(on, on)] @ coupling)
        return -(own - coupling.T @ moved)
