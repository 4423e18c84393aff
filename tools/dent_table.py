"""Recompute the tables of the finite-strain and the linear sticking dent (axisymmetric, offline).

A rigid sphere of radius 1 is pressed into a half-space that sticks to it where it touches; ring after
ring of the surface comes into contact, and the depth at which the next ring touches is found to rounding.
Nine-node quadrilaterals, the volumetric part integrated at the four reduced points. `linear`: small
strains, the contact followed on the displaced surface. `neo-hookean`: psi = mu/2 (I1 - 3 - 2 ln J) +
lambda/2 (ln J)^2. `--stiffening` r makes of mu/2 (I1 - 3) the family of mechanics.effects.strain_stiffening.
`--family` solves for all ratios of that family's table and writes what they are over the neo-Hookean dent.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from pypardiso import PyPardisoSolver

from mechanics.contact.dent import dent_law, grid
from mechanics.disk.writing import atomic_file
from mechanics.effects.strain_stiffening import hardening
from mechanics.elastic.elasticity import lame_parameters
from tools.script import script


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Law, resolution, where to write."""
    parser.add_argument("--law", choices=("neo-hookean", "linear"), default="neo-hookean")
    parser.add_argument("--poisson-ratio", type=float, default=0.49)
    parser.add_argument(
        "--stiffening", type=float, default=0.0, help="c20 / c10 of the neo-hookean law at small strains"
    )
    parser.add_argument(
        "--family", action="store_true", help="the table of all stiffening and softening laws"
    )
    parser.add_argument("--element", type=float, default=0.06, help="smallest element over the tip's radius")
    parser.add_argument("--until", type=float, default=2.0, help="greatest depth over the tip's radius")
    parser.add_argument("-o", "--output", help="CSV of depth / R, c and alpha (mechanics.contact.dent)")


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


@dataclass(frozen=True)
class Grading:
    """How far a body goes, in tip radii, and by how much elements grow, along the surface and down."""

    extent: float = 400.0
    along: float = 1.18
    down: float = 1.12


COARSE = Grading(60.0, 1.3, 1.3)
"""Enough for one law over another on the same elements."""


class HalfSpace:
    """Axisymmetric body r >= 0, z <= 0, fixed at its far ends; displacements (n, 2)."""

    def __init__(
        self,
        element: float,
        poisson_ratio: float,
        law: str,
        until: float,
        stiffening: float = 0.0,
        grading: Grading = Grading(),
    ) -> None:
        r = graded(element, 1.0 + 0.35 * until, grading.along, grading.extent)
        z = -graded(element, 0.5, grading.down, grading.extent)
        r, z = _halved(r), _halved(z)
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

    def tangential_stiffness(self, u: np.ndarray, stuck: np.ndarray) -> float:
        """Force a unit sideways motion of the nodes `stuck`, small upon the deformation u (n, 2).

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
        matrix = sp.csr_matrix((tangent.ravel(), (rows, columns)), shape=(3 * n, 3 * n))
        held = np.zeros((n, 3), dtype=bool)
        held[self.points[:, 0] == 0, 1:] = True
        held[self.fixed[:, 1]] = True
        held[stuck] = True
        given = np.zeros((n, 3))
        given[stuck, 0] = 1.0
        motion = given.ravel()
        free = np.flatnonzero(~held.ravel())
        motion[free] = PyPardisoSolver().solve(matrix[free][:, free].tocsr(), -(matrix @ motion)[free])
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


class Press:
    """The sphere's way down: which rings of the surface stick, and where on the sphere."""

    def __init__(self, body: HalfSpace) -> None:
        self.solver = PyPardisoSolver()
        self.body = body
        self.u = np.zeros_like(body.points)
        self.stuck = 1
        self.anchor = np.zeros((len(body.top), 2))  # of stuck rings, relative to the sphere's centre
        self.anchor[0] = (0.0, -1.0)
        self.force = 0.0

    def solve(self, depth: float) -> float:
        """Bring the sphere to `depth`; the gap of the next ring. Raises ArithmeticError without
        convergence."""
        body = self.body
        held = body.fixed.copy()
        target = self.u.copy()
        rings = body.top[: self.stuck]
        held[rings] = True
        target[rings] = self.anchor[: self.stuck] + (0.0, 1.0 - depth) - body.points[rings]
        free = np.flatnonzero(~held.ravel())
        u = self.u.copy()
        change = (target - u).ravel()
        for iteration in range(25):
            force, tangent = body.forces(u)
            right = -(force + tangent @ change)[free] if iteration == 0 else -force[free]
            step = change.copy() if iteration == 0 else np.zeros(u.size)
            step[free] = self.solver.solve(tangent[free][:, free].tocsr(), right)
            u = u + step.reshape(u.shape)
            if np.abs(step).max() < 1e-9:
                break
        else:
            raise ArithmeticError("no convergence")
        self.u = u
        self.force = -float(body.forces(u)[0].reshape(-1, 2)[rings, 1].sum())
        place = body.points[body.top[self.stuck]] + u[body.top[self.stuck]]
        return float(np.hypot(place[0], place[1] - (1.0 - depth)) - 1.0)

    def next_ring(self, depth: float) -> float:
        """The depth at which the next ring touches, from `depth`; it sticks from there on."""
        start = self.u.copy()
        a, gap_a = depth, self.solve(depth)
        ring = self.body.points[self.body.top[self.stuck], 0]
        b = depth + max(0.02, 0.5 * gap_a) if depth > 0 else ring**2
        for _ in range(12):
            try:
                gap_b = self.solve(b)
            except ArithmeticError:
                self.u = start.copy()
                b = 0.5 * (a + b)
                continue
            if abs(gap_b) < 1e-9:
                break
            a, gap_a, b = b, gap_b, max(b - gap_b * (b - a) / (gap_b - gap_a), depth)
        place = self.body.points[self.body.top[self.stuck]] + self.u[self.body.top[self.stuck]]
        self.anchor[self.stuck] = place - (0.0, 1.0 - b)
        self.stuck += 1
        return b


def press_curve(
    law: str,
    poisson_ratio: float,
    element: float,
    until: float,
    *,
    stiffening: float = 0.0,
    grading: Grading = Grading(),
    quiet: bool = True,
) -> np.ndarray:
    """(k, 4): depth / R, force / (E* R^2), contact radius / R, sideways stiffness / (R 8 G / (2 - nu)).

    A row a ring of the surface, at the depth where it touches.
    """
    body = HalfSpace(element, poisson_ratio, law, until, stiffening, grading)
    press = Press(body)
    depth, rows, before = 0.0, [], 0.0
    stick = 4 / ((1 + poisson_ratio) * (2 - poisson_ratio))
    while depth < until and press.stuck < len(body.top) - 1:
        try:
            depth = press.next_ring(depth)
        except ArithmeticError as error:
            print(f"stopped at depth {depth:.3f} R: {error}")
            break
        radius = press.anchor[press.stuck - 1, 0]
        # the ring that just touches carries nothing yet: the stick is half way between with and without it
        sideways = body.tangential_stiffness(press.u, body.top[: press.stuck]) / stick
        rows.append((depth, press.force * (1 - poisson_ratio**2), radius, 0.5 * (before + sideways)))
        before = sideways
        if not quiet:
            print("".join(f"{value:11.6f}" for value in rows[-1]), flush=True)
    return np.array(rows)


def smooth_table(rows: np.ndarray) -> np.ndarray:
    """(k, 4) depth / R, c, alpha, tau, as mechanics.contact.dent reads them, from the rows of `press_curve`.

    Ring by ring the curve wavers by half a percent (a mid-side ring touches late). Its ratio to Sneddon's
    frictionless sphere is smooth and goes to 1 at no depth: a quartic in the square root of the depth is
    fitted to the corner rings, and held beyond the last one.
    """
    x, force, radius, sideways = rows[1::2][rows[1::2, 0] > 0.05].T
    sphere = dent_law("sphere").table
    depth = grid()
    measured = (force / x**1.5, radius / np.sqrt(x), sideways / np.sqrt(x))
    columns = [depth]
    for k, values in enumerate(measured):
        ratio = values / np.interp(x, depth, sphere[:, k]) - 1
        powers = np.arange(1, 5)
        fit = np.linalg.lstsq(np.sqrt(x)[:, None] ** powers, ratio, rcond=None)[0]
        held = np.sqrt(np.minimum(depth, x[-1]))
        columns.append(sphere[:, k] * (1 + held[:, None] ** powers @ fit))
    return np.stack(columns, axis=1)


FAMILY_RATIOS = (-0.5, -0.15, 0.15, 0.6, 1.6, 4.0)
FAMILY_DEPTHS = np.round(np.linspace(0.3, 1.25, 11) ** 2, 4)
"""Even in the root of the depth."""


def logarithms(rows: np.ndarray) -> np.ndarray:
    """(k, 2) ln of the force and of the sideways stiffness over Sneddon's sphere at FAMILY_DEPTHS, from the
    rows of `press_curve`; NaN beyond the deepest.

    A quartic in the root of the depth is fitted to the corner rings, as in `smooth_table`, to the logarithm.
    """
    x, force, _, sideways = rows[1::2][rows[1::2, 0] > 0.05].T
    sphere, powers = dent_law("sphere").table, np.arange(1, 5)
    columns = []
    for values, k in ((force / x**1.5, 0), (sideways / np.sqrt(x), 2)):
        log = np.log(values / np.interp(x, grid(), sphere[:, k]))
        fit = np.linalg.lstsq(np.sqrt(x)[:, None] ** powers, log, rcond=None)[0]
        columns.append(np.sqrt(FAMILY_DEPTHS)[:, None] ** powers @ fit)
    deepest = x[-1] * 1.02  # of a ring's step
    return np.where(FAMILY_DEPTHS[:, None] <= deepest, np.stack(columns, axis=1), np.nan)


def family(poisson_ratio: float, element: float, ratios: tuple[float, ...] = FAMILY_RATIOS) -> np.ndarray:
    """(k, 4) ratio, depth / R, ln(force over the neo-Hookean one) / ratio, the same of the sideways
    stiffness: what mechanics.effects.strain_stiffening reads."""
    until = float(FAMILY_DEPTHS[-1])
    plain = logarithms(press_curve("neo-hookean", poisson_ratio, element, until, grading=COARSE))
    table = []
    for ratio in ratios:
        rows = press_curve("neo-hookean", poisson_ratio, element, until, stiffening=ratio, grading=COARSE)
        print(f"c20/c10 {ratio:+.2f}: to {rows[-1, 0]:.2f} R", flush=True)
        logs = (logarithms(rows) - plain) / ratio
        solved = np.isfinite(logs[:, 0])
        table.append(np.column_stack([np.full(solved.sum(), ratio), FAMILY_DEPTHS[solved], logs[solved]]))
    return np.concatenate(table)


def run(arguments: argparse.Namespace) -> dict:
    """Press, print, and write the table."""
    if arguments.family:
        table = family(arguments.poisson_ratio, arguments.element)
        if arguments.output:
            header = (
                f"half-spaces that stiffen or soften, over the neo-Hookean one; Poisson's ratio "
                f"{arguments.poisson_ratio};\nmade by 'python -m tools.dent_table --family --element "
                f"{arguments.element}'\nc20/c10, depth/R, ln(force ratio) over c20/c10, the same sideways"
            )
            with atomic_file(Path(arguments.output)) as temporary:
                np.savetxt(temporary, table, fmt=("%g", "%g", "%.5f", "%.5f"), delimiter=",", header=header)
        return {"table": table}
    rows = press_curve(
        arguments.law,
        arguments.poisson_ratio,
        arguments.element,
        arguments.until,
        stiffening=arguments.stiffening,
        quiet=False,
    )
    table = smooth_table(rows)
    if arguments.output:
        write_table(Path(arguments.output), table, arguments)
    return {"rows": rows, "table": table}


def write_table(path: Path, table: np.ndarray, arguments: argparse.Namespace) -> None:
    """Write the CSV that mechanics.contact.dent reads, with its provenance in the header."""
    header = (
        f"{arguments.law} (c20/c10 {arguments.stiffening}) half-space under a sticking sphere, "
        f"Poisson's ratio {arguments.poisson_ratio},\npressed to {arguments.until} R, smallest element "
        f"{arguments.element} R; made by 'python -m tools.dent_table'\ndepth/R, c, alpha, tau"
    )
    with atomic_file(path) as temporary:
        np.savetxt(temporary, table, fmt="%.6f", delimiter=",", header=header)


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
