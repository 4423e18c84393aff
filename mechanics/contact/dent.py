"""The dent: laws of a rigid sphere pressed into an elastic half-space, normal force against indentation.

Every law is a table over x = delta / R of four numbers, with E* = E / (1 - nu^2), G = E / (2 (1 + nu)):
    normal force        E* R^2 c(x) (1 + k R g(x)) x^1.5    (k: mean curvature of the surface)
    sideways stiffness  8 G / (2 - nu) a grip(x), a = R held(x) x^0.5    (stick; Mindlin's 8 G a / (2 - nu) of
    a contact of radius a where grip = 1)
Hertz is c = 4/3, held = grip = 1, g = 0. grip never falls: the strain of a deep dent makes every ring of the
contact stiffer. What makes the stick softer with depth, as a stiff skin does, makes outer rings narrower. A
tip that slips is pushed back less, the deeper the more: c falls with Coulomb's friction (`slipping`). On a
curved surface R is the effective radius, which is Hertz's answer for a small contact; g is what a deep one on
a bump or in a hollow has beyond it. One numba kernel reads them all, so a new law is a new table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.kernels import kernel
from palpate.mechanics.plausible import USUAL_POISSON_RATIO

DEPTH_LIMIT = 3.0  # of the tables, in tip radii; beyond it the last row holds
_STEPS = 600
BENT = (-0.3, 0.4)
"""Mean curvatures times the tip's radius that curved bodies were solved for; beyond, the nearest holds."""
FINITE = "neo-hookean"
"""The law at finite strain; the others are of linear bodies."""
_RATIOS = {
    "linear": (0.10, 0.30, 0.40, USUAL_POISSON_RATIO),
    FINITE: (0.40, USUAL_POISSON_RATIO),
}
"""Poisson's ratios that a sticking law is tabulated for; straight lines between and beyond."""


_YIELDS = 0.35
"""Below the usual Poisson's ratio by which a base no longer braces: what lies over it gives way in volume.
Of the usual one's bracing six solved places (flanks, a layer) ask for 0.84 at 0.45, 0.69 at 0.40, 0.47 at
0.30."""
STIFFEST = 0.8
"""Of a contact's own compliance, the most that what is stiff close below may take away."""
_TOLD = 1e-3
"""Share of the force that a tip without friction loses by slipping from which the solutions tell how much of
that friction leaves."""
GRIPS = 0.7
"""Coulomb's friction from which a tip that goes straight in sticks."""


@dataclass(frozen=True)
class DentLaw:
    """A named law: table (n, 5) of c, held, grip, g and the slope of grip against x, at x = 0 to DEPTH_LIMIT
    in equal steps; its source in words.

    braced: share of the bend that a base below adds (TouchSites.braced). At finite strain it comes nearer as
    the tip goes in; a linear body keeps its shape, and what gives way in volume feels it less.
    """

    name: str
    table: np.ndarray
    source: str
    braced: float = 0.0

    def force(
        self, depth_m: np.ndarray, young_modulus_pa: float, poisson_ratio: float, tip_radius_m: float
    ) -> np.ndarray:
        """Force on the object along -n, N, for indentations (k,) m of a half-space (0 where not positive)."""
        plane_strain = young_modulus_pa / (1 - poisson_ratio**2)
        depth = np.array(depth_m, dtype=float, ndmin=1, order="C")  # one kind for the kernel
        force = np.empty(len(depth))
        _dent_forces(self.table, depth, float(tip_radius_m), float(plane_strain), force)
        return force

    def scaled(
        self,
        c: np.ndarray | float,
        tau: np.ndarray | float = 1.0,
        bent: np.ndarray | float = 0.0,
        *,
        name: str = "",
    ) -> DentLaw:
        """The law with its normal force and sideways stiffness multiplied by factors, one or one a row of
        `grid()`; bent: by how much that of the force grows with the bend of the surface, over it."""
        own = self.table
        table = _table(own[:, 0] * c, own[:, 1], own[:, 1] * own[:, 2] * tau, own[:, 3] + bent)
        return replace(self, name=name or self.name, table=table)


@lru_cache(maxsize=64)
def dent_law(
    name: str, poisson_ratio: float = USUAL_POISSON_RATIO, friction: float = float("inf")
) -> DentLaw:
    """The law of that name for that Poisson's ratio and Coulomb's friction; raises OptionError for an unknown
    one."""
    if name not in _LAWS:
        raise OptionError(f"'{name}' is no dent law; allowed are {', '.join(_LAWS)}")
    (c, alpha, tau), source = _LAWS[name](poisson_ratio)
    bent = np.zeros(len(c))
    if name in _FOLLOWED:
        bent = _beyond_hertz()
        c = c * slipping(name, poisson_ratio, friction)
    braced = 0.0
    if name == FINITE:
        braced = float(np.clip(1 - (USUAL_POISSON_RATIO - poisson_ratio) / _YIELDS, 0.0, 1.0))
    return DentLaw(name, _table(c, alpha, tau, bent), source, braced)


def _table(c: np.ndarray, alpha: np.ndarray, tau: np.ndarray, g: np.ndarray) -> np.ndarray:
    """(n, 5) of a law, read only. alpha: (n,) contact radius over R x^0.5; tau: (n,) sideways stiffness, of
    Mindlin's under a contact of that radius R x^0.5."""
    grip = np.maximum.accumulate(tau / alpha)
    root = np.sqrt(grid())
    held = np.append(tau[0] / grip[0], np.maximum.accumulate(tau * root / grip)[1:] / root[1:])
    table = np.column_stack([c, held, grip, g, np.gradient(grip, DEPTH_LIMIT / _STEPS)])
    table.setflags(write=False)
    return table


def slipping(name: str, poisson_ratio: float, friction: float) -> np.ndarray:
    """(n,) of `grid()`: normal force of a tip that slips over that of one that sticks, going straight in.

    From finite elements, neo-Hookean (tools.dent_slip); linear, where a surface that slips deep runs through
    itself, as much of the way to Sneddon's frictionless sphere.
    """
    if friction >= GRIPS:
        return np.ones(_STEPS + 1)
    from scipy.interpolate import PchipInterpolator  # here: a tip that sticks needs none

    ratios, frictions, shares = _slip_shares()
    between = np.clip((poisson_ratio - ratios[0]) / (ratios[1] - ratios[0]), 0.0, 1.0)
    share = (1 - between) * shares[0] + between * shares[1]
    kept = PchipInterpolator(np.append(frictions, GRIPS), np.vstack([share, np.ones(_STEPS + 1)]))(friction)
    if name != "linear":
        return kept
    # shallow dents of a compressible solid lose less than the solutions can tell: there the share is that of
    # the first depth that tells it
    told = 1 - share[0] > _TOLD
    slips = np.interp(grid(), grid()[told], (1 - kept[told]) / (1 - share[0][told]))
    return 1 - slips * np.maximum(1 - _sphere()[0][0] / _tabulated(name, poisson_ratio)[0][0], 0.0)


@lru_cache(maxsize=1)
def _slip_shares() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poisson's ratios (2,), frictions (m,), and the shares (2, m, n) of the force that they leave; deeper
    than was solved the last holds."""
    head, *rows = np.loadtxt(Path(__file__).with_name("dent_slip.csv"), delimiter=",")
    ratios, frictions = np.unique([row[0] for row in rows]), np.unique([row[1] for row in rows])
    depths = np.append(0.0, head[2:])
    shares = [np.interp(grid(), depths, np.append(1.0, row[2:])) for row in rows]
    return ratios, frictions, np.reshape(shares, (len(ratios), len(frictions), -1))


def dent_laws() -> tuple[str, ...]:
    """The names of all laws."""
    return tuple(_LAWS)


@lru_cache(maxsize=1)
def grid() -> np.ndarray:
    """(n,), read only: the indentations in tip radii at which every table is given."""
    made = np.linspace(0.0, DEPTH_LIMIT, _STEPS + 1)
    made.setflags(write=False)
    return made


def _hertz() -> tuple[np.ndarray, str]:
    """(3, n) c, alpha and tau = alpha grip, and their source; so are the others."""
    return np.outer([4 / 3, 1.0, 1.0], np.ones(_STEPS + 1)), "Hertz 1882: paraboloid, a << R"


@lru_cache(maxsize=1)
def _sphere() -> tuple[np.ndarray, str]:
    # parametrised by a/R < 1, dense where the indentation grows without bound
    a = 1 - np.geomspace(1.0, 1e-5, 40001)[1:]
    log = np.log((1 + a) / (1 - a))
    depth = a * log / 2
    force = (a * a + 1) / 2 * log - a
    x = grid()
    c, alpha = (np.interp(x, depth, y) for y in (force / depth**1.5, a / np.sqrt(depth)))
    return np.stack([c, alpha, alpha]), "Sneddon 1965: exact profile of a sphere, frictionless"


def _tabulated(name: str, poisson_ratio: float) -> tuple[np.ndarray, str]:
    """A sticking sphere grips a compressible solid, the more so the deeper: c is 6 % greater at 2 R for 0.40
    than for 0.49."""
    ratios = _RATIOS[name]
    upper = int(np.clip(np.searchsorted(ratios, poisson_ratio), 1, len(ratios) - 1))
    low, high = ratios[upper - 1 : upper + 1]
    share = (poisson_ratio - low) / (high - low)
    table = (1 - share) * _read(name, low) + share * _read(name, high)
    return table, f"axisymmetric finite elements, sticking sphere, nu = {poisson_ratio:g}"


@lru_cache(maxsize=16)
def _read(name: str, poisson_ratio: float) -> np.ndarray:
    usual = poisson_ratio == USUAL_POISSON_RATIO
    suffix = "" if usual else f"_{poisson_ratio:.2f}"
    path = Path(__file__).with_name(f"dent_{name.replace('-', '_')}{suffix}.csv")
    x, *columns = np.loadtxt(path, delimiter=",", unpack=True)
    return np.stack([np.interp(grid(), x, y) for y in columns])


@lru_cache(maxsize=1)
def _beyond_hertz() -> np.ndarray:
    """(n,) g of the tables: from bodies of revolution with a bump or a hollow (tools.dent_bend); deeper than
    they were pressed it goes on as it ends."""
    x, slope = np.loadtxt(Path(__file__).with_name("dent_bend.csv"), delimiter=",", unpack=True)
    last = (slope[-1] - slope[-2]) / (x[-1] - x[-2])
    return np.interp(grid(), x, slope) + last * np.maximum(grid() - x[-1], 0.0)


_FOLLOWED = ("linear", FINITE)
"""Laws whose contact grips the tip and is followed to great depths, on curved surfaces too."""

_LAWS: dict[str, Callable[[float], tuple[np.ndarray, str]]] = {
    "hertz": lambda nu: _hertz(),
    "sphere": lambda nu: _sphere(),
    "linear": lambda nu: _tabulated("linear", nu),
    FINITE: lambda nu: _tabulated(FINITE, nu),
}


@kernel
def dent_force(table, depth, radius, bend, plane_strain_modulus):
    """(force N, stiffness N/m, radius that holds m, grip, its slope 1/m) at an indentation, m; zeros where it
    is not positive. radius: effective, m. bend: mean curvature of the surface times the tip's radius."""
    if not depth > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    x = depth / radius
    last = table.shape[0] - 1
    step = DEPTH_LIMIT / last
    position = x / step
    i = int(position)
    slope = 0.0
    if i >= last:
        c, held, grip = table[last, 0] * (1.0 + bend * table[last, 3]), table[last, 1], table[last, 2]
        stiffens = 0.0
    else:
        f = position - i
        low = table[i, 0] * (1.0 + bend * table[i, 3])
        high = table[i + 1, 0] * (1.0 + bend * table[i + 1, 3])
        slope = (high - low) / step
        c = low + f * (high - low)
        held = table[i, 1] + f * (table[i + 1, 1] - table[i, 1])
        grip = table[i, 2] + f * (table[i + 1, 2] - table[i, 2])
        stiffens = table[i, 4] + f * (table[i + 1, 4] - table[i, 4])
    root = np.sqrt(x)
    force = plane_strain_modulus * radius * radius * c * x * root
    stiffness = plane_strain_modulus * radius * (1.5 * c * root + slope * x * root)
    return force, stiffness, radius * held * root, grip, stiffens / radius


@kernel
def _dent_forces(table, depth, radius, plane_strain_modulus, force):
    """`dent_force` of indentations (k,) of a plane, into force (k,) N."""
    for i in range(len(depth)):
        force[i], _, _, _, _ = dent_force(table, depth[i], radius, 0.0, plane_strain_modulus)


def effective_radius(tip_radius_m: float, curvature: float | np.ndarray) -> float | np.ndarray:
    """Radius of the sphere whose dent in a plane equals the tip's in a surface of that curvature, m.

    1 / R_eff = 1 / R + curvature (Hertz; convex positive). A hollow tighter than the tip is cut at 4 R.
    """
    return 1.0 / np.maximum(1.0 / tip_radius_m + curvature, 0.25 / tip_radius_m)


def ellipse_curvature(principal: np.ndarray, tip_radius_m: float) -> np.ndarray:
    """(k,) 1/m: curvature of the sphere that a small contact takes a surface of principal curvatures (k, 2)
    for: their mean, less what an elliptic contact gives way (Hertz; Johnson, Contact Mechanics, 4.2).

    Fitted to the elliptic integrals, within 0.2 % of the mean relative curvature up to a ratio of ten.
    """
    mean, half = principal.mean(axis=1), 0.5 * np.ptp(principal, axis=1)
    relative = 1.0 / effective_radius(tip_radius_m, mean)
    q = np.minimum(half / relative, 1.0) ** 2
    return mean - relative * q * (2 / 3 + 0.13 * q + 0.09 * q**2)


def bend_of(
    tip_radius_m: float, curvature: float | np.ndarray, bracing: float | np.ndarray = 0.0
) -> float | np.ndarray:
    """Mean curvature times the tip's radius, as `dent_force` takes it, within what `effective_radius` keeps
    and the table of curved bodies was solved for, and what a base close below adds (mechanics.contact.edges).
    """
    return np.clip(np.asarray(curvature, dtype=float) * tip_radius_m, *BENT) + bracing * tip_radius_m


@kernel
def dent_load(depth_m):
    """A measure of the load on a place, m^2.5, at a depth, m: its stored energy grows as a dent's."""
    return depth_m**2.5 if depth_m > 0.0 else 0.0
