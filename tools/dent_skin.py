"""Recompute what a bonded skin makes of a dent (mechanics/contact/dent_skin.csv; axisymmetric, offline).

A rigid sphere of radius 1 is pressed, sticking, into a half-space under a layer of another modulus, as
tools.dent_table presses a uniform one; force and sideways stiffness are divided by the uniform one's at the
same depth. What the surface moves sideways counts: a stiff skin that bends draws itself under the sphere.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import CubicSpline

from palpate.mechanics.disk.writing import atomic_file
from tools.dent_half_space import COARSE, HalfSpace, graded, solved
from tools.dent_table import Press, descent
from tools.script import script

THICKNESSES = (0.06, 0.12, 0.24, 0.48, 0.96, 1.92)
"""In tip radii."""
LOG_RATIOS = (-2.0, -1.0, -0.4, 0.4, 1.0, 2.0, 3.0)
DEPTHS = np.round(np.linspace(0.2, 1.2, 11) ** 2, 4)
"""In tip radii, even in their root."""
NU, ELEMENT, ROWS = 0.49, 0.06, 3
"""Poisson's ratio; smallest element, tip radii; elements through a skin."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which skins, where to write."""
    parser.add_argument("--thicknesses", type=float, nargs="+", default=list(THICKNESSES))
    parser.add_argument("--log-ratios", type=float, nargs="+", default=list(LOG_RATIOS))
    parser.add_argument("-o", "--output", help="CSV that palpate.mechanics.contact.skin reads")


class Skinned(HalfSpace):
    """The half-space with its uppermost elements `ratio` times as stiff; thickness in tip radii."""

    def __init__(self, thickness: float, ratio: float, element: float) -> None:
        levels = _levels(thickness, element)
        super().__init__(element, NU, "linear", float(DEPTHS[-1]), grading=COARSE, down=levels)
        own = np.where(self.points[self.cells].mean(axis=1)[:, 1] > -thickness, ratio, 1.0)
        self.rules = [((b, weight * own), part) for (b, weight), part in self.rules]


class LinearPress(Press):
    """The same way down by the compliance of the rings that may touch: a linear body is solved once."""

    def __init__(self, body: HalfSpace, reach: float) -> None:
        super().__init__(body)
        self.rings = body.top[body.points[body.top, 0] <= reach]
        tangent = body.forces(self.u)[1]
        self.compliance = _condensed(tangent, body.fixed, self.rings)
        self.sideways = _condensed(body.sideways(self.u), body.held_sideways(), self.rings)

    def solve(self, depth: float) -> float:
        """As `Press.solve`."""
        body, stuck = self.body, self.rings[: self.stuck]
        target = (self.anchor[: self.stuck] + (0.0, 1.0 - depth) - body.points[stuck]).ravel()
        force = np.linalg.solve(self.compliance[1 : 2 * self.stuck, 1 : 2 * self.stuck], target[1:])
        self.u[self.rings] = (self.compliance[:, 1 : 2 * self.stuck] @ force).reshape(-1, 2)
        self.force = -float(force[::2].sum())
        place = body.points[self.rings[self.stuck]] + self.u[self.rings[self.stuck]]
        return float(np.hypot(place[0], place[1] - (1.0 - depth)) - 1.0)

    def next_ring(self, depth: float) -> float:
        """As `Press.next_ring`."""
        touches = super().next_ring(depth)
        if touches <= depth:
            raise ArithmeticError("the skin has bulged onto the sphere: no linear body goes there")
        return touches

    def tangential_stiffness(self) -> float:
        """As `Press.tangential_stiffness`."""
        free = np.ones((self.stuck, 3), dtype=bool)
        free[0, 1:] = False
        own = np.flatnonzero(free.ravel())
        given = np.zeros((self.stuck, 3))
        given[:, 0] = 1.0
        moved = given.ravel()[own]
        return float(moved @ np.linalg.solve(self.sideways[np.ix_(own, own)], moved))


def _condensed(stiffness: sp.csr_matrix, fixed: np.ndarray, rings: np.ndarray) -> np.ndarray:
    """(k n, k n) displacements of the rings' k components by unit forces there; 0 where they are fixed."""
    free, each = np.flatnonzero(~fixed.ravel()), fixed.shape[1]
    wanted = (each * rings[:, None] + np.arange(each)).ravel()
    right = np.zeros((fixed.size, len(wanted)))
    right[wanted, np.arange(len(wanted))] = 1.0
    moved = np.zeros_like(right)
    moved[free] = solved(stiffness[free][:, free].tocsr(), right[free])
    return moved[wanted]


def _levels(thickness: float, element: float) -> np.ndarray:
    """Depths of the elements' rows, one of them the skin's."""
    through = np.linspace(0.0, thickness, max(ROWS, int(np.ceil(thickness / element))) + 1)
    below = graded(min(element, through[1]), 0.5, COARSE.down, COARSE.extent)
    return np.append(through, thickness + below[1:])


def pressed(body: HalfSpace) -> np.ndarray:
    """(k, 3): depth, force and sideways stiffness (tip radii, modulus 1) as each ring touches."""
    way = descent(LinearPress(body, float(DEPTHS[-1])), float(DEPTHS[-1]))
    return np.array([(depth, force, sideways) for depth, force, _, sideways in way])


def logarithms(thickness: float, log_ratio: float) -> np.ndarray:
    """(k, 2) ln of the force and of the sideways stiffness over the uniform half-space's at DEPTHS; NaN
    beyond the deepest, over log_ratio."""
    curves = []
    for ratio in (1.0, float(np.exp(log_ratio))):
        body = Skinned(thickness, ratio, min(ELEMENT, thickness / 2))
        x, force, sideways = np.log(pressed(body)[1::2]).T
        at = np.log(np.where(DEPTHS < 1.02 * np.exp(x[-1]), DEPTHS, np.nan))
        curves.append(np.stack([CubicSpline(x, y)(at) for y in (force, sideways)], axis=1))
    return (curves[1] - curves[0]) / log_ratio


def run(arguments: argparse.Namespace) -> dict:
    """Press, print, and write the table."""
    rows = []
    for thickness, log_ratio in itertools.product(arguments.thicknesses, arguments.log_ratios):
        found = logarithms(thickness, log_ratio)
        rows += [(thickness, log_ratio, x, *y) for x, y in zip(DEPTHS, found, strict=True)]
        print(thickness, log_ratio, np.round(found.T, 4).tolist(), flush=True)
    if arguments.output:
        header = (
            f"half-spaces under a bonded skin over uniform ones, linear, Poisson's ratio {NU};\n"
            "made by 'python -m tools.dent_skin'\n"
            "thickness/R, ln of the modulus ratio, depth/R, ln(force ratio) over it, the same sideways"
        )
        with atomic_file(Path(arguments.output)) as temporary:
            np.savetxt(temporary, rows, fmt=("%g", "%g", "%g", "%.4f", "%.4f"), delimiter=",", header=header)
    return {"rows": np.array(rows)}


if __name__ == "__main__":
    sys.exit(script(sys.modules["__main__"]))
