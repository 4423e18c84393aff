"""The quasi-static path of a tip through a solid at finite strain. Units: mm, E mm^2.

One tangent of the solid serves many iterations (modified Newton). It is condensed onto the nodes that tip and
floor may press, where the contact is solved exactly for the linearised solid, so that only the solid's own
nonlinearity, which is smooth, is left to iterate.

The ideal object: linear elasticity, condensed exactly onto the nodes that tip and floor may press.

Small strains and the same mesh as the finite-strain solid (its tangent before any load). The tip itself is
not linearised: it meets the displaced surface. After one factorisation a path costs milliseconds. Maxwell
branches relax shear and bulk alike, so that every material point's memory condenses onto the same nodes:
K (u + sum q) = f with q' = g u' - q / tau. Units: mm, E mm^2.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.mechanics.elastic.partial_factor import partial_factor
from palpate.mechanics.errors import PalpateError
from palpate.scenes.laboratory.contact import Anchors, SphereContact
from palpate.scenes.laboratory.solid import History, Solid
from palpate.scenes.laboratory.touching import Assembly, Touching

MOST_ITERATIONS = 40
SLOW = 0.7
"""A tangent is taken anew where an iteration leaves more than this share of the residual."""


class LabError(PalpateError):
    """A load step of the virtual laboratory found no equilibrium."""


_MIXED = 4


class Mixing:
    """Anderson's acceleration (1965) of a fixed-point iteration: the step that its last steps foretell."""

    def __init__(self) -> None:
        self._x: list[np.ndarray] = []
        self._g: list[np.ndarray] = []

    def __call__(self, x: np.ndarray, g: np.ndarray) -> np.ndarray:
        """The step to take from x where the iteration alone would step by g."""
        self._x, self._g = [*self._x[-_MIXED:], x], [*self._g[-_MIXED:], g]
        if len(self._x) == 1:
            return g
        dx, dg = np.diff(self._x, axis=0).T, np.diff(self._g, axis=0).T
        share = np.linalg.lstsq(dg, g, rcond=1e-8)[0]
        return g - (dx + dg) @ share


@dataclass(frozen=True)
class SolvedState:
    """A converged equilibrium: displacement (n, 3) mm, force on the tip (3,), the tip's centre (3,) mm."""

    displacement: np.ndarray
    centre: np.ndarray
    force: np.ndarray
    energy: float
    history: History
    grip: Anchors


class Driven(ABC):
    """A discrete problem whose tip is driven along a path. Its states are of its own kind, and tell centre
    (3,) mm, force on the tip (3,) and stored energy, modulus 1.

    LOSES_HOLD, HALVED: after so many halvings of a step a sticking tip loses its hold, and none is tried any
    more.
    """

    LOSES_HOLD: int
    HALVED: int
    _touching: Touching

    @abstractmethod
    def rest(self, centre: np.ndarray) -> Any:
        """The untouched object with the tip's centre at `centre` (3,) mm."""

    @abstractmethod
    def tip_stiffness(self, state: Any) -> np.ndarray:
        """(3, 3) d(force on the tip) / d(tip position) with the contact as it is; symmetric, negative."""

    @abstractmethod
    def _step(self, state: Any, centre: np.ndarray, step_s: float) -> Any:
        """The state with the tip's centre there, step_s later; None where there is no equilibrium."""

    @abstractmethod
    def _pressed_anew(self, state: Any, centre: np.ndarray, step_s: float) -> Any:
        """The tip has lost its hold: the dragged surface springs back and meets it afresh at `centre`."""

    def advance(self, state: Any, centre: np.ndarray, step_s: float = 0.0, depth: int = 0) -> Any:
        """Move the tip's centre to `centre` within `step_s` seconds, 0 for infinitely slow; the step is
        halved where it finds no equilibrium. Raises LabError."""
        centre = np.asarray(centre, float)
        found = self._step(state, centre, step_s)
        if found is not None:
            return found
        sticks = self._touching.contact.friction < 0.0 and state.grip.active.any()
        if depth == self.LOSES_HOLD and sticks:
            found = self._pressed_anew(state, centre, step_s)
            if found is not None:
                return found
        if depth >= self.HALVED:
            raise LabError(
                f"no equilibrium with the tip at {np.round(centre, 2).tolist()} mm: press less deep"
            )
        middle = self.advance(state, (state.centre + centre) / 2, step_s / 2, depth + 1)
        return self.advance(middle, centre, step_s / 2, depth + 1)


@dataclass
class Problem(Driven):
    """A solid on its support and a sphere; built once for a site, then driven along paths.

    free: (3 n,) bool, degrees of freedom that may move. springs: (3 n,) support stiffness on the diagonal;
    floor: (3 n,) the same, but resisting negative displacement only.
    """

    solid: Solid
    contact: SphereContact
    free: np.ndarray
    springs: np.ndarray | None = None
    floor: np.ndarray | None = None
    tolerance: float = 1e-4
    LOSES_HOLD, HALVED = 2, 5

    def __post_init__(self) -> None:
        self._assembly = Assembly(self.solid.mesh.cells, self.free, self.springs)
        self._touching = Touching(self.contact, self.free, self.floor)
        self._factor = partial_factor(self._assembly.pattern, np.flatnonzero(self._touching.kept))
        self._compliance: np.ndarray | None = None
        self._kept = np.flatnonzero(self.free)[self._touching.kept]

    def rest(self, centre: np.ndarray) -> SolvedState:
        self._compliance = None
        u = np.zeros_like(self.solid.mesh.points)
        grip = self._touching.contact.start(centre)
        return SolvedState(u, np.asarray(centre, float), np.zeros(3), 0.0, self.solid.new_history(), grip)

    def _pressed_anew(self, state: SolvedState, centre: np.ndarray, step_s: float) -> SolvedState | None:
        away = self._touching.contact.clear_of(centre, state.grip)
        found: SolvedState | None = replace(self.rest(away), history=state.history)
        for share in np.linspace(0, 1, 1 + int(np.ceil(np.linalg.norm(away - centre) / 0.5))):
            found = found and self._step(found, away + share * (centre - away), step_s)
            step_s = 0.0
        return found

    def _linearise(self, u: np.ndarray, history: History, step_s: float) -> np.ndarray:
        """Take the solid's tangent at u; the compliance (m, m) of the nodes that are pressed.

        The elements' pressures in it are those of `history`: where u is a prediction its volumes are off to
        second order, and a bulk modulus makes pressures of that which would spoil the tangent.
        """
        elements = self.solid.evaluate(u, history, step_s, True, history.pressure)[1]
        self._compliance = np.linalg.inv(self._factor.refresh(self._assembly.stiffness(elements)))
        return self._compliance

    def _step(self, state: SolvedState, centre: np.ndarray, step_s: float) -> SolvedState | None:
        held, u, kept = state.grip.copy(), state.displacement, self._touching.kept
        known, mixing = self._compliance, Mixing()
        elements, _, energy, history = self.solid.evaluate(u, state.history, step_s, False)
        compliance = self._linearise(u, state.history, step_s) if known is None else known
        last, before, near = 0.0, np.inf, False
        for iteration in range(MOST_ITERATIONS):
            # the old tangent predicts the step; the one that is taken there usually serves to the end
            anew = iteration == 1 or last > SLOW * before
            if anew:
                compliance = self._linearise(u, state.history, step_s)
                mixing = Mixing()
            r = self._assembly.residual(elements, u)
            half = self._factor.forward(-r)
            start, active = u.ravel()[self._kept], held.active
            alone = start + compliance @ half[kept]
            # a held point may pull while the solid is off: it is let go once the rest has settled
            now = self._touching.settle(
                compliance, alone, start, centre, held, predict=iteration == 0, release=near
            )
            if now is None:
                return None
            r[kept] += now.load
            norm, scale = float(np.linalg.norm(r)), max(now.scale, 1e-3)
            if near and norm < self.tolerance * scale:
                return SolvedState(u, centre.copy(), now.force, energy, history, now.grip)
            near = norm < 0.02 * scale
            last, before = norm, np.inf if anew else last
            if not np.array_equal(held.active, active):
                # another contact: what the last steps foretold is void
                mixing, before = Mixing(), np.inf
            step = np.zeros_like(u)
            step.ravel()[self.free] = mixing(u.ravel()[self.free], self._factor.backward(half, now.u - start))
            longest = float(np.abs(step).max())
            if not np.isfinite(longest):
                return None
            cut = 3.0 / max(longest, 3.0)
            while True:
                found = self.solid.evaluate(u + cut * step, state.history, step_s, False)
                if np.isfinite(found[2]):
                    break
                # an element turned inside out: take less of the step
                cut *= 0.4
                if cut < 0.05:
                    return None
            u, (elements, _, energy, history) = u + cut * step, found
        return None

    def tip_stiffness(self, state: SolvedState) -> np.ndarray:
        """(3, 3) d(force on the tip) / d(tip position) with the contact as it is; symmetric, negative.

        With the tangent that the last load step took on its way: within some 1 % of the one at its end,
        3 % with damage.
        """
        compliance = self._compliance
        if compliance is None:
            compliance = self._linearise(state.displacement, state.history, 0.0)
        kept = state.displacement.ravel()[self._kept]
        return self._touching.tip_stiffness(compliance, kept, state.centre, state.grip)


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
