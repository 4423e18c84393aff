"""Gaps of held-out groups: rms over contact samples, and how much of the excess over the noise is closed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from palpate.render.replay import rms_n

RESAMPLES = 400


def gap(plain: np.ndarray, counts: np.ndarray, added: float) -> float:
    """N, rms of the 3-vector. plain: (g,) N^2; counts: (g,) samples; added: N^2, noise thinned off."""
    return float(np.sqrt(plain.sum() / counts.sum() + added))


def modulus_share(change: np.ndarray, force: np.ndarray) -> float:
    """The share of a force (n, 3) N that is nearest to its change (n, 3) N: what another modulus takes up."""
    return float((change * force).sum() / max((force**2).sum(), 1e-300))


def beside_modulus_n(change: np.ndarray, force: np.ndarray) -> float:
    """N, rms of a change (n, 3) of a force (n, 3) N, with what another modulus takes up left out."""
    return rms_n(change - modulus_share(change, force) * force)


def closed_share(
    before: np.ndarray,
    after: np.ndarray,
    counts: np.ndarray,
    noise: float,
    least: float = 0.0,
    axis: int = -1,
) -> np.ndarray:
    """The share of the held-out gap's excess over the noise that is closed; NaN where it has no excess.

    before, after: (..., g) N^2, sums of squares of each place; counts: (..., g) samples; noise: N^2, mean
    square of a sample's noise; least: N^2, what a gap that matters exceeds it by: a smaller one is not closed
    by less.
    """
    n = counts.sum(axis=axis)
    excess = np.maximum(before.sum(axis=axis) / n - noise, least)
    return (before - after).sum(axis=axis) / n / np.where(excess > 0, excess, np.nan)


def closed_share_ci95(
    before: np.ndarray,
    after: np.ndarray,
    counts: np.ndarray,
    noise: float,
    rng: np.random.Generator,
    resamples: int,
) -> tuple[float | None, tuple[float, float] | None]:
    """(`closed_share`, its 95 % interval by resampling places), (None, None) where the gap before is within
    the noise; such resamples are passed over."""
    value = float(closed_share(before, after, counts, noise))
    if not np.isfinite(value):
        return None, None

    def share(old: np.ndarray, new: np.ndarray, number: np.ndarray, axis: int = -1) -> np.ndarray:
        return closed_share(old, new, number, noise, axis=axis)

    draws = resampled((before, after, counts), share, resamples, rng)
    low, high = np.nanquantile(draws, [0.025, 0.975])
    return value, (float(low), float(high))


def resampled(
    sites: Sequence[np.ndarray],
    statistic: Callable[..., np.ndarray],
    resamples: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """(resamples,) the statistic of sites drawn with replacement; statistic(*arrays (..., g), axis=-1)."""
    # scipy.stats.bootstrap gives the same numbers ten times slower, and warns of resamples without a value
    drawn = rng.integers(0, len(sites[0]), (resamples, len(sites[0])))
    return statistic(*(values[drawn] for values in sites), axis=-1)


def lower_closure(
    before: np.ndarray, after: np.ndarray, counts: np.ndarray, noise: float, least: float, doubt: float
) -> float:
    """`closed_share` in all but a share `doubt` of the resamplings of the places, at least."""

    def share(old: np.ndarray, new: np.ndarray, number: np.ndarray, axis: int = -1) -> np.ndarray:
        return closed_share(old, new, number, noise, least, axis)

    draws = resampled((before, after, counts), share, RESAMPLES, np.random.default_rng(0))
    return float(np.quantile(draws, doubt))
