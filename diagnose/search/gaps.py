"""Gaps of held-out groups: rms over contact samples, and how much of the excess over the noise is closed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

RESAMPLES = 400


def gap(plain: np.ndarray, counts: np.ndarray, added: float) -> float:
    """N, rms of the 3-vector. plain: (g,) N^2; counts: (g,) samples; added: N^2, noise thinned off."""
    return float(np.sqrt(plain.sum() / counts.sum() + added))


def modulus_share(change: np.ndarray, force: np.ndarray) -> float:
    """The share of a force (n, 3) N that is nearest to its change (n, 3) N: what another modulus takes up."""
    return float((change * force).sum() / max((force**2).sum(), 1e-300))


def closed_share(
    before: np.ndarray,
    after: np.ndarray,
    counts: np.ndarray,
    noise: float,
    added: float,
    rng: np.random.Generator,
    resamples: int,
) -> tuple[float | None, tuple[float, float] | None]:
    """(share of the gap's excess over the noise that is closed, 95 % interval by resampling sites).

    before, after, counts: (g,) a site's sums of squares, N^2, and samples. noise: N, of the 3-vector. None
    where the gap before is within the noise; such resamples are passed over.
    """

    def share(old: np.ndarray, new: np.ndarray, number: np.ndarray, axis: int = -1) -> np.ndarray:
        n = number.sum(axis=axis)
        b = old.sum(axis=axis) / n + added - noise**2
        a = new.sum(axis=axis) / n + added - noise**2
        return 1 - a / np.where(b > 0, b, np.nan)

    value = float(share(before, after, counts))
    if not np.isfinite(value):
        return None, None
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


def share_closed(
    before: np.ndarray, after: np.ndarray, counts: np.ndarray, noise: float, least: float, axis: int = -1
) -> np.ndarray:
    """The share of the held-out gap that is closed.

    before, after: (..., g) N^2, sums of squares of each place; counts: (..., g) samples; noise: N^2, mean
    square of a sample's noise; least: N^2, what a gap that matters exceeds it by: a smaller one is not closed
    by less.
    """
    n = counts.sum(axis=axis)
    gap = np.maximum(before.sum(axis=axis) / n - noise, least)
    return (before - after).sum(axis=axis) / n / gap


def lower_closure(
    before: np.ndarray, after: np.ndarray, counts: np.ndarray, noise: float, least: float, doubt: float
) -> float:
    """`share_closed` in all but a share `doubt` of the resamplings of the places, at least."""

    def share(old: np.ndarray, new: np.ndarray, number: np.ndarray, axis: int = -1) -> np.ndarray:
        return share_closed(old, new, number, noise, least, axis)

    draws = resampled((before, after, counts), share, RESAMPLES, np.random.default_rng(0))
    return float(np.quantile(draws, doubt))
