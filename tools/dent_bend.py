"""Recompute what a deep dent on a curved surface has beyond Hertz's effective radius (axisymmetric, offline).

A sphere of radius 1 is pressed, sticking, into the top of a neo-Hookean body of revolution with a bump or a
hollow of mean curvature k over some five tip radii. What the body gives by its shape is taken off as the
renderer does: the compliance under a Gaussian patch on the same body, less the half-space's. The rest is a
dent; its force over the half-space's at the effective radius is 1 + k g(x), x the dent over that radius.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from palpate.mechanics.compliance.patch import half_space_compliance
from palpate.mechanics.contact.dent import dent_law, effective_radius, grid
from palpate.mechanics.disk.writing import atomic_file
from tools.dent_half_space import COARSE, Grading, HalfSpace, lagrange, rule, solved
from tools.dent_table import Press
from tools.script import script

PATCH_WIDTH = 0.8
"""Of the Gaussian patch, in tip radii: 4 mm under a tip of 5 (mechanics.compliance.sites.PATCH_WIDTH_M)."""
REACH = 6.0
"""Tip radii over which a bump falls off."""
BENDS = (-0.2, -0.1, 0.1, 0.2)
DEPTHS = np.linspace(0.1, 1.6, 16)
ELEMENT = 0.06


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which bodies, how deep, where to write."""
    parser.add_argument("--bends", type=float, nargs="+", default=list(BENDS), help="curvature x tip radius")
    parser.add_argument("--reach", type=float, default=REACH, help="of a bump, in tip radii")
    parser.add_argument("--until", type=float, default=1.9, help="greatest depth over the tip's radius")
    parser.add_argument(
        "-o", "--output", help="CSV of dent / effective radius and g (palpate.mechanics.contact.dent)"
    )


class Bump(HalfSpace):
    """The half-space with its columns lowered by k r^2 / (2 + 2 (r / reach)^2)."""

    def __init__(
        self, bend: float, reach: float, poisson_ratio: float, law: str, until: float, grading: Grading
    ) -> None:
        super().__init__(ELEMENT, poisson_ratio, law, until, grading=grading)
        r = self.points[:, 0]
        self.points[:, 1] -= 0.5 * bend * r**2 / (1 + (r / reach) ** 2)
        self.rules = [
            (self._gradients(p), part) for q, part in ((3, "shear"), (2, "volume")) for p in rule(q)
        ]


def patch_far(body: HalfSpace, width: float, poisson_ratio: float) -> float:
    """Compliance along the axis under a Gaussian patch on a linear body, less a half-space's; modulus 1."""
    weights = np.zeros(len(body.points))
    for k in range(0, len(body.top) - 2, 2):
        nodes = body.top[k : k + 3]
        for x, part in zip(*np.polynomial.legendre.leggauss(6), strict=True):
            shape, slope = lagrange(x)
            place, along = shape @ body.points[nodes], slope @ body.points[nodes]
            squared = ((place - body.points[body.top[0]]) ** 2).sum()
            ring = 2 * np.pi * place[0] * np.hypot(*along) * part
            weights[nodes] += ring * np.exp(-squared / (2 * width**2)) * shape
    weights /= weights.sum()
    free = np.flatnonzero(~body.fixed.ravel())
    load, moved = np.zeros(body.fixed.size), np.zeros(body.fixed.size)
    load[1::2] = -weights
    tangent = body.forces(np.zeros_like(body.points))[1]
    moved[free] = solved(tangent[free][:, free].tocsr(), load[free])
    half = half_space_compliance(np.array([1.0, 0.0, 0.0]), poisson_ratio, width)[0, 0]
    return float(-weights @ moved[1::2]) - half


def excess(bend: float, reach: float, until: float, poisson_ratio: float = 0.49) -> np.ndarray:
    """(len(DEPTHS),) force of the dent over the half-space's at the effective radius, less 1."""
    linear = Bump(bend, reach, poisson_ratio, "linear", until, COARSE)
    far = patch_far(linear, PATCH_WIDTH, poisson_ratio)
    press = Press(Bump(bend, reach, poisson_ratio, "neo-hookean", until, COARSE))
    depth, rows = 0.0, []
    while depth < until and press.stuck < len(press.body.top) - 1:
        depth = press.next_ring(depth)
        rows.append((depth, press.force))
    depth_of, force = np.array(rows[1::2]).T
    radius = effective_radius(1.0, bend)
    x = (depth_of - far * force) / radius
    law = np.interp(x, grid(), dent_law("neo-hookean", poisson_ratio).table[:, 0])
    ratio = force * (1 - poisson_ratio**2) / (radius**2 * x**1.5 * law)
    return np.interp(DEPTHS, x, ratio - 1, right=np.nan)


def run(arguments: argparse.Namespace) -> dict[str, np.ndarray]:
    """Solve, print, and write the table."""
    flat = excess(0.0, arguments.reach, arguments.until)
    bends = np.array(arguments.bends)
    found = []
    for bend in bends:
        found.append(excess(bend, arguments.reach, arguments.until) - flat)
        print(f"{bend:+.2f}", " ".join(f"{100 * value:+.2f}" for value in found[-1]), "%", flush=True)
    slope = np.array(
        [np.nansum(column * bends) / np.sum(bends[np.isfinite(column)] ** 2) for column in np.array(found).T]
    )
    # smooth, and nothing at no depth
    powers = np.arange(1, 4)
    fit = np.linalg.lstsq(DEPTHS[:, None] ** powers, slope, rcond=None)[0]
    depth = np.linspace(0.0, DEPTHS[-1], 33)
    table = np.column_stack([depth, depth[:, None] ** powers @ fit])
    if arguments.output:
        header = (
            f"bodies of revolution with curvatures x tip radius {arguments.bends} over {arguments.reach} tip "
            f"radii,\nneo-Hookean, sticking sphere; made by 'python -m tools.dent_bend'\n"
            "dent / effective radius, g"
        )
        with atomic_file(Path(arguments.output)) as temporary:
            np.savetxt(temporary, table, fmt="%.5f", delimiter=",", header=header)
    return {"bends": bends, "excess": np.array(found), "table": table}


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
