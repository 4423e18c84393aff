"""What a bonded skin of another modulus makes of a dent: factors on its normal force and sideways stiffness.

A small contact feels the skin alone, a wide one what lies within. Solved by axisymmetric finite elements of a
sticking sphere on a layer bonded to a half-space, Poisson's ratio 0.49, at small strains ('python -m
tools.dent_skin'; contact/dent_skin.csv). That of a flat punch (Burmister 1945) is 6 % too soft where a stiff
skin, drawn under the sphere as it bends, meets it early.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.contact.dent import grid
from palpate.mechanics.model.material import Skin

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

TABLE = Path(__file__).with_name("dent_skin.csv")
"""Columns thickness / R, ln of the modulus ratio, depth / R, ln of the factor on the force over the ratio's,
the same of the sideways stiffness."""
_STEP = 0.05
"""Of ln(thickness / R), by which a slope is taken."""


@cache
def _solved() -> tuple[np.ndarray, np.ndarray, CubicSpline]:
    """ln(thickness / R) (t,), ln ratio (m,), and a spline over the first to (m, 2, k), at `grid()`."""
    from scipy.interpolate import CubicSpline, PchipInterpolator  # here: what has no skin needs none

    thickness, ratio, depth, *logs = np.loadtxt(TABLE, delimiter=",", unpack=True)
    thicknesses, ratios = np.unique(thickness), np.unique(ratio)
    curves = np.empty((len(thicknesses), len(ratios), 2, len(grid())))
    for i, t in enumerate(thicknesses):
        for j, m in enumerate(ratios):
            own = (thickness == t) & (ratio == m) & np.isfinite(logs[0])
            at = np.append(0.0, np.sqrt(depth[own]))
            # the smallest contact feels the skin alone; beyond the deepest solution the last holds
            within = np.minimum(np.sqrt(grid()), at[-1])
            for k in range(2):
                curves[i, j, k] = PchipInterpolator(at, np.append(1.0, logs[k][own]))(within)
    return np.log(thicknesses), ratios, CubicSpline(np.log(thicknesses), curves)


def _logarithms(log_thickness: float, log_ratio: float) -> np.ndarray:
    """(2, n) ln of the factors at `grid()`. Thinner than was solved they fall with the thickness, thicker
    what is left of the inside does; ratios beyond go on in proportion."""
    from scipy.interpolate import PchipInterpolator

    thicknesses, ratios, curves = _solved()
    within = float(np.clip(log_thickness, thicknesses[0], thicknesses[-1]))
    share = PchipInterpolator(ratios, curves(within))(float(np.clip(log_ratio, ratios[0], ratios[-1])))
    beyond = float(np.exp(-abs(log_thickness - within)))
    share = share * beyond if log_thickness < within else 1 - (1 - share) * beyond
    return np.asarray(log_ratio * share)


def skin_factors(skin: Skin, tip_radius_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) each at `grid()`: factors on the normal force and the sideways stiffness, and by how much the
    first grows with the bend of the surface, over it (mechanics.contact.dent.DentLaw.scaled): on a bump the
    tip is blunter by less, so the same skin is thicker beside it."""
    thickness, ratio = float(np.log(skin.thickness_m / tip_radius_m)), float(np.log(skin.modulus_ratio))
    force, sideways = np.exp(_logarithms(thickness, ratio))
    more, less = (_logarithms(thickness + side * _STEP, ratio)[0] for side in (0.5, -0.5))
    return force, sideways, (more - less) / _STEP
