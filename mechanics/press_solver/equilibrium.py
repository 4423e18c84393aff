"""A sphere's quasi-static path into a body: load steps, each by Newton's method with the contact inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.press_solver.body import Body
from palpate.mechanics.press_solver.contact import Grip
from palpate.mechanics.press_solver.settling import Settled, Settling

_ITERATIONS = 30
_SLOW = 0.3
"""The tangent is taken anew where an iteration leaves more than this share of the residual."""
_HALVINGS = 5
_TOUCHING = 3e-3


@dataclass(frozen=True)
class State:
    """An equilibrium: displacement (size,) m; the sphere's centre (3,) m; force on it (3,) and stored energy
    in units of Young's modulus, m^2 and m^3; pressures of the elements; pressing (p,) bool."""

    displacement: np.ndarray
    centre: np.ndarray
    force: np.ndarray
    energy: float
    pressure: np.ndarray | None
    grip: Grip
    pressing: np.ndarray


class Path:
    """Drives a sphere that touches a body nowhere yet. tolerance: residual over the contact's forces."""

    def __init__(self, body: Body, settling: Settling, centre: np.ndarray, tolerance: float = 2e-4) -> None:
        self.body, self._settling, self._tolerance = body, settling, tolerance
        self._start = centre
        grip = settling.contact.start(centre)
        self.state = State(
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

    def _newton(self, centre: np.ndarray) -> State | None:
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
                    return State(u, centre, found.force, energy, pressure, held, found.pressing)
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
