"""The global modulus with a finite tip: all samples of all presses, weighted by noise and by what the law can
claim.

For a given path the force of the touch law (mechanics.touch) is proportional to the modulus: f = e g(d), with
d the tip's displacement since first touch and g the law for unit modulus. So each press gives its modulus by
linear least squares, with its first touch u0 as a nuisance; the global modulus weights presses by their
precision and by the spread between them, and its interval resamples sites (repeats at one place share that
place's errors of shape).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mechanics.options import option
from mechanics.sites import TouchSites
from mechanics.touch import touch_forces
from reconstruct.contacts import Exploration

LAWS = ("sphere", "neo-hookean", "hertz")
_BLOCK_S = 0.004
_RANGES_M = (0.002, 0.003, 0.004, 0.005, 0.006, 0.008, 0.012)


@dataclass(frozen=True)
class ModulusOptions:
    """How the global modulus is estimated with a finite tip."""

    law: str = option(
        "auto",
        "dent of the tip: auto takes the one that the forces fit best",
        choices=("auto", *LAWS),
        flag="--dent-law",
    )
    greatest_depth_m: float | None = option(
        None, "samples deeper than this are left out", unit="m", flag="--greatest-depth"
    )
    law_error: float = option(
        0.03, "error of the law as a share of the force: it weights deep samples down", flag="--law-error"
    )
    bootstraps: int = option(1000, "resamples of the sites for the 95 % interval", flag="--bootstraps")
    site_m: float = option(
        0.008, "presses closer than this are repeats of one site", unit="m", flag="--site-size"
    )


@dataclass(frozen=True)
class PressData:
    """Block means of all presses: displacement since first touch (n, 3) m, force on the tool (n, 3) N.

    starts: (k + 1,) rows of each press. noise_n: standard deviation of a row an axis. onset_sd_m: (k,) prior
    of the first touch along the normal.
    """

    displacement: np.ndarray
    force: np.ndarray
    starts: np.ndarray
    noise_n: float
    onset_sd_m: np.ndarray

    @property
    def press(self) -> np.ndarray:
        """(n,) the press of each row."""
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))


@dataclass(frozen=True)
class LawFit:
    """Each press fitted by one law up to one depth: modulus (k,) Pa, relative standard error, onset shift
    (k,) m.

    rms_n: (k,) vector misfit in N. cost: sum of squared weighted residuals, comparable between laws.
    """

    law: str
    depth_m: float
    modulus_pa: np.ndarray
    relative_error: np.ndarray
    onset_shift_m: np.ndarray
    rms_n: np.ndarray
    cost: float
    samples: int


@dataclass(frozen=True)
class ModulusFit:
    """The global modulus, its 95 % interval, every press's own, and how it was chosen.

    weights: (k,) share of each press, 0 for those that the robust estimate leaves out. between: relative
    spread between sites beyond the noise. shape_error: relative standard error from the shape's uncertainty.
    by_law: modulus and misfit a law; by_depth: (depth, modulus) for the chosen law.
    """

    modulus_pa: float
    ci95_pa: tuple[float, float]
    press: LawFit
    weights: np.ndarray
    between: float
    shape_error: float
    reason: str
    by_law: dict[str, tuple[float, float]] = field(default_factory=dict)
    by_depth: tuple[tuple[float, float], ...] = ()


def press_data(exploration: Exploration, sites: TouchSites) -> PressData:
    """Block means (4 ms) of every press from 30 ms before first touch to its end; site normals set the
    onset."""
    recording = exploration.recording
    force = recording.force_on_tool - exploration.free_air
    block = max(1, round(_BLOCK_S * recording.sample_rate_hz))
    lead = int(0.03 * recording.sample_rate_hz)
    rows_d, rows_f, starts = [], [], [0]
    for contact in exploration.contacts:
        a, b = max(0, contact.start - lead), contact.end
        n = max(1, (b - a) // block)
        part = slice(a, min(a + n * block, b))
        size = min(block, part.stop - part.start)
        rows_d.append(recording.position[part].reshape(n, size, 3).mean(axis=1) - contact.centre)
        rows_f.append(force[part].reshape(n, size, 3).mean(axis=1))
        starts.append(starts[-1] + n)
    prior = np.array([max(c.onset_error_m, 2e-5) * 2 for c in exploration.contacts])
    return PressData(
        np.vstack(rows_d), np.vstack(rows_f), np.array(starts), exploration.noise_n / np.sqrt(block), prior
    )


def fit_law(
    data: PressData,
    sites: TouchSites,
    tip_radius_m: float,
    law: str,
    depth_m: float,
    law_error: float,
) -> LawFit:
    """Fit e and the onset shift of every press at once (Gauss-Newton; two evaluations of the law a step)."""
    press = data.press
    k = len(sites)
    shift = np.zeros(k)
    normals = sites.normals[press]
    depth = -np.einsum("ij,ij->i", data.displacement, normals)
    used = depth < depth_m
    variance = 3 * data.noise_n**2 + law_error**2 * np.einsum("ij,ij->i", data.force, data.force)
    weight = np.where(used, 3.0 / variance, 0.0)
    step = 2e-5

    def unit(shifts: np.ndarray) -> np.ndarray:
        return touch_forces(
            data.displacement + shifts[press, None] * normals,
            data.starts,
            sites.normals,
            sites.far,
            young_modulus_pa=1.0,
            poisson_ratio=sites.poisson_ratio,
            tip_radius_m=tip_radius_m,
            curvature=sites.curvature,
            law=law,
        )

    def summed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.bincount(press, weights=weight * np.einsum("ij,ij->i", a, b), minlength=k)

    g = unit(shift)
    e = summed(g, data.force) / np.maximum(summed(g, g), 1e-300)
    for _ in range(6):
        slope = e[press, None] * (unit(shift + step) - g) / step
        residual = data.force - e[press, None] * g
        a_ee, a_eu, a_uu = summed(g, g), summed(g, slope), summed(slope, slope) + data.onset_sd_m**-2.0
        y_e, y_u = summed(g, residual), summed(slope, residual) - shift * data.onset_sd_m**-2.0
        det = np.maximum(a_ee * a_uu - a_eu**2, 1e-300)
        change = np.clip((a_ee * y_u - a_eu * y_e) / det, -2e-4, 2e-4)
        shift = np.clip(shift + change, -1e-3, 1e-3)
        g = unit(shift)
        e = summed(g, data.force) / np.maximum(summed(g, g), 1e-300)
        if np.abs(change).max() < 2e-6:
            break
    residual = data.force - e[press, None] * g
    squared = np.einsum("ij,ij->i", residual, residual)
    count = np.bincount(press, weights=used, minlength=k)
    rms = np.sqrt(np.bincount(press, weights=used * squared, minlength=k) / np.maximum(count, 1))
    # residuals of one press are correlated (a law's error lasts), so one in ten rows counts as independent
    scale = summed(residual, residual) / np.maximum(3 * count, 1)
    error = np.sqrt(10 * np.maximum(scale, 1.0) * a_uu / det) / np.maximum(e, 1e-300)
    return LawFit(
        law, depth_m, e, error, shift, rms, float(summed(residual, residual).sum()), int(used.sum())
    )


def combine(
    modulus: np.ndarray, relative_error: np.ndarray, site: np.ndarray
) -> tuple[float, np.ndarray, float]:
    """Global modulus, share of each press, relative spread between sites: robust random-effects mean of ln e.

    Presses of one site share a weight; sites beyond 3 robust deviations lose it (Tukey's biweight at 4.7).
    """
    good = np.isfinite(modulus) & (modulus > 0) & np.isfinite(relative_error)
    value = np.log(np.where(good, modulus, 1.0))
    count = np.bincount(site)[site]
    between = 0.0
    weight = np.where(good, 1.0 / count, 0.0)
    centre = _weighted_median(value[good], weight[good])
    for _ in range(20):
        deviation = value - centre
        scale = 1.4826 * _weighted_median(np.abs(deviation[good]), (1.0 / count)[good])
        between = scale
        base = 1.0 / (count * (between**2 + 0.01**2) + relative_error**2)
        robust = np.clip(1 - (deviation / (4.7 * max(scale, 0.01))) ** 2, 0, None) ** 2
        weight = np.where(good, base * robust, 0.0)
        new = float((weight * value).sum() / weight.sum())
        if abs(new - centre) < 1e-8:
            break
        centre = new
    return float(np.exp(centre)), weight / weight.sum(), float(between)


def _weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])


def site_labels(points: np.ndarray, size_m: float) -> np.ndarray:
    """(k,) a number for each site: presses within `size_m` of the site's first press belong to it."""
    labels = np.full(len(points), -1)
    for i in range(len(points)):
        if labels[i] < 0:
            near = (np.linalg.norm(points - points[i], axis=1) < size_m) & (labels < 0)
            labels[near] = labels.max() + 1
    return labels


def bootstrap(
    fit: LawFit, site: np.ndarray, count: int, shape_covariance: np.ndarray | None, seed: int
) -> np.ndarray:
    """(count,) ln of the global modulus over resampled sites, with draws of the shape's error where it is
    known."""
    random = np.random.default_rng(seed)
    sites = site.max() + 1
    members = [np.flatnonzero(site == s) for s in range(sites)]
    draws = np.zeros((count, len(site)))
    if shape_covariance is not None:
        values, vectors = np.linalg.eigh(shape_covariance)
        draws = random.standard_normal((count, len(site))) * np.sqrt(np.maximum(values, 0)) @ vectors.T
    result = np.empty(count)
    for b in range(count):
        chosen = random.integers(0, sites, sites)
        index = np.concatenate([members[s] for s in chosen])
        label = np.repeat(np.arange(sites), [len(members[s]) for s in chosen])
        e, weights, _ = combine(fit.modulus_pa[index], fit.relative_error[index], label)
        result[b] = np.log(e) + weights @ draws[b, index]
    return result


def fit_modulus(
    exploration: Exploration,
    sites: TouchSites,
    options: ModulusOptions | None = None,
    *,
    shape_covariance: np.ndarray | None = None,
    seed: int = 0,
) -> ModulusFit:
    """The global modulus of an exploration whose presses touch at `sites` (one a contact, in order).

    shape_covariance: (k, k) covariance of the relative error of each press's modulus that the shape's
    uncertainty makes.
    """
    options = options or ModulusOptions()
    radius = exploration.recording.tip_radius_m
    data = press_data(exploration, sites)
    site = site_labels(sites.points, options.site_m)
    deepest = float(max(c.depth_m for c in exploration.contacts))
    limit = options.greatest_depth_m or deepest + 1e-3

    laws = LAWS[:1] if options.law == "auto" else (options.law,)
    fits = {law: fit_law(data, sites, radius, law, limit, options.law_error) for law in laws}
    law = min(fits, key=lambda name: fits[name].cost)
    by_law = {
        name: (combine(f.modulus_pa, f.relative_error, site)[0], float(np.sqrt(np.mean(f.rms_n**2))))
        for name, f in fits.items()
    }
    fit = fits[law]
    by_depth = []
    if options.greatest_depth_m is None:
        ranges = [r for r in _RANGES_M if r < deepest]
        for r in ranges:
            part = fit_law(data, sites, radius, law, r, options.law_error)
            by_depth.append((r, combine(part.modulus_pa, part.relative_error, site)[0]))
    modulus, weights, between = combine(fit.modulus_pa, fit.relative_error, site)
    by_depth.append((min(limit, deepest), modulus))
    draws = bootstrap(fit, site, options.bootstraps, shape_covariance, seed)
    low, high = np.exp(np.percentile(draws, [2.5, 97.5]))
    shape = 0.0 if shape_covariance is None else float(np.sqrt(weights @ shape_covariance @ weights))
    reason = f"law '{law}'" + (" fits the forces best" if len(fits) > 1 else " as asked")
    return ModulusFit(
        modulus, (float(low), float(high)), fit, weights, between, shape, reason, by_law, tuple(by_depth)
    )
