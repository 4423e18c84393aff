"""The 1D models of Goksel et al.: their laws, from the fits of single presses, spread over the surface.

Equation numbers: Goksel et al., Deformable Haptic Model Generation Through Manual Exploration. As there, the
parameters that were fitted at the palpated points are interpolated by radial basis functions. The exponent r
and the *force at 5 mm* are interpolated, and k follows from them: k itself has the unit N/m^r, so its values
at places of different r cannot be averaged. u: depth.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.errors import ModelError
from palpate.mechanics.presses.table import Presses

RIVALS = ("kelvin-voigt", "hunt-crossley")
"""Those that a finite-element model is held against."""
REFERENCE_DEPTH_M = 5e-3
Fits = Mapping[str, np.ndarray]
"""Parameters of single presses by the name of their column."""


class OneDLaws(NamedTuple):
    """f = k u^r + b u^s du/dt of each palpation: all (n,); see `forces_of`."""

    k: np.ndarray
    b: np.ndarray
    r: np.ndarray
    s: np.ndarray


def spread_law(
    points: np.ndarray, site: np.ndarray, law: OneDLaws, at: np.ndarray, interpolation: str = "rbf"
) -> OneDLaws:
    """The law at places `at` (q, 3) m from presses at `points` (n, 3) m, of sites (n,); those with a NaN are
    left out.

    interpolation: 'rbf' (linear kernel, the biharmonic spline of space; repeats at a site are averaged
    first) or 'nearest'. Values are kept within the range of the palpations'. Raises ModelError where none is
    usable.
    """
    u = REFERENCE_DEPTH_M
    with np.errstate(invalid="ignore"):
        columns = np.column_stack([law.k * u**law.r, law.b * u**law.s, law.r, law.s])
    good = np.isfinite(columns).all(axis=1) & np.isfinite(points).all(axis=1)
    if not good.any():
        raise ModelError("the model's palpations hold no parameters of this 1D model: reconstruct it again")
    points, site, columns = points[good], site[good], columns[good]
    if interpolation == "nearest":
        values = columns[cKDTree(points).query(at)[1]]
    else:
        places, means = _averaged(points, columns, site=site)
        if len(places) == 1:
            values = np.tile(means, (len(at), 1))
        else:
            from scipy.interpolate import RBFInterpolator  # here: it takes as long to load as a model

            values = RBFInterpolator(places, means, kernel="linear", degree=0)(at)
            values = np.clip(values, columns.min(axis=0), columns.max(axis=0))
    force, damping, r, s = values.T
    return OneDLaws(force / u**r, damping / u**s, r, s)


def _averaged(*arrays: np.ndarray, site: np.ndarray) -> tuple[np.ndarray, ...]:
    """Means (s, c) of each array (n, c) over the presses of every site."""
    group = np.unique(site, return_inverse=True)[1]
    size = np.bincount(group)[:, None]
    return tuple(np.column_stack([np.bincount(group, weights=c) for c in a.T]) / size for a in arrays)


def forces_of(law: OneDLaws, presses: Presses, moved_m: np.ndarray | None = None) -> np.ndarray:
    """(n, 3) N of every row, along the normal: a law of each press, (p,) columns. moved_m: (p,) by how much
    earlier each press meets the surface than it says."""
    k, b, r, s = (column[presses.press] for column in law)
    u = presses.depth if moved_m is None else presses.depth + moved_m[presses.press]
    inside = u > 0
    safe = np.where(inside, u, 1.0)
    push = np.where(inside, np.maximum(k * safe**r + b * safe**s * presses.rate, 0.0), 0.0)
    return push[:, None] * presses.normal[presses.press]


def _kelvin_voigt(fits: Fits) -> OneDLaws:
    """Eq. (1): f = k u + b du/dt."""
    k = fits["k_kv"]
    return OneDLaws(k, fits["b_kv"], np.ones_like(k), np.zeros_like(k))


def _hunt_crossley(fits: Fits) -> OneDLaws:
    """Eq. (2): f = k u^r + b u^r du/dt."""
    r = fits["r_hc"]
    return OneDLaws(fits["k_hc"], fits["b_hc"], r, r)


def _undamped(fits: Fits) -> OneDLaws:
    """Hunt-Crossley without damping, eq. (6): f = k u^r."""
    k = fits["k_c"]
    return OneDLaws(k, np.zeros_like(k), fits["r_c"], np.zeros_like(k))


def _one_exponent(fits: Fits) -> OneDLaws:
    """f = k_H u^r with one exponent for the whole object, eq. (6) fitted again at the mean exponent."""
    k = fits["k_h"]
    r = np.full_like(k, np.nanmean(fits["r_c"])) if len(k) else k
    return OneDLaws(k, np.zeros_like(k), r, np.zeros_like(k))


LAWS: dict[str, Callable[[Fits], OneDLaws]] = {
    "kelvin-voigt": _kelvin_voigt,
    "hunt-crossley": _hunt_crossley,
    "hunt-crossley-undamped": _undamped,
    "hunt-crossley-kh": _one_exponent,
}
