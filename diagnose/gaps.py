"""Gaps of held-out groups: rms over contact samples, and how much of the excess over the noise is closed."""

from __future__ import annotations

import numpy as np


def gap(plain: np.ndarray, counts: np.ndarray, added: float) -> float:
    """N, rms of the 3-vector. plain: (g,) N^2; counts: (g,) samples; added: N^2, noise thinned off."""
    return float(np.sqrt(plain.sum() / counts.sum() + added))


def closed_share(before, after, counts, noise, added, rng, resamples):  # type: ignore[no-untyped-def]
    """(share of the gap's excess over the noise that is closed, 95 % interval by resampling sites)."""

    def share(index: np.ndarray) -> float:
        n = counts[index].sum()
        b = before[index].sum() / n + added - noise**2
        a = after[index].sum() / n + added - noise**2
        return 1 - a / b if b > 0 else np.nan

    everyone = np.arange(len(counts))
    value = share(everyone)
    if not np.isfinite(value):
        return None, None
    draws = np.array([share(rng.choice(everyone, len(everyone))) for _ in range(resamples)])
    low, high = np.nanquantile(draws, [0.025, 0.975])
    return float(value), (float(low), float(high))
