"""The quasi-static path of a tip through a solid: Newton's method on one factorisation pattern. Units: mm, E
mm^2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from mechanics.errors import PalpateError
from scenes.laboratory.contact import Grip, SphereContact
from scenes.laboratory.factor import Factor
from scenes.laboratory.solid import History, Solid


class LabError(PalpateError):
    """A load step of the virtual laboratory found no equilibrium."""


@dataclass(frozen=True)
class State:
    """A converged equilibrium: displacement (n, 3) mm, force on the tip (3,), the tip's centre (3,) mm."""

    displacement: np.ndarray
    centre: np.ndarray
    force: np.ndarray
    energy: float
    history: History
    grip: Grip
    stiffness: np.ndarray | None = None
    iterations: int = 0


@dataclass
class Problem:
    """A solid on its support and a sphere; built once for a site, then driven along paths.

    free: (3 n,) bool, degrees of freedom that may move. springs: (3 n,) support stiffness on the diagonal;
    floor: (3 n,) the same, but resisting negative displacement only. linear: small strains instead of
    finite ones.
    """

    solid: Solid
    contact: SphereContact
    free: np.ndarray
    springs: np.ndarray | None = None
    floor: np.ndarray | None = None
    linear: bool = False
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        mesh = self.solid.mesh
        self._number = np.full(self.free.size, -1)
        self._number[self.free] = np.arange(self.free.sum())
        self._cell_dofs = (3 * mesh.cells[:, :, None] + np.arange(3)).reshape(len(mesh.cells), 30)
        self._face_dofs = (3 * self.contact.faces[:, :, None] + np.arange(3)).reshape(-1, 18)
        self._pattern()
        self._factor = Factor()
        self._factored: State | None = None
        if self.linear:
            rest = np.zeros_like(mesh.points)
            self._constant = self.solid.evaluate(rest, self.solid.new_history(), 0.0, True)[1]

    def _pattern(self) -> None:
        """Where every element entry goes in the upper triangle of the free stiffness, found once."""
        n = int(self.free.sum())
        keys, places = [], []
        for dofs in (self._cell_dofs, self._face_dofs):
            number = self._number[dofs]
            row = np.repeat(number, number.shape[1], axis=1)
            column = np.tile(number, (1, number.shape[1]))
            use = (row >= 0) & (column >= row)
            keys.append((row * np.int64(n) + column)[use])
            places.append(use)
        diagonal = np.arange(n) * np.int64(n + 1)
        unique, inverse = np.unique(np.concatenate([*keys, diagonal]), return_inverse=True)
        cut = np.cumsum([len(keys[0]), len(keys[1])])
        self._into = inverse[: cut[0]], inverse[cut[0] : cut[1]], inverse[cut[1] :]
        self._use = places
        indptr = np.searchsorted(unique // n, np.arange(n + 1))
        self._indices, self._indptr = (unique % n).astype(np.int32), indptr.astype(np.int32)
        self._entries, self._size = len(unique), n

    def _evaluate(
        self, u: np.ndarray, history: History, step_s: float, tangent: bool = True
    ) -> tuple[np.ndarray, np.ndarray, float, History]:
        if not self.linear:
            return self.solid.evaluate(u, history, step_s, tangent)
        local = u.ravel()[self._cell_dofs]
        forces = np.einsum("eij,ej->ei", self._constant, local)
        return forces, self._constant, 0.5 * float((forces * local).sum()), history

    def _assemble(self, cell_k: np.ndarray, face_k: np.ndarray, u: np.ndarray) -> sp.csr_matrix:
        # the factorisation is symmetric: friction's other half is left to Newton's further iterations
        face_k = (face_k + face_k.transpose(0, 2, 1)) / 2
        data = np.bincount(
            self._into[0], cell_k.reshape(len(cell_k), -1)[self._use[0]], minlength=self._entries
        )
        data += np.bincount(
            self._into[1], face_k.reshape(len(face_k), -1)[self._use[1]], minlength=self._entries
        )
        if self.springs is not None:
            data[self._into[2]] += self.springs[self.free]
        if self.floor is not None:
            data[self._into[2]] += (self.floor * (u.ravel() < 0))[self.free]
        return sp.csr_matrix((data, self._indices, self._indptr), shape=(self._size, self._size))

    def _residual(self, cell_f: np.ndarray, face_f: np.ndarray, u: np.ndarray) -> np.ndarray:
        r = np.bincount(self._cell_dofs.ravel(), cell_f.ravel(), minlength=self.free.size)
        r += np.bincount(self._face_dofs.ravel(), face_f.ravel(), minlength=self.free.size)
        if self.springs is not None:
            r += self.springs * u.ravel()
        if self.floor is not None:
            r += self.floor * np.minimum(u.ravel(), 0.0)
        return r[self.free]

    def rest(self, centre: np.ndarray) -> State:
        """The untouched object with the tip's centre at `centre`."""
        u = np.zeros_like(self.solid.mesh.points)
        return State(
            u,
            np.asarray(centre, float),
            np.zeros(3),
            0.0,
            self.solid.new_history(),
            self.contact.start(centre),
        )

    def advance(
        self, state: State, centre: np.ndarray, step_s: float = 0.0, guess: np.ndarray | None = None
    ) -> State:
        """Move the tip's centre to `centre` within `step_s` seconds; halves the step where Newton fails.

        A sticking tip that finds no equilibrium in a quarter of a step loses its hold.
        """
        return self._advance(state, np.asarray(centre, float), step_s, guess, 0)

    def _advance(
        self, state: State, centre: np.ndarray, step_s: float, guess: np.ndarray | None, depth: int
    ) -> State:
        found = self._newton(state, centre, step_s, guess)
        if found is None and guess is not None:
            found = self._newton(state, centre, step_s, None)
        if found is not None:
            return found
        if depth == 2 and self.contact.friction < 0.0 and state.grip.active.any():
            found = self._pressed_anew(state, centre, step_s)
            if found is not None:
                return found
        if depth >= 5:
            raise LabError(
                f"no equilibrium with the tip at {np.round(centre, 2).tolist()} mm: press less deep or "
                f"refine the mesh"
            )
        middle = self._advance(state, (state.centre + centre) / 2, step_s / 2, None, depth + 1)
        return self._advance(middle, centre, step_s / 2, None, depth + 1)

    def _pressed_anew(self, state: State, centre: np.ndarray, step_s: float) -> State | None:
        """The tip has lost its hold: the dragged surface springs back and meets it afresh at `centre`."""
        away = self.contact.clear_of(centre, state.grip)
        found: State | None = replace(self.rest(away), history=state.history)
        for share in np.linspace(0, 1, 1 + int(np.ceil(np.linalg.norm(away - centre) / 0.5))):
            found = found and self._newton(found, away + share * (centre - away), step_s, None)
            step_s = 0.0
        return found

    def _newton(
        self, state: State, centre: np.ndarray, step_s: float, guess: np.ndarray | None
    ) -> State | None:
        contact = self.contact
        u = state.displacement if guess is None else guess
        # without a guess the points already held carry the object along before new ones may arrive
        held = state.grip.copy()
        # what holds and sticks is as stiff at the step's start as where the tip's stiffness was asked for
        known = self._factored is state and guess is None and contact.friction < 0.0
        self._factored = None
        arrivals = guess is not None or not held.active.any()
        if arrivals:
            contact.expect(u, centre, held)
        last, cut, last_norm, touching, close = u, 1.0, np.inf, held.active, False
        step = np.zeros_like(u)
        for iteration in range(40):
            # close to the end a tangent is seldom needed, and costs more than the forces
            cell_f, cell_k, energy, history = self._evaluate(u, state.history, step_s, not close)
            if not np.isfinite(energy):
                # an element turned inside out: take less of the last step
                cut *= 0.4
                if cut < 0.05 or iteration == 0:
                    return None
                u = last + cut * step
                continue
            face_f, face_k, force, grip = contact.evaluate(u, centre, held, True, arrivals)
            r = self._residual(cell_f, face_f, u)
            norm = float(np.linalg.norm(r))
            scale = max(np.abs(face_f).sum(), 1e-3)
            if arrivals and iteration > 0 and norm < 0.02 * scale:
                if held.let_go(grip):
                    continue
                if norm < self.tolerance * scale:
                    return State(u, centre.copy(), force, energy, history, grip, None, iteration)
            if iteration > 12:
                held.settle(grip)
            # close to the end the last tangent serves once more, where the contact has settled
            reuse = arrivals and norm < 0.02 * last_norm and np.array_equal(grip.active, touching)
            last_norm, touching = norm, grip.active
            if not (reuse or (known and iteration == 0)):
                if not len(cell_k):
                    cell_k = self._evaluate(u, state.history, step_s)[1]
                self._factor.refresh(self._assemble(cell_k, face_k, u))
            close = arrivals and norm < 0.02 * scale
            step = np.zeros(self.free.size)
            step[self.free] = self._factor.solve(-r)
            step = step.reshape(-1, 3)
            longest = np.abs(step).max()
            if not np.isfinite(longest):
                return None
            last, cut = u, 1.0
            u = u + step * (3.0 / max(longest, 3.0))
            if not arrivals:
                arrivals = True
                contact.expect(u, centre, held)
        return None

    def tip_stiffness(self, state: State) -> np.ndarray:
        """(3, 3) d(force on the tip) / d(tip position) with the contact as it is; symmetric, negative."""
        contact, u = self.contact, state.displacement
        _, cell_k, _, _ = self._evaluate(state.displacement, state.history, 1e-6)
        _, face_k, _, _ = contact.evaluate(state.displacement, state.centre, state.grip, True)
        self._factor.refresh(self._assemble(cell_k, face_k, u))
        self._factored = state
        # translating the tip is translating every face node back: coupling = - K_face applied to unit
        # translations
        units = np.tile(np.eye(3), (6, 1))
        per_face = face_k @ units
        coupling = np.zeros((self.free.size, 3))
        np.add.at(coupling, self._face_dofs.ravel(), per_face.reshape(-1, 3))
        own = np.einsum("ai,faj->ij", units, per_face)
        inner = coupling[self.free]
        return -(own - inner.T @ self._factor.solve(inner))
