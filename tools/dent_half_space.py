"""The axisymmetric body that a sphere is pressed into: nine-node quadrilaterals, sticking or followed.

The volumetric part is integrated at the four reduced points. Laws: `tools.dent_table`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from pypardiso import PyPardisoSolver

from palpate.mechanics.effects.strain_stiffening import hardening
from palpate.mechanics.elastic.elasticity import lame_parameters


def graded(fine: float, fine_until: float, ratio: float, end: float) -> np.ndarray:
    """Coordinates from 0: steps `fine` until `fine_until`, then growing by `ratio` to `end`."""
    x = list(np.arange(0, round(fine_until / fine) + 1) * fine)
    step = fine
    while x[-1] < end:
        step *= ratio
        x.append(x[-1] + step)
    return np.array(x)


def rule(points: int) -> list[tuple[float, float, float]]:
    """Tensor Gauss rule on [-1, 1]^2: (xi, eta, weight)."""
    x, w = np.polynomial.legendre.leggauss(points)
    return [(a, b, wa * wb) for a, wa in zip(x, w, strict=True) for b, wb in zip(x, w, strict=True)]


def lagrange(x: float) -> tuple[np.ndarray, np.ndarray]:
    """Quadratic shape functions on the nodes -1, 0, 1, and derivatives."""
    return np.array([x * (x - 1) / 2, 1 - x * x, x * (x + 1) / 2]), np.array([x - 0.5, -2 * x, x + 0.5])


def solved(matrix: sp.csr_matrix, right: np.ndarray) -> np.ndarray:
    """(n,) the solution of the system; a direct solver holds its factors, gigabytes of them, until told."""
    solver = PyPardisoSolver()
    try:
        return solver.solve(matrix, right)
    finally:
        solver.free_memory(everything=True)


@dataclass(frozen=True)
class Grading:
    """How far a body goes, in tip radii, and by how much elements grow, along the surface and down.

    Its own compliance, from being clamped at 10,000 tip radii, is 0.01 % of the force a tip radius deep.
    """

    extent: float = 10_000.0
    along: float = 1.18
    down: float = 1.12


FINE, COARSE = Grading(), Grading(60.0, 1.3, 1.3)
"""For a law, and enough for one law over another on the same elements."""


class HalfSpace:
    """Axisymmetric body r >= 0, z <= 0, fixed at its far ends; displacements (n, 2). along, down: the borders
    of its elements, else those of `grading`."""

    def __init__(
        self,
        element: float,
        poisson_ratio: float,
        law: str,
        until: float,
        stiffening: float = 0.0,
        grading: Grading = FINE,
        along: np.ndarray | None = None,
        down: np.ndarray | None = None,
    ) -> None:
        r = along
        if r is None:
            r = graded(element, 1.0 + 0.35 * until, grading.along, grading.extent)
        z = graded(element, 0.5, grading.down, grading.extent) if down is None else down
        r, z = _halved(r), -_halved(z)
        nr, nz = len(r), len(z)
        self.points = np.stack(np.meshgrid(r, z, indexing="ij"), -1).reshape(-1, 2)
        i, j = np.meshgrid(np.arange(0, nr - 1, 2), np.arange(0, nz - 1, 2), indexing="ij")
        corner = (i * nz + j).ravel()
        self.cells = corner[:, None] + np.array([a * nz + b for a in range(3) for b in range(3)])
        self.top = np.arange(nr) * nz
        self.law = law
        self.stiffening = stiffening
        self.lam, self.mu = lame_parameters(1.0, poisson_ratio)
        n = len(self.points)
        fixed = np.zeros((n, 2), dtype=bool)
        fixed[self.points[:, 0] == 0, 0] = True
        fixed[(self.points[:, 0] == r[-1]) | (self.points[:, 1] == z[-1])] = True
        self.fixed = fixed
        self.rules = [
            (self._gradients(p), part) for q, part in ((3, "shear"), (2, "volume")) for p in rule(q)
        ]
        dof = (2 * self.cells[:, :, None] + np.arange(2)).reshape(len(self.cells), 18)
        self.rows = np.repeat(dof, 18, axis=1).ravel()
        self.columns = np.tile(dof, (1, 18)).ravel()
        self.dof = dof

    def _gradients(self, point: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
        """B (m, 9 nodes, 2 displacements -> 5 entries rr, rz, zr, zz, hoop) and weights (m,)."""
        (nx, dx), (ny, dy) = lagrange(point[0]), lagrange(point[1])
        shape = np.outer(nx, ny).ravel()
        local = np.stack([np.outer(dx, ny).ravel(), np.outer(nx, dy).ravel()])
        p = self.points[self.cells]
        jacobian = np.einsum("ln,mnc->mlc", local, p)
        gradient = np.einsum("mcl,ln->mnc", np.linalg.inv(jacobian), local)
        radius = p[:, :, 0] @ shape
        b = np.zeros((len(p), 9, 2, 5))
        b[:, :, 0, 0], b[:, :, 0, 1] = gradient[:, :, 0], gradient[:, :, 1]
        b[:, :, 1, 2], b[:, :, 1, 3] = gradient[:, :, 0], gradient[:, :, 1]
        b[:, :, 0, 4] = shape / radius[:, None]
        weight = np.abs(np.linalg.det(jacobian)) * point[2] * radius * 2 * np.pi
        return b.reshape(len(p), 18, 5), weight

    def forces(self, u: np.ndarray) -> tuple[np.ndarray, sp.csc_matrix]:
        """Internal nodal forces (2n,) and tangent."""
        m = len(self.cells)
        element = np.zeros((m, 18))
        tangent = np.zeros((m, 18, 18))
        local = u.ravel()[self.dof]
        for (b, weight), part in self.rules:
            h = np.einsum("mxe,mx->me", b, local)
            stress, stiffness = self._stress(h, part)
            element += np.einsum("mxe,me,m->mx", b, stress, weight)
            tangent += b @ (stiffness * weight[:, None, None]) @ b.transpose(0, 2, 1)
        n = 2 * len(self.points)
        return (
            np.bincount(self.dof.ravel(), weights=element.ravel(), minlength=n),
            sp.csr_matrix((tangent.ravel(), (self.rows, self.columns)), shape=(n, n)),
        )

    def _stress(self, h: np.ndarray, part: str) -> tuple[np.ndarray, np.ndarray]:
        """First Piola stress (m, 5) and its derivative (m, 5, 5) of one part of the energy."""
        m = len(h)
        eye = np.array([1.0, 0, 0, 1.0, 1.0])
        if self.law == "linear":
            if part == "volume":
                d = np.broadcast_to(self.lam * np.outer(eye, eye), (m, 5, 5))
            else:
                swap = np.eye(5)
                swap[[1, 2]] = swap[[2, 1]]
                d = np.broadcast_to(self.mu * (np.eye(5) + swap), (m, 5, 5))
            return np.einsum("mef,mf->me", d, h), d
        f = h + eye
        plane = f[:, 0] * f[:, 3] - f[:, 1] * f[:, 2]
        j = plane * f[:, 4]
        if j.min() <= 0:
            raise ArithmeticError("an element is inverted")
        g = np.stack([f[:, 3], -f[:, 2], -f[:, 1], f[:, 0]], axis=1) / plane[:, None]
        g = np.concatenate([g, 1 / f[:, 4:5]], axis=1)  # F^-T
        # -d(F^-T)/dF: entry (i J),(k L) is G_iL G_kJ
        cross = np.zeros((m, 5, 5))
        for x, (i, a) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
            for y, (k, c) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
                cross[:, x, y] = g[:, 2 * i + c] * g[:, 2 * k + a]
        cross[:, 4, 4] = g[:, 4] ** 2
        if part == "shear":
            excess = (f * f).sum(axis=1) - 3  # I1 - 3
            factor, slope = (each[:, None] for each in hardening(excess, self.stiffening))
            steeper = 2 * slope[:, :, None] * f[:, :, None] * f[:, None, :]
            tangent = self.mu * (factor[:, :, None] * np.eye(5) + steeper + cross)
            return self.mu * (factor * f - g), tangent
        log = np.log(j)[:, None]
        return self.lam * log * g, self.lam * (g[:, :, None] * g[:, None, :] - log[:, :, None] * cross)

    def sideways(self, u: np.ndarray) -> sp.csr_matrix:
        """(3 n, 3 n) stiffness of small motions sideways upon the deformation u (n, 2).

        First harmonic: (U cos, V sin, W cos) of the angle, with S = U + V as unknown, which vanishes on
        the axis.
        """
        m, n = len(self.cells), len(self.points)
        local = u.ravel()[self.dof]
        tangent = np.zeros((m, 27, 27))
        for (b, weight), part in self.rules:
            h = np.einsum("mxe,mx->me", b, local)
            gradient, hoop = b[:, 0::2, 0:2], b[:, 0::2, 4]
            even = np.zeros((m, 9, 3, 5))  # rr, rz, zr, zz, hoop: cosines
            odd = np.zeros((m, 9, 3, 4))  # r-theta, z-theta, theta-r, theta-z: sines
            even[:, :, 0, 0:2], even[:, :, 2, 2:4], even[:, :, 1, 4] = gradient, gradient, hoop
            odd[:, :, 1, 0], odd[:, :, 2, 1] = -hoop, -hoop
            odd[:, :, 1, 2:4], odd[:, :, 0, 2:4] = gradient, -gradient
            cosines, sines = even.reshape(m, 27, 5), odd.reshape(m, 27, 4)
            stiffness = self._stress(h, part)[1]
            half = 0.5 * weight[:, None, None]  # the mean of cos^2 and of sin^2
            tangent += cosines @ (stiffness * half) @ cosines.transpose(0, 2, 1)
            tangent += sines @ (self._sideways(h, part) * half) @ sines.transpose(0, 2, 1)
        dof = (3 * self.cells[:, :, None] + np.arange(3)).reshape(m, 27)
        rows, columns = np.repeat(dof, 27, axis=1).ravel(), np.tile(dof, (1, 27)).ravel()
        return sp.csr_matrix((tangent.ravel(), (rows, columns)), shape=(3 * n, 3 * n))

    def held_sideways(self) -> np.ndarray:
        """(n, 3) bool, of U, S, W that are held."""
        held = np.zeros((len(self.points), 3), dtype=bool)
        held[self.points[:, 0] == 0, 1:] = True
        held[self.fixed[:, 1]] = True
        return held

    def tangential_stiffness(self, u: np.ndarray, stuck: np.ndarray) -> float:
        """Force a unit sideways motion of the nodes `stuck`, small upon the deformation u (n, 2)."""
        matrix, held = self.sideways(u), self.held_sideways()
        held[stuck] = True
        given = np.zeros(held.shape)
        given[stuck, 0] = 1.0
        motion = given.ravel()
        free = np.flatnonzero(~held.ravel())
        motion[free] = solved(matrix[free][:, free].tocsr(), -(matrix @ motion)[free])
        return float(motion @ (matrix @ motion))

    def _sideways(self, h: np.ndarray, part: str) -> np.ndarray:
        """Second derivative of the energy for r-theta, z-theta, theta-r, theta-z: (m, 4, 4)."""
        result = np.zeros((len(h), 4, 4))
        if self.law == "linear":
            if part == "shear":
                for a, b in ((0, 2), (1, 3)):
                    result[:, [a, b, a, b], [a, b, b, a]] = self.mu
            return result
        f = h + np.array([1.0, 0, 0, 1.0, 1.0])
        plane = f[:, 0] * f[:, 3] - f[:, 1] * f[:, 2]
        inverse_hoop = 1 / f[:, 4]
        g = np.stack([f[:, 3], -f[:, 1], -f[:, 2], f[:, 0]], axis=1) / plane[:, None]  # F^-T: rr, zr, rz, zz
        factor = self.mu if part == "shear" else -self.lam * np.log(plane * f[:, 4])
        if part == "shear":
            excess = (f * f).sum(axis=1) - 3
            result += self.mu * hardening(excess, self.stiffening)[0][:, None, None] * np.eye(4)
        # G_iL G_kJ couples (r theta) or (z theta) with (theta R) or (theta Z)
        for a, i in ((0, 0), (1, 1)):
            for b, c in ((2, 0), (3, 1)):
                entry = g[:, [[0, 2], [1, 3]][i][c]]
                result[:, a, b] += factor * entry * inverse_hoop
                result[:, b, a] += factor * entry * inverse_hoop
        return result


def _halved(x: np.ndarray) -> np.ndarray:
    """The coordinates with mid points between."""
    result = np.empty(2 * len(x) - 1)
    result[::2] = x
    result[1::2] = (x[1:] + x[:-1]) / 2
    return result
