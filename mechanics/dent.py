"""The dent: laws of a rigid sphere pressed into an elastic half-space, normal force against indentation.

Every law is a table over x = delta / R: force = E* R^2 c(x) x^1.5 and contact radius = R alpha(x) sqrt(x), with
E* = E / (1 - nu^2). Hertz is c = 4/3, alpha = 1. One numba kernel reads them all, so a new law is a new table.
The tangential stiffness of the stick is 8 G a / (2 - nu) (Mindlin), G = E / (2 (1 + nu)).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numba import njit

from mechanics.errors import OptionError

DEPTH_LIMIT = 3.0  # of the tables, in tip radii; beyond it the last c and alpha hold
_STEPS = 600


@dataclass(frozen=True)
class DentLaw:
    """A named law: table (n, 2) of c and alpha at x = 0 to DEPTH_LIMIT in equal steps; source in words."""

    name: str
    table: np.ndarray
    source: str

    def force(
        self, depth_m: np.ndarray, young_modulus_pa: float, poisson_ratio: float, tip_radius_m: float
    ) -> np.ndarray:
        """Force on the object along -n, N, for indentations (k,) m of a half-space (0 where not positive)."""
        plane_strain = young_modulus_pa / (1 - poisson_ratio**2)
        depth = np.atleast_1d(np.asarray(depth_m, dtype=float))
        return np.array([dent_force(self.table, d, tip_radius_m, plane_strain)[0] for d in depth])

    def contact_radius(self, depth_m: np.ndarray, tip_radius_m: float) -> np.ndarray:
        """Radius of the contact circle (k,) m."""
        depth = np.atleast_1d(np.asarray(depth_m, dtype=float))
        return np.array([dent_force(self.table, d, tip_radius_m, 1.0)[2] for d in depth])


@cache
def dent_law(name: str) -> DentLaw:
    """The law of that name; raises OptionError for an unknown one."""
    if name not in _LAWS:
        raise OptionError(f"'{name}' is no dent law; allowed are {', '.join(_LAWS)}")
    table, source = _LAWS[name]()
    table = np.ascontiguousarray(table, dtype=float)
    table.setflags(write=False)
    return DentLaw(name, table, source)


def dent_laws() -> tuple[str, ...]:
    """The names of all laws."""
    return tuple(_LAWS)


def grid() -> np.ndarray:
    """The indentations in tip radii at which every table is given."""
    return np.linspace(0.0, DEPTH_LIMIT, _STEPS + 1)


def _hertz() -> tuple[np.ndarray, str]:
    return np.tile([4 / 3, 1.0], (_STEPS + 1, 1)), "Hertz 1882: paraboloid, a << R"


def _sphere() -> tuple[np.ndarray, str]:
    # parametrised by a/R < 1, dense where x grows without bound
    a = 1 - np.geomspace(1.0, 1e-5, 40001)[1:]
    log = np.log((1 + a) / (1 - a))
    depth = a * log / 2
    force = (a * a + 1) / 2 * log - a
    x = grid()
    table = np.empty((len(x), 2))
    table[:, 0] = np.interp(x, depth, force / depth**1.5)
    table[:, 1] = np.interp(x, depth, a / np.sqrt(depth))
    return table, "Sneddon 1965: exact profile of a sphere, frictionless"


def _neo_hookean() -> tuple[np.ndarray, str]:
    from numpy import loadtxt

    x, c, alpha = loadtxt(Path(__file__).with_name("dent_neo_hookean.csv"), delimiter=",", unpack=True)
    table = np.stack([np.interp(grid(), x, c), np.interp(grid(), x, alpha)], axis=1)
    return table, "axisymmetric finite-strain solution, see docs/mechanics.md"


_LAWS = {"hertz": _hertz, "sphere": _sphere, "neo-hookean": _neo_hookean}


@njit(cache=True, error_model="numpy")
def dent_force(table, depth, radius, plane_strain_modulus):  # type: ignore[no-untyped-def]
    """(force N, stiffness N/m, contact radius m) at an indentation, m; zeros where it is not positive."""
    if not depth > 0.0:
        return 0.0, 0.0, 0.0
    x = depth / radius
    last = table.shape[0] - 1
    step = DEPTH_LIMIT / last
    position = x / step
    i = int(position)
    slope = 0.0
    if i >= last:
        c, alpha = table[last, 0], table[last, 1]
    else:
        f = position - i
        slope = (table[i + 1, 0] - table[i, 0]) / step
        c = table[i, 0] + f * (table[i + 1, 0] - table[i, 0])
        alpha = table[i, 1] + f * (table[i + 1, 1] - table[i, 1])
    root = np.sqrt(x)
    force = plane_strain_modulus * radius * radius * c * x * root
    stiffness = plane_strain_modulus * radius * (1.5 * c * root + slope * x * root)
    return force, stiffness, radius * alpha * root


def effective_radius(tip_radius_m: float, curvature: float | np.ndarray) -> float | np.ndarray:
    """Radius of the sphere whose dent in a plane equals the tip's in a surface of that mean curvature, m.

    1 / R_eff = 1 / R + curvature (Hertz; convex positive). A hollow tighter than the tip is cut at 4 R.
    """
    return 1.0 / np.maximum(1.0 / tip_radius_m + curvature, 0.25 / tip_radius_m)
