"""Each press fitted by the touch law: its modulus in closed form, its first touch as a nuisance.

For a given path the force of the touch law (mechanics.contact.touch) is proportional to the modulus, f = e
g(d), with d the tip's displacement since first touch and g the law for unit modulus; so e is linear least
squares, and only the shift u0 of the first touch along the normal is searched (Gauss-Newton, all presses at
once).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.presses.table import Presses

_BLOCK_S = 0.004
_LEAD_S = 0.03
_NOTHING = 1e-200  # no press that tells its modulus has a determinant so small
_FOLLOWS = 3.0
"""A press whose force misses the law by more than so many times what noise and law explain does not follow it
(a tip that leapt over its first touch): its modulus is as unsure as it misses."""
_CORRELATED, _STRETCHES = 10, 10
"""A lasting error of the law binds so many rows of a press together, where they are a tenth of it or less:
it lasts for a tenth of a press at most, so that few rows far apart are independent."""


@dataclass(frozen=True)
class LawFit:
    """Every press fitted by one law up to one depth.

    modulus_pa: (k,). relative_error: (k,) standard error of ln e, infinite where a press does not tell it;
    it grows as the rows that tell become few, and no number of rows is too small for it.
    onset_shift_m: (k,) first touch moves by this along the inward normal. rms_n: (k,) vector misfit, N.
    cost: (k,) weighted squared residuals, comparable between laws at the same depth. rows: (k,) rows used.
    """

    law: str
    depth_m: float
    modulus_pa: np.ndarray
    relative_error: np.ndarray
    onset_shift_m: np.ndarray
    rms_n: np.ndarray
    cost: np.ndarray
    rows: np.ndarray

    @property
    def telling(self) -> np.ndarray:
        """(k,) bool, presses that tell their modulus: it is positive, and its error below the whole of it."""
        e, error = self.modulus_pa, self.relative_error
        return np.isfinite(e) & (e > 0) & np.isfinite(error) & (error < 1)


def press_data(presses: Presses) -> Presses:
    """Means over 4 ms of every press from 30 ms before first touch to loss of touch, free-air force off."""
    return presses.net.window(_LEAD_S, 0.0).thinned(_BLOCK_S)


def fit_law(
    data: Presses,
    sites: TouchSites,
    tip_radius_m: float,
    law: str,
    depth_m: float,
    law_error: float,
    noise_n: float,
    start: LawFit | None = None,
) -> LawFit:
    """Modulus and onset shift of every press from its samples shallower than `depth_m`.

    data: `press_data`. noise_n: N, standard deviation of a raw force component. start: an earlier fit whose
    onset shifts are a good guess. law_error: error of the law as a share of the force, where the place is not
    solved (TouchSites.law_error); a sample's variance is noise^2 + (law_error |f|)^2.
    """
    press, k = data.press, len(sites)
    noise_n = noise_n / np.sqrt(data.block)
    onset_sd = 2 * np.maximum(data.onset_error_m, 2e-5)
    normals = sites.normals[press]
    used = -np.einsum("ij,ij->i", data.displacement, normals) < depth_m
    squared_force = np.einsum("ij,ij->i", data.force, data.force)
    share = sites.law_error(law_error)
    weight = np.where(used, 1.0 / (noise_n**2 + share[press] ** 2 * squared_force / 3), 0.0)

    def unit(shift: np.ndarray) -> np.ndarray:
        return forces_at(
            sites,
            data.displacement + shift[press, None] * normals,
            data.starts,
            young_modulus_pa=1.0,
            tip_radius_m=tip_radius_m,
            law=law,
        )

    def summed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.bincount(press, weights=weight * np.einsum("ij,ij->i", a, b), minlength=k)

    def modulus(g: np.ndarray) -> np.ndarray:
        return summed(g, data.force) / np.maximum(summed(g, g), 1e-300)

    step = 2e-5
    shift = np.zeros(k) if start is None else start.onset_shift_m
    g = unit(shift)
    e = modulus(g)
    for _ in range(6):
        slope = e[press, None] * (unit(shift + step) - g) / step
        residual = data.force - e[press, None] * g
        a_ee, a_eu = summed(g, g), summed(g, slope)
        a_uu = summed(slope, slope) + onset_sd**-2.0
        y_e, y_u = summed(g, residual), summed(slope, residual) - shift * onset_sd**-2.0
        det = np.maximum(a_ee * a_uu - a_eu**2, 1e-300)
        change = np.clip((a_ee * y_u - a_eu * y_e) / det, -2e-4, 2e-4)
        shift = np.clip(shift + change, -1e-3, 1e-3)
        g = unit(shift)
        e = modulus(g)
        if np.abs(change).max() < 5e-6:
            break
    residual = data.force - e[press, None] * g
    cost = summed(residual, residual)
    rows = np.bincount(press, weights=used, minlength=k)
    squared = np.bincount(press, weights=used * (residual**2).sum(axis=1), minlength=k)
    scale = np.maximum(cost / np.maximum(3 * rows, 1), 1.0)
    known = (e > 0) & (det > _NOTHING)
    error = np.full(k, np.inf)
    bound = np.clip(np.diff(data.starts) / _STRETCHES, 1, _CORRELATED)
    error[known] = np.sqrt((bound * scale * a_uu)[known] / det[known]) / e[known]
    rms = np.sqrt(squared / np.maximum(rows, 1))
    felt = np.sqrt(np.bincount(press, weights=used * squared_force, minlength=k) / np.maximum(rows, 1))
    missed = rms / np.maximum(felt, 1e-300)
    follows = missed < _FOLLOWS * np.hypot(share, np.sqrt(3) * noise_n / felt.clip(1e-300))
    error = np.where(follows, error, np.maximum(error, missed))
    return LawFit(law, depth_m, e, error, shift, rms, cost, rows)


CARRIED_BACK = ("points", "cycle")
"""Kinds of presses whose first touch nobody recorded."""


def touched_by_law(
    presses: Presses, sites: TouchSites, laws: Sequence[str], law_error: float, noise_n: float
) -> Presses:
    """The presses with first touches where the touch law that fits them best has them, where they were not
    recorded; others, and those that tell no modulus, stay.

    A first touch that is carried back along a law of two springs is off by a tenth of the depth, and its
    error goes with the stiffness; what is held out would be pressed that much too deep.
    """
    carried = np.isin(presses.kinds, CARRIED_BACK)
    if not carried.any():
        return presses
    data, deepest = press_data(presses), float(presses.depth_m.max()) + 1e-3
    fits = [fit_law(data, sites, presses.tip_radius_m, law, deepest, law_error, noise_n) for law in laws]
    return touched_as_fitted(presses, min(fits, key=lambda fit: fit.cost[carried].sum()))


def touched_as_fitted(presses: Presses, fit: LawFit) -> Presses:
    """The presses with first touches where a fit has them, where they were not recorded."""
    carried = np.isin(presses.kinds, CARRIED_BACK)
    into = np.where(carried & fit.telling, fit.onset_shift_m, 0.0)
    return replace(
        presses, centre=presses.centre - into[:, None] * presses.normal, depth_m=presses.depth_m - into
    )


def far_sensitivity(
    data: Presses, sites: TouchSites, fit: LawFit, tip_radius_m: float, law_error: float, noise_n: float
) -> np.ndarray:
    """(k,) m: change of ln e of every press per unit of change of its far-field compliance along the normal,
    1/m; 0 where a press tells no modulus."""
    step = 0.05 * np.abs(np.einsum("ka,kab,kb->k", sites.normals, sites.far, sites.normals)) + 0.1
    along = np.einsum("ka,kb->kab", sites.normals, sites.normals)
    changed = replace(sites, far=sites.far + step[:, None, None] * along)
    other = fit_law(data, changed, tip_radius_m, fit.law, fit.depth_m, law_error, noise_n, fit)
    known = (other.modulus_pa > 0) & (fit.modulus_pa > 0)
    ratio = np.where(known, other.modulus_pa, 1.0) / np.where(known, fit.modulus_pa, 1.0)
    return np.log(ratio) / step
