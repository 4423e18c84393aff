"""The ideal object: linear elasticity, condensed exactly onto the faces that the tip may meet.

Small strains and the same mesh as the finite-strain solid (its tangent before any load). The tip itself is
not linearised: it meets the displaced surface. After one factorisation a path costs milliseconds. Maxwell
branches relax shear and bulk alike, so that every material point's memory condenses onto the same nodes:
K (u + sum q) = f with q' = g u' - q / tau. Units: mm, E mm^2.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from scenes.laboratory.contact import Grip, SphereContact
from scenes.laboratory.factor import Factor
from scenes.laboratory.solid import Solid
from scenes.laboratory.solver import LabError


class LinearProblem:
    """Drives a sphere along a path on the condensed object; the same calls as `solver.Problem`."""

    def __init__(
        self, solid: Solid, contact: SphereContact, free: np.ndarray, springs: np.ndarray | None = None
    ) -> None:
        mesh = solid.mesh
        history = solid.new_history()
        _, stiffness, _, _ = solid.evaluate(np.zeros_like(mesh.points), history, 0.0, True)
        dofs = (3 * mesh.cells[:, :, None] + np.arange(3)).reshape(len(mesh.cells), 30)
        number = np.full(free.size, -1)
        number[free] = np.arange(free.sum())
        row = np.repeat(number[dofs], 30, axis=1).ravel()
        column = np.tile(number[dofs], (1, 30)).ravel()
        use = (row >= 0) & (column >= row)
        size = int(free.sum())
        matrix = sp.coo_matrix((stiffness.ravel()[use], (row[use], column[use])), shape=(size, size)).tocsr()
        if springs is not None:
            matrix = (matrix + sp.diags(springs[free])).tocsr()
        matrix.sort_indices()
        nodes = np.unique(contact.faces)
        nodes = nodes[free.reshape(-1, 3)[nodes].all(axis=1)]
        local = np.full(len(mesh.points), -1)
        local[nodes] = np.arange(len(nodes))
        held = number[(3 * nodes[:, None] + np.arange(3)).ravel()]
        factor = Factor()
        factor.refresh(matrix)
        compliance = np.empty((len(held), len(held)))
        for start in range(0, len(held), 64):
            unit = np.zeros((size, min(64, len(held) - start)))
            unit[held[start : start + unit.shape[1]], np.arange(unit.shape[1])] = 1.0
            compliance[:, start : start + unit.shape[1]] = factor.solve(unit)[held]
        self._compliance = (compliance + compliance.T) / 2
        self._prony = solid.material.prony
        inside = (local[contact.faces] >= 0).all(axis=1)
        self._contact = SphereContact(
            mesh.points[nodes],
            local[contact.faces[inside]],
            contact.radius,
            None if contact.friction < 0 else contact.friction,
        )
        self._dofs = (3 * self._contact.faces[:, :, None] + np.arange(3)).reshape(-1, 18)

    def rest(self, centre: np.ndarray) -> LinearState:
        """The untouched object with the tip's centre at `centre`."""
        untouched = np.zeros_like(self._contact.points)
        memory = np.zeros((len(self._prony), *untouched.shape))
        grip = self._contact.start(centre)
        return LinearState(untouched, np.asarray(centre, float), np.zeros(3), grip, 0.0, memory)

    def advance(
        self, state: LinearState, centre: np.ndarray, step_s: float = 0.0, depth: int = 0
    ) -> LinearState:
        """Move the tip's centre to `centre` within `step_s` seconds, 0 for infinitely slow.

        The step is halved where the contact does not settle.
        A sticking tip that finds no equilibrium in an eighth of a step loses its hold.
        """
        centre = np.asarray(centre, float)
        found = self._newton(state, centre, step_s)
        if found is not None:
            return found
        if depth == 3 and self._contact.friction < 0.0 and state.grip.active.any():
            found = self._pressed_anew(state, centre, step_s)
            if found is not None:
                return found
        if depth >= 9:
            raise LabError(
                f"no equilibrium with the tip at {np.round(centre, 2).tolist()} mm: press less deep"
            )
        middle = self.advance(state, (state.centre + centre) / 2, step_s / 2, depth + 1)
        return self.advance(middle, centre, step_s / 2, depth + 1)

    def _pressed_anew(self, state: LinearState, centre: np.ndarray, step_s: float) -> LinearState | None:
        """The tip has lost its hold: the dragged surface springs back and meets it afresh at `centre`."""
        away = self._contact.clear_of(centre, state.grip)
        grip = self._contact.start(away)
        found: LinearState | None = LinearState(
            state.displacement, away, np.zeros(3), grip, 0.0, state.memory
        )
        count = 1 + int(np.ceil(np.linalg.norm(away - centre) / 0.2))
        for share in np.linspace(0, 1, count):
            found = found and self._newton(found, away + share * (centre - away), step_s / count)
        return found

    def _remembered(self, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """(decay (b,), gain (b,)) of each branch over a step in which u changes evenly."""
        g, tau = self._prony.T
        if step_s <= 0:
            return np.zeros_like(g), np.zeros_like(g)
        decay = np.exp(-step_s / tau)
        return decay, g * (1 - decay) * tau / step_s

    def _newton(self, state: LinearState, centre: np.ndarray, step_s: float) -> LinearState | None:
        """(1 + gain) u + past + C f(u) = 0: the contact's forces f live on the few nodes that touch."""
        u = state.displacement
        decay, gains = self._remembered(step_s)
        gain = 1 + gains.sum()
        past = np.tensordot(decay, state.memory, 1) - gains.sum() * state.displacement
        held = state.grip.copy()
        arrivals = not held.active.any()
        if arrivals:
            self._contact.expect(u, centre, held)
        step, last, cut, least = np.zeros_like(u), u, 1.0, float("inf")
        for iteration in range(90):
            forces, face_k, force, grip = self._contact.evaluate(u, centre, held, True, arrivals)
            load = np.bincount(self._dofs.ravel(), forces.ravel(), minlength=u.size)
            given = self._compliance @ load
            r = gain * u.ravel() + past.ravel() + given
            load_size = float(np.linalg.norm(given))
            if np.linalg.norm(r) < 1e-7 * max(load_size, 1e-3) and arrivals and iteration:
                if held.let_go(grip):
                    continue
                change = u - state.displacement
                memory = decay[:, None, None] * state.memory + gains[:, None, None] * change
                return LinearState(u, centre, force, grip, 0.5 * float(load @ given), memory)
            if iteration > 20:
                held.settle(grip)
            size = float(np.linalg.norm(r))
            if size > 1.5 * least and cut > 0.1 and arrivals:
                # sticking and sliding in turn: go back along the last step
                cut *= 0.5
                u = last + cut * step
                continue
            least = size if arrivals else np.inf
            on, stiffness = self._touching(face_k)
            if len(on):
                inner = gain * np.eye(len(on)) + self._compliance[np.ix_(on, on)] @ stiffness
                r = r + self._compliance[:, on] @ (stiffness @ np.linalg.solve(inner, -r[on]))
            # points that arrive and leave in turn are calmed by shorter steps
            calm = 1.0 if iteration < 25 else 0.5
            step = -r.reshape(-1, 3) / gain
            step *= min(calm, 5.0 / max(float(np.abs(step).max()), 1e-12))
            last, cut = u, 1.0
            u = u + step
            if not arrivals:
                arrivals = True
                self._contact.expect(u, centre, held)
        return None

    def _touching(self, face_k: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(degrees of freedom of the faces that touch, the contact's stiffness among them)."""
        faces = np.flatnonzero(np.abs(face_k).max(axis=(1, 2)) > 0)
        on, local = np.unique(self._dofs[faces], return_inverse=True)
        local = local.reshape(-1, 18)
        matrix = np.zeros((len(on), len(on)))
        np.add.at(matrix, (local[:, :, None], local[:, None, :]), face_k[faces])
        return on, matrix

    def tip_stiffness(self, state: LinearState) -> np.ndarray:
        """(3, 3) d(force on the tip) / d(tip position) with the contact as it is; symmetric, negative."""
        _, face_k, _, _ = self._contact.evaluate(state.displacement, state.centre, state.grip, True)
        on, stiffness = self._touching((face_k + face_k.transpose(0, 2, 1)) / 2)
        unit = np.tile(np.eye(3), (len(on) // 3, 1))
        coupling = stiffness @ unit
        inner = np.eye(len(on)) + self._compliance[np.ix_(on, on)] @ stiffness
        moved = np.linalg.solve(inner, self._compliance[np.ix_(on, on)] @ coupling)
        return -(unit.T @ coupling - coupling.T @ moved)


class LinearState:
    """A converged equilibrium on the condensed faces: displacement (k, 3) mm, tip centre (3,), force on it
    (3,), what the Maxwell branches remember (b, k, 3) mm.
    """

    def __init__(
        self,
        displacement: np.ndarray,
        centre: np.ndarray,
        force: np.ndarray,
        grip: Grip,
        energy: float,
        memory: np.ndarray,
    ) -> None:
        self.displacement, self.centre, self.force, self.grip = displacement, centre, force, grip
        self.energy, self.memory = energy, memory
