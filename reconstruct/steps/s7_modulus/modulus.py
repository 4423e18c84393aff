"""The global modulus with a finite tip: all samples of all presses, weighted by noise and by what the law can
claim.

Each press gives its modulus (`press_fit`). The global modulus weights presses by their precision
and the spread between sites; its interval is that of a site-to-site random effect (repeats at one place share
that place's errors), of dent laws as often as resampled sites choose them, of the shape's uncertainty
(reconstruct.steps.s7_modulus.shape_error) and of what is common to all presses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import t as student
from scipy.stats import theilslopes

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.depth_factors import DepthFactors
from palpate.mechanics.errors import OptionError
from palpate.mechanics.law_errors import DepthLaw, Level
from palpate.mechanics.options import EXACT, option
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.statistics import EFFICIENT, GAUSSIAN, spread_about_zero, tukey, weighted_median
from palpate.reconstruction.steps.s7_modulus.press_fit import LawFit, far_sensitivity, fit_law, press_data

LAWS = ("linear", "neo-hookean", "sphere", "hertz")
AUTO_LAWS = ("linear", "neo-hookean")
_AGREE = 0.005  # relative
_GRID, _DRAWS = 240, 20_000
_USUAL_SCATTER = 0.05
"""Scale of the prior of what sites scatter by, as a share of the modulus; far wider than most."""
_RANGES_M = (0.002, 0.003, 0.004, 0.005, 0.006, 0.007)


@dataclass(frozen=True)
class ModulusOptions:
    """How the global modulus is estimated with a finite tip."""

    law: str = option(
        "auto",
        "law of the dent under the tip: auto takes the one that fits the forces best",
        choices=("auto", *LAWS),
        flag="--dent-law",
    )
    greatest_depth_m: float | None = option(
        None, "leave out samples deeper than this; None: none", unit="m", flag="--greatest-depth"
    )
    law_error: float = option(
        DepthLaw.modulus.value,
        "error of the law as a share of the force; weights deep samples down",
        flag="--law-error",
    )
    law_bias: float = option(
        Level.modulus.value,
        "standard error common to all presses (law, mesh), as a share of the modulus",
        flag="--law-bias",
    )
    bootstraps: int = option(1000, "resamples of the sites that choose a dent law", flag="--bootstraps")
    exact: bool = option(False, EXACT)

    def __post_init__(self) -> None:
        """Raises OptionError for a depth that is not positive, errors below 0, or fewer than 20 resamples."""
        if self.greatest_depth_m is not None and not self.greatest_depth_m > 0:
            raise OptionError(f"--greatest-depth is {self.greatest_depth_m} m; it must be greater than 0")
        for flag, value in (("--law-error", self.law_error), ("--law-bias", self.law_bias)):
            if not 0 <= value < 1:
                raise OptionError(f"{flag} is {value}; it must lie between 0 and 1 (a share)")
        if self.bootstraps < 20:
            raise OptionError(f"--bootstraps is {self.bootstraps}; an interval needs at least 20 resamples")


@dataclass(frozen=True)
class ModulusFit:
    """The global modulus, its 95 % interval, every press's own, and how it was chosen.

    press: the fits of single presses by the law and depth chosen. weights: (k,) share of each press, 0 for
    those that the robust mean leaves out. between: relative spread between sites. shape_error: relative
    standard error from the shape's uncertainty. by_law: law -> (modulus, misfit N, share of resamples that
    chose it). by_depth: (greatest depth, modulus, consistent with the shallower ones).
    """

    modulus_pa: float
    ci95_pa: tuple[float, float]
    press: LawFit
    weights: np.ndarray
    site: np.ndarray
    between: float
    shape_error: float
    reason: str
    by_law: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    by_depth: tuple[tuple[float, float, bool], ...] = ()


@dataclass(frozen=True)
class UnderOtherTip:
    """The modulus under a tip of another radius, m, Pa; misfit: the presses' rms over that under the stated
    tip."""

    radius_m: float
    young_modulus_pa: float
    misfit: float


def fit_modulus(
    presses: Presses,
    sites: TouchSites,
    noise_n: float,
    options: ModulusOptions | None = None,
    *,
    compliance_covariance: np.ndarray | None = None,
    exact: Mapping[str, DepthFactors] | None = None,
    seed: int = 0,
) -> ModulusFit:
    """The global modulus of presses that touch at `sites` (one a press, in order).

    noise_n: N, standard deviation of a raw force component. compliance_covariance: (k, k) 1/m^2 from the
    shape's uncertainty (reconstruct.steps.s7_modulus.shape_error), or None. exact: solved places of the
    presses by the dent's law; no other law is weighed then.
    """
    options = options or ModulusOptions()
    radius, data, site = presses.tip_radius_m, press_data(presses), presses.site
    along = np.einsum("ka,kab,kb->k", sites.normals, sites.far, sites.normals)
    deepest = float(presses.depth_m.max()) + 1e-3
    laws = AUTO_LAWS if options.law == "auto" else (options.law,)
    at = {law: sites if exact is None else replace(sites, factors=exact[law]) for law in exact or laws}

    def fitted(law: str, depth: float, start: LawFit | None = None) -> LawFit:
        return fit_law(data, at[law], radius, law, depth, options.law_error, noise_n, start)

    limit = options.greatest_depth_m or deepest
    # the law is chosen on all depths, where laws differ most; the modulus where depth does not matter
    whole = sorted((fitted(law, limit) for law in at), key=lambda f: f.cost.sum())
    depths: list[tuple[float, float, bool]] = []
    if options.greatest_depth_m is None:
        ladder = [whole[0]]
        for depth in reversed([r for r in _RANGES_M if r < deepest - 1.5e-3]):
            ladder.append(fitted(whole[0].law, depth, ladder[-1]))
        limit, depths = _greatest_consistent(ladder[::-1], site, along)
    fits = [fitted(f.law, limit, f) for f in whole]
    shape = None
    if compliance_covariance is not None:
        slope = far_sensitivity(data, at[fits[0].law], fits[0], radius, options.law_error, noise_n)
        shape = slope[:, None] * compliance_covariance * slope
    shares = _law_shares(whole, site, options, seed)
    values = [combine(f.modulus_pa, f.relative_error, site) for f in fits]
    modulus = float(np.exp(sum(s * np.log(v[0]) for s, v in zip(shares, values, strict=True))))
    logs = _draws(fits, shares, site, at[fits[0].law].law_error(options.law_bias), shape, seed)
    low, high = modulus * np.exp(np.percentile(logs - logs.mean(), [2.5, 97.5]))
    weights, between = values[0][1], values[0][2]
    return ModulusFit(
        modulus_pa=modulus,
        ci95_pa=(float(low), float(high)),
        press=fits[0],
        weights=weights,
        site=site,
        between=between,
        shape_error=0.0 if shape is None else float(np.sqrt(weights @ shape @ weights)),
        reason=_reason(fits, shares, limit, deepest, options) + ("; touched places solved" if exact else ""),
        by_law={
            f.law: (v[0], float(np.sqrt(np.mean(f.rms_n**2))), s)
            for f, v, s in zip(fits, values, shares, strict=True)
        },
        by_depth=tuple(depths),
    )


def combine(
    modulus: np.ndarray, relative_error: np.ndarray, site: np.ndarray
) -> tuple[float, np.ndarray, float]:
    """Global modulus, share of each press (k,), relative spread between sites: a robust mean of ln e.

    Presses of one site share a weight; presses far beyond the spread lose it (Tukey's biweight at 4.7).
    """
    good = np.isfinite(modulus) & (modulus > 0) & np.isfinite(relative_error)
    value = np.log(np.where(good, modulus, 1.0))
    error = np.where(good, relative_error, 1.0)
    count = np.bincount(site)[site].astype(float)
    centre = weighted_median(value[good], 1 / count[good])
    for _ in range(20):  # not robust.biweight: each press has a reach of its own, and sites share a weight
        deviation = value - centre
        scale = max(GAUSSIAN * weighted_median(np.abs(deviation[good]), 1 / count[good]), 0.01)
        robust = tukey(deviation / (EFFICIENT * np.hypot(scale, error)))
        weight = np.where(good, robust / (count * scale**2 + error**2), 0.0)
        before, centre = centre, float((weight * value).sum() / weight.sum())
        if abs(centre - before) < 1e-8:
            break
    return float(np.exp(centre)), weight / weight.sum(), float(scale)


def _greatest_consistent(
    ladder: list[LawFit], site: np.ndarray, far: np.ndarray
) -> tuple[float, list[tuple[float, float, bool]]]:
    """Greatest depth whose moduli agree, site by site, with those of every smaller depth (after Lepski).

    far: (k,) far-field compliance along the normal, 1/m. Two depths disagree where the mean of ln(deep /
    shallow), or its trend with the far-field compliance (which a law that fails for the whole body
    brings about), is beyond its 99 % interval and half a percent.
    """
    chosen, rows = ladder[0], []
    broken = False
    for i, deep in enumerate(ladder):
        broken |= any(_disagree(deep, shallow, site, far) for shallow in ladder[:i])
        rows.append((deep.depth_m, combine(deep.modulus_pa, deep.relative_error, site)[0], not broken))
        if not broken:
            chosen = deep
    return chosen.depth_m, rows


def _disagree(deep: LawFit, shallow: LawFit, site: np.ndarray, far: np.ndarray) -> bool:
    difference = np.log(np.maximum(deep.modulus_pa, 1e-9) / np.maximum(shallow.modulus_pa, 1e-9))
    both = shallow.telling & deep.telling & (deep.rows > shallow.rows) & (np.abs(difference) < 1)
    labels = np.unique(site[both])
    if len(labels) < 2:  # one place has no scatter to weigh a difference by
        return False
    mean = np.array([np.median(difference[both & (site == s)]) for s in labels])
    compliance = np.array([np.median(far[both & (site == s)]) for s in labels])
    middle = np.median(mean)
    certain = float(student.ppf(0.995, len(mean) - 1))
    error = 1.25 * _scatter(mean - middle) / np.sqrt(len(mean))
    if abs(middle) > max(certain * error, _AGREE):
        return True
    if len(labels) < 3 or np.ptp(compliance) <= 0:  # two places have no scatter about a line
        return False
    certain = float(student.ppf(0.995, len(mean) - 2))
    # the trend over the sites' whole range, Theil-Sen, with the error of a least-squares line of that scatter
    # places that are alike by symmetry differ by rounding, which is no line
    alike = np.round(compliance / np.ptp(compliance), 9) * np.ptp(compliance)
    slope, intercept, _, _ = theilslopes(mean, alike)
    error = _scatter(mean - intercept - slope * compliance) / (np.sqrt(len(compliance)) * np.std(compliance))
    return bool(abs(slope) * np.ptp(compliance) > max(certain * error * np.ptp(compliance), _AGREE))


def _scatter(values: np.ndarray) -> float:
    """The greater of standard deviation and scaled median deviation: neither few values nor two groups fool
    it."""
    return float(max(np.std(values, ddof=1), spread_about_zero(values)))


def between_sites(
    modulus: np.ndarray, relative_error: np.ndarray, site: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Standard errors (g,) of the `combine`d ln e by chance between sites, and their probabilities (g,).

    Sites scatter about the global modulus by an unknown share, and presses by their own errors. The
    restricted likelihood of that share (Patterson & Thompson 1971) has the centre integrated out; its prior
    is a wide half-Cauchy (Gelman 2006). Few places leave it open, and so the interval wide. A site far off
    counts as the farthest that the robust mean would still have heard.
    """
    good = np.isfinite(modulus) & (modulus > 0) & np.isfinite(relative_error)
    value, error = np.log(np.where(good, modulus, 1.0)), np.where(good, relative_error, 0.0)
    centre = float(weights @ value)
    scale = max(GAUSSIAN * float(np.median(np.abs(value[good] - centre))), 0.01)
    farthest = EFFICIENT * np.hypot(scale, error)
    label = np.unique(site[good], return_inverse=True)[1]
    even = 1 / np.bincount(label)[label]
    mean = np.bincount(label, even * np.clip(value - centre, -farthest, farthest)[good])
    noise = np.bincount(label, (even * error[good]) ** 2)
    share = np.bincount(label, weights[good])
    grid = 0.6 * np.linspace(0.0, 1.0, _GRID + 1)[1:] ** 2
    variance = grid[:, None] ** 2 + noise
    precision = (1 / variance).sum(axis=1)
    middle = (mean / variance).sum(axis=1) / precision
    chi = ((mean - middle[:, None]) ** 2 / variance).sum(axis=1)
    log = -0.5 * (np.log(variance).sum(axis=1) + np.log(precision) + chi)
    # the grid is quadratic: as much of it lies in an equal step of its root
    density = np.exp(log - log.max()) * np.sqrt(grid) / (1 + (grid / _USUAL_SCATTER) ** 2)
    return np.sqrt((share**2 * variance).sum(axis=1)), density / density.sum()


def _draws(
    fits: list[LawFit],
    shares: list[float],
    site: np.ndarray,
    bias: np.ndarray,
    shape: np.ndarray | None,
    seed: int,
) -> np.ndarray:
    """(n,) ln of the global modulus as it may be: by law, by chance between sites, by the shape's and the
    common error. bias: (k,) of each press, common to all."""
    random = np.random.default_rng(seed)
    drawn = []
    for fit, share in zip(fits, shares, strict=True):
        e, weights, _ = combine(fit.modulus_pa, fit.relative_error, site)
        errors, probability = between_sites(fit.modulus_pa, fit.relative_error, site, weights)
        of_shape = 0.0 if shape is None else max(float(weights @ shape @ weights), 0.0)
        common = float(weights @ bias) ** 2 + of_shape
        count = round(share * _DRAWS)
        chance = random.choice(errors, count, p=probability)
        drawn.append(np.log(e) + np.sqrt(chance**2 + common) * random.standard_normal(count))
    return np.concatenate(drawn)


def _law_shares(whole: list[LawFit], site: np.ndarray, options: ModulusOptions, seed: int) -> list[float]:
    """How often each law has the least cost, on all depths, when the sites are drawn anew (bootstrap)."""
    cost = np.array([np.bincount(site, f.cost) for f in whole])
    sites = cost.shape[1]
    counts = np.random.default_rng(seed).multinomial(sites, np.full(sites, 1 / sites), options.bootstraps)
    chosen = np.argmin(counts @ cost.T, axis=1)
    return [float(np.mean(chosen == i)) for i in range(len(whole))]


def _reason(
    fits: list[LawFit], shares: list[float], limit: float, deepest: float, options: ModulusOptions
) -> str:
    words = f"the dent follows the {fits[0].law} law"
    if options.law == "auto":
        words += f"; with other places left out at random it fits best {100 * shares[0]:.0f} times in 100"
    if options.greatest_depth_m is not None:
        return words + f"; from samples up to {limit * 1e3:g} mm deep (--greatest-depth)"
    if limit < deepest:
        return words + f"; from samples up to {limit * 1e3:g} mm deep, as deeper ones say otherwise"
    return words + "; from samples of all depths, as they agree"
