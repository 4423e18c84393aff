"""The ideal object: linear elasticity, condensed exactly onto the nodes that tip and floor may press.

Small strains and the same mesh as the finite-strain solid (its tangent before any load). The tip itself is
not linearised: it meets the displaced surface. After one factorisation a path costs milliseconds. Maxwell
branches relax shear and bulk alike, so that every material point's memory condenses onto the same nodes:
K (u + sum q) = f with q' = g u' - q / tau. Units: mm, E mm^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.elastic.partial_factor import partial_factor
from palpate.scenes.laboratory.contact import Anchors, SphereContact
from palpate.scenes.laboratory.solid import Solid
from palpate.scenes.laboratory.solver import Driven
from palpate.scenes.laboratory.touching import Assembly, Touching


@dataclass(frozen=True)
class LinearState:
    """A converged equilibrium of the kept unknowns: displacement (m,) mm, tip centre (3,), force on it (3,),
    what the Maxwell branches remember (b, m) mm.
    """

    displacement: np.ndarray
    centre: np.ndarray
    force: np.ndarray
    grip: Anchors
    energy: float
    memory: np.ndarray


class LinearProblem(Driven):
    """Drives a sphere along a path on the condensed object."""

    LOSES_HOLD, HALVED = 3, 9

    def __init__(
        self,
        solid: Solid,
        contact: SphereContact,
        free: np.ndarray,
        springs: np.ndarray | None = None,
        floor: np.ndarray | None = None,
    ) -> None:
        mesh = solid.mesh
        _, stiffness, _, _ = solid.evaluate(np.zeros_like(mesh.points), solid.new_history(), 0.0, True)
        self._touching = Touching(contact, free, floor)
        assembly = Assembly(mesh.cells, free, springs)
        factor = partial_factor(assembly.pattern, np.flatnonzero(self._touching.kept))
        self._compliance = np.linalg.inv(factor.refresh(assembly.stiffness(stiffness)))
        self._prony = solid.material.prony

    def rest(self, centre: np.ndarray) -> LinearState:
        untouched = np.zeros(len(self._compliance))
        memory = np.zeros((len(self._prony), len(untouched)))
        grip = self._touching.contact.start(centre)
        return LinearState(untouched, np.asarray(centre, float), np.zeros(3), grip, 0.0, memory)

    def _pressed_anew(self, state: LinearState, centre: np.ndarray, step_s: float) -> LinearState | None:
        contact = self._touching.contact
        away = contact.clear_of(centre, state.grip)
        found: LinearState | None = LinearState(
            state.displacement, away, np.zeros(3), contact.start(away), 0.0, state.memory
        )
        count = 1 + int(np.ceil(np.linalg.norm(away - centre) / 0.2))
        for share in np.linspace(0, 1, count):
            found = found and self._step(found, away + share * (centre - away), step_s / count)
        return found

    def _remembered(self, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """(decay (b,), gain (b,)) of each branch over a step in which u changes evenly."""
        g, tau = self._prony.T
        if step_s <= 0:
            return np.zeros_like(g), np.zeros_like(g)
        decay = np.exp(-step_s / tau)
        return decay, g * (1 - decay) * tau / step_s

    def _step(self, state: LinearState, centre: np.ndarray, step_s: float) -> LinearState | None:
        """(1 + gain) u + past + C f(u) = 0: the forces f live on the few nodes that are pressed."""
        decay, gains = self._remembered(step_s)
        gain = 1 + gains.sum()
        past = decay @ state.memory - gains.sum() * state.displacement
        found = self._touching.settle(
            self._compliance / gain, -past / gain, state.displacement, centre, state.grip.copy()
        )
        if found is None:
            return None
        memory = decay[:, None] * state.memory + gains[:, None] * (found.u - state.displacement)
        energy = 0.5 * float(found.load @ self._compliance @ found.load)
        return LinearState(found.u, centre, found.force, found.grip, energy, memory)

    def tip_stiffness(self, state: LinearState) -> np.ndarray:
        return self._touching.tip_stiffness(self._compliance, state.displacement, state.centre, state.grip)
