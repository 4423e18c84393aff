"""The equilibrium of a sphere with a body that is linear, or linearised, and condensed onto the faces it may
meet: S (x - u) = g - f(x), the contact's resistance f solved exactly by a semi-smooth Newton method.

A sphere's quasi-static path into a body: load steps, each by Newton's method with the contact inside.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from palpate.mechanics.press_solver.body import Condensed, PressedBody
from palpate.mechanics.press_solver.contact import ContactMemory, PressContact, Traction

_ROUNDS, _SETTLING_ITERATIONS, _SLIDING_ITERATIONS = 3, 60, 30
_MOVED = 4e-3
"""Overlap over the sphere's radius from which it has been moved, and carries its points along first."""
_SETTLED = 1e-5
"""Of the residual over the contact's forces."""
_REACH = 0.12
"""Faces nearer to the sphere than this share of its radius are asked; more are taken where it turns out."""


Balance = tuple[np.ndarray, Traction, np.ndarray]
"""(residual (k,) N, the contact's answer, places (p, 3) m of its points relative to the sphere)."""


@dataclass
class Settled:
    """An equilibrium. change (k,) m of the kept unknowns; load (k,): their resistance; force (3,) on the
    sphere; pressing (p,) bool; grip: what the next settling of the same step, or the next step, begins with.
    """

    change: np.ndarray
    load: np.ndarray
    force: np.ndarray
    pressing: np.ndarray
    grip: ContactMemory


class Settling:
    """A sphere's contact with the kept unknowns of a body.

    contact: its points are the nodes of the faces. unknowns: (n, 3) kept unknown of each of these nodes'
    degrees of freedom, -1 where it is held.
    """

    def __init__(self, contact: PressContact, unknowns: np.ndarray) -> None:
        self.contact, self._unknowns = contact, unknowns
        self._of_face = unknowns[contact.faces].reshape(-1, 18)
        self._per_face = len(contact.weights[0])
        self.refused = np.zeros(contact.weights.size, dtype=bool)
        self._known: tuple[np.ndarray, np.ndarray, Condensed] | None = None

    def displaced(self, u: np.ndarray) -> np.ndarray:
        """(n, 3) m, displacement of the faces' nodes from that of the kept unknowns (k,)."""
        return np.where(self._unknowns >= 0, u[self._unknowns], 0.0)

    def settle(
        self,
        schur: np.ndarray,
        load: np.ndarray,
        u: np.ndarray,
        centre: np.ndarray,
        before: ContactMemory,
        grip: ContactMemory,
    ) -> Settled | None:
        """From displacement u (k,) with the sphere at `centre`; None where it does not settle.

        before: the contact at the step's start; grip: the best that is known of it at the step's end.
        """
        everywhere = np.arange(len(self._of_face))
        gap = self._relative(u, everywhere, centre)
        gap = np.linalg.norm(gap, axis=1) - self.contact.radius
        near = (gap < _REACH * self.contact.radius) | grip.anchored
        near = near.reshape(-1, self._per_face).any(axis=1)
        for _ in range(4):
            found = self._among(np.flatnonzero(near), schur, load, u, centre, before, grip)
            if found is None:
                return None
            beyond = np.flatnonzero(~near)
            relative = self._relative(u + found.change, beyond, centre)
            inside = np.linalg.norm(relative, axis=1) < self.contact.radius
            if not inside.any():
                return found
            near[beyond[inside.reshape(-1, self._per_face).any(axis=1)]] = True
        return None

    def _relative(self, u: np.ndarray, chosen: np.ndarray, centre: np.ndarray) -> np.ndarray:
        return self.contact.places(self.displaced(u), chosen) - centre

    def _among(
        self, chosen: np.ndarray, schur: np.ndarray, load: np.ndarray, u: np.ndarray, centre: np.ndarray,
        before: ContactMemory, grip: ContactMemory,
    ) -> Settled | None:  # fmt: skip
        nothing, nowhere = np.zeros(len(u)), np.zeros(len(grip.anchored), dtype=bool)
        result = Settled(nothing, np.zeros(len(u)), np.zeros(3), nowhere, grip.copy())
        trial, own = result.grip, self.contact.of_faces(chosen)
        trial.relative = before.relative
        few = np.unique(self._of_face[chosen])
        few = few[few >= 0]
        try:
            small = self._onto(schur, few)
        except la.LinAlgError:
            return None  # the body's tangent is no valley here; one of a shorter step may be
        pull = small.pull(load)
        local = np.full(len(u) + 1, -1)
        local[few] = np.arange(len(few))
        unknowns = local[self._of_face[chosen]]
        moved = u.copy()

        def at(x: np.ndarray, sticks: bool = False) -> Balance:
            moved[few] = u[few] + x
            relative = self._relative(moved, chosen, centre)
            traction = self.contact.evaluate(relative, chosen, unknowns, len(few), trial, sticks)
            return small.stiffness @ x - pull + traction.forces, traction, relative

        x = np.zeros(len(few))
        for _ in range(_ROUNDS):
            settled = self._sliding if self.contact.friction > 0.0 else self._newton
            solved = settled(x, small.stiffness, at)
            if solved is None:
                return None
            x, traction, relative = solved
            if self.contact.friction == 0.0 or not self._arrived(own, traction, relative, before, trial):
                break
        result.change = small.spread(x, load)
        result.load[few], result.force = traction.forces, traction.force
        result.pressing[own] = traction.overlap > 0
        return result

    def _onto(self, schur: np.ndarray, few: np.ndarray) -> Condensed:
        """The last one where it is of the same tangent and unknowns."""
        known = self._known
        if known is None or known[0] is not schur or not np.array_equal(known[1], few):
            self._known = known = schur, few, Condensed(schur, few)
        return known[2]

    def _newton(
        self, x: np.ndarray, small: np.ndarray, at: Callable[[np.ndarray], Balance]
    ) -> tuple[np.ndarray, Traction, np.ndarray] | None:
        residual, traction, relative = at(x)
        for _ in range(_SETTLING_ITERATIONS):
            step = _solved(small + traction.stiffness, -residual)
            longest = np.abs(step).max()
            if not np.isfinite(longest):
                return None
            step *= min(1.0, 0.5 * self.contact.radius / max(longest, 1e-300))
            slope, share = float(step @ residual), 1.0
            for _ in range(8):
                residual, traction, relative = at(x + share * step)
                now = float(step @ residual)
                if now <= 0.5 * abs(slope):
                    break
                # the energy's valley was overstepped
                share *= min(max(slope / (slope - now), 0.15), 0.7)
            x = x + share * step
            scale = float(np.linalg.norm(traction.forces)) + 1e-9 * self.contact.radius**2
            if np.linalg.norm(residual) < _SETTLED * scale:
                return x, traction, relative
        return None

    def _sliding(
        self, x: np.ndarray, small: np.ndarray, at: Callable[..., Balance]
    ) -> tuple[np.ndarray, Traction, np.ndarray] | None:
        """With Coulomb's friction no energy leads the way: a sphere that has moved carries its points along
        as if they stuck, and lets them slip from there."""
        residual, traction, relative = at(x)
        if traction.overlap.max(initial=0.0) > _MOVED * self.contact.radius:
            carried = self._newton(x, small, lambda y: at(y, True))
            if carried is None:
                return None
            x = carried[0]
            residual, traction, relative = at(x)
        for _ in range(_SLIDING_ITERATIONS):
            scale = float(np.linalg.norm(traction.forces)) + 1e-9 * self.contact.radius**2
            before = float(np.linalg.norm(residual))
            if before < _SETTLED * scale:
                return x, traction, relative
            step = np.linalg.solve(small + traction.stiffness, -residual)
            if not np.isfinite(step).all():
                return None
            step *= min(1.0, 0.5 * self.contact.radius / max(np.abs(step).max(), 1e-300))
            share = 1.0
            for _ in range(5):
                residual, traction, relative = at(x + share * step)
                if np.linalg.norm(residual) < before:
                    break
                share *= 0.5
            x = x + share * step
        return None

    def _arrived(
        self,
        own: np.ndarray,
        traction: Traction,
        relative: np.ndarray,
        before: ContactMemory,
        trial: ContactMemory,
    ) -> bool:
        """Anchor the points that began to press in this step where they met the sphere, and set friction's
        bounds; whether any of it moved.

        A held point that pulls is let go; it slides until the step ends, should it press again.
        """
        new = ~before.anchored[own]
        pressing = traction.overlap > 0
        pulls = trial.anchored[own] & ~pressing
        self.refused[own[pulls]] = True
        trial.anchored[own[pulls]] = False
        come = np.flatnonzero(new & pressing & ~self.refused[own])
        points = own[come]
        met = self.contact.met(before.relative[points], relative[come])
        shift = np.linalg.norm(met - trial.anchor[points], axis=1) * trial.anchored[points]
        fresh = ~trial.anchored[points]
        trial.anchored[points], trial.anchor[points] = True, met
        far = 1e-4 * self.contact.radius
        return bool(pulls.any() or fresh.any() or (shift > far).any())

    def kept_grip(self, u: np.ndarray, centre: np.ndarray, found: Settled) -> ContactMemory:
        """What the contact remembers once the step has converged at displacement u (k,)."""
        everywhere = np.arange(len(self._of_face))
        relative = self._relative(u, everywhere, centre)
        grip = found.grip
        traction = self.contact.evaluate(relative, everywhere, self._of_face, len(u), grip)
        pressing = traction.overlap > 0
        held = grip.anchored & pressing
        here = relative * (self.contact.radius / np.linalg.norm(relative, axis=1, keepdims=True))
        anchor = np.where(held[:, None], traction.slid, here)
        self.refused[:] = False
        return ContactMemory(pressing, anchor, relative)


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """By Cholesky where the symmetric matrix (k, k) allows it: half of the time."""
    with contextlib.suppress(la.LinAlgError):
        factor = la.cho_factor(matrix, lower=True, check_finite=False)
        return la.cho_solve(factor, right, check_finite=False)
    return np.linalg.solve(matrix, right)


_ITERATIONS = 30
_SLOW = 0.3
"""The tangent is taken anew where an iteration leaves more than this share of the residual."""
_HALVINGS = 5
_TOUCHING = 3e-3


@dataclass(frozen=True)
class Equilibrium:
    """An equilibrium: displacement (size,) m; the sphere's centre (3,) m; force on it (3,) and stored energy
    in units of Young's modulus, m^2 and m^3; pressures of the elements; pressing (p,) bool."""

    displacement: np.ndarray
    centre: np.ndarray
    force: np.ndarray
    energy: float
    pressure: np.ndarray | None
    grip: ContactMemory
    pressing: np.ndarray


class PressPath:
    """Drives a sphere that touches a body nowhere yet. tolerance: residual over the contact's forces."""

    def __init__(
        self, body: PressedBody, settling: Settling, centre: np.ndarray, tolerance: float = 2e-4
    ) -> None:
        self.body, self._settling, self._tolerance = body, settling, tolerance
        self._start = centre
        grip = settling.contact.start(centre)
        self.state = Equilibrium(
            np.zeros(body.size), centre, np.zeros(3), 0.0, None, grip, np.zeros(len(grip.anchored), bool)
        )
        self.tangents = self.iterations = 0
        self._fresh = body.linear

    def advance(self, centre: np.ndarray, depth: int = 0) -> bool:
        """Move the sphere's centre to `centre` (3,) m; halves the step where no equilibrium is found."""
        found = self._newton(centre)
        if found is not None:
            self.state = found
            return True
        if depth == _HALVINGS:
            return False
        self._fresh = self.body.linear
        middle = (self.state.centre + centre) / 2
        return self.advance(middle, depth + 1) and self.advance(centre, depth + 1)

    def _newton(self, centre: np.ndarray) -> Equilibrium | None:
        body, settling, state = self.body, self._settling, self.state
        u, grip = state.displacement, state.grip
        settling.refused[:] = False
        answer = body.resist(u)
        assert answer is not None
        resistance, energy, response = answer
        pressure = None if response is None else response.pressure
        found: Settled | None = None
        last, before, anew = np.inf, np.inf, not self._fresh
        for iteration in range(_ITERATIONS):
            self.iterations += 1
            if found is not None:
                residual = resistance.copy()
                residual[body.kept] += found.load
                last = float(np.linalg.norm(residual))
                if last <= self._tolerance * max(float(np.linalg.norm(found.load)), 1e-9 * self._size):
                    held = settling.kept_grip(u[body.kept], centre, found)
                    pressure = None if response is None else response.pressure
                    return Equilibrium(u, centre, found.force, energy, pressure, held, found.pressing)
                # the tangent of the step before foretells this one; the one taken there serves while it can
                anew = anew or iteration == 1 or last > _SLOW * before
            if anew and not body.linear:
                if not body.linearise(u, pressure):
                    return None
                self.tangents += 1
                self._fresh, anew, last = True, False, np.inf
            half = body.forward(-resistance)
            kept = half[body.kept]
            found = settling.settle(body.schur, kept, u[body.kept], centre, state.grip, grip)
            if found is None:
                return None
            grip, before = found.grip, last
            step = body.backward(half, found.change)
            moved = self._moved(u, step)
            if moved is None:
                return None
            share, answer = moved
            pressure = body.foretold_pressure(response, share * step)
            u = u + share * step
            resistance, energy, response = answer
        return None

    def contact_radius(self, normal: np.ndarray) -> float:
        """m, of the circle of the contact's area as it is seen along `normal` (3,).

        A point is in contact within _TOUCHING of the depth: a quadratic face meets a sphere point by point.
        """
        contact, state = self._settling.contact, self.state
        gap = np.linalg.norm(state.grip.relative, axis=1) - contact.radius
        touching = gap < _TOUCHING * ((self._start - state.centre) @ normal)
        points = contact.points + self._settling.displaced(self.state.displacement[self.body.kept])
        area = (contact.area_vectors(points) @ normal).ravel()[touching].sum()
        return float(np.sqrt(max(area, 0.0) / np.pi))

    @property
    def _size(self) -> float:
        return self._settling.contact.radius**2

    def _moved(self, u: np.ndarray, step: np.ndarray) -> tuple[float, tuple] | None:
        """(share of the step that turns no element inside out, the body's answer there)."""
        share = min(1.0, self._settling.contact.radius / max(float(np.abs(step).max()), 1e-300))
        while share > 0.05:
            answer = self.body.resist(u + share * step)
            if answer is not None:
                return share, answer
            share *= 0.5
        return None
