"""Recompute the tables of the finite-strain and the linear sticking dent (axisymmetric, offline).

A rigid sphere of radius 1 is pressed into a half-space that sticks to it where it touches; ring after
ring of the surface comes into contact, and the depth at which the next ring touches is found to rounding.
`linear`: small strains, the contact followed on the displaced surface. `neo-hookean`: psi =
mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2. `--stiffening` r makes of mu/2 (I1 - 3) the family of
mechanics.effects.strain_stiffening.
`--family` solves for all ratios of that family's table and writes what they are over the neo-Hookean dent.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from palpate.mechanics.contact.dent import dent_law, grid
from palpate.mechanics.disk.writing import atomic_file
from tools.dent_half_space import COARSE, FINE, Grading, HalfSpace, solved
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
    parser.add_argument(
        "-o", "--output", help="CSV of depth / R, c and alpha (palpate.mechanics.contact.dent)"
    )


class Press:
    """The sphere's way down: which rings of the surface stick, and where on the sphere."""

    def __init__(self, body: HalfSpace) -> None:
        self.body = body
        self.rings = body.top
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
            step[free] = solved(tangent[free][:, free].tocsr(), right)
            u = u + step.reshape(u.shape)
            if np.abs(step).max() < 1e-9:
                break
        else:
            raise ArithmeticError("no convergence")
        self.u = u
        self.force = -float(body.forces(u)[0].reshape(-1, 2)[rings, 1].sum())
        place = body.points[body.top[self.stuck]] + u[body.top[self.stuck]]
        return float(np.hypot(place[0], place[1] - (1.0 - depth)) - 1.0)

    def tangential_stiffness(self) -> float:
        """`HalfSpace.tangential_stiffness`, of the rings that stick."""
        return self.body.tangential_stiffness(self.u, self.rings[: self.stuck])

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
            if abs(gap_b) < 1e-9 or a == b:  # or it has bulged onto the sphere already
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
    grading: Grading = FINE,
    quiet: bool = True,
) -> np.ndarray:
    """(k, 4): depth / R, force / (E* R^2), contact radius / R, sideways stiffness / (R 8 G / (2 - nu)).

    A row a ring of the surface, at the depth where it touches.
    """
    body = HalfSpace(element, poisson_ratio, law, until, stiffening, grading)
    stick = 4 / ((1 + poisson_ratio) * (2 - poisson_ratio))
    rows = []
    for depth, force, radius, sideways in descent(Press(body), until):
        rows.append((depth, force * (1 - poisson_ratio**2), radius, sideways / stick))
        if not quiet:
            print("".join(f"{value:11.6f}" for value in rows[-1]), flush=True)
    return np.array(rows)


def descent(press: Press, until: float) -> Iterator[tuple[float, float, float, float]]:
    """Depth, force, contact radius and sideways stiffness, tip radii and modulus 1, as each ring touches."""
    depth, before = 0.0, 0.0
    while depth < until and press.stuck < len(press.rings) - 1:
        try:
            depth = press.next_ring(depth)
        except ArithmeticError as error:
            print(f"stopped at depth {depth:.3f} R: {error}")
            return
        # the ring that just touches carries nothing yet: the stick is half way between with and without it
        sideways = press.tangential_stiffness()
        yield depth, press.force, float(press.anchor[press.stuck - 1, 0]), 0.5 * (before + sideways)
        before = sideways


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
