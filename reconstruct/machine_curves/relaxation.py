"""Relaxation under a held displacement: a Prony series, whether a Kelvin-Voigt element could do the same, and
how many exponentials a curve needs, judged on stretches of time that were left out."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import nnls

from palpate.mechanics.errors import RecordingError

BLOCKS = 8
_MOST_ROWS = 300


@dataclass(frozen=True)
class Relaxation:
    """Force (or modulus) over its first value: end + sum g exp(-t / tau), end + sum g = 1 at t = 0.

    g, tau_s: of the terms. end: share that stays. rms: misfit as a share of the first value. loss: share of
    the first value lost by the last sample. kelvin_voigt_can: False where more is lost than noise explains: a
    Kelvin-Voigt element (and Hunt-Crossley's) has constant force while its displacement is held.
    """

    g: tuple[float, ...]
    tau_s: tuple[float, ...]
    end: float
    rms: float
    loss: float
    kelvin_voigt_can: bool


def fit_relaxation(t: np.ndarray, value: np.ndarray, *, terms: int = 2) -> Relaxation:
    """Fit `terms` exponentials to samples t (n,) s of a hold that starts at t[0], value (n,).

    For given times g and the end are non-negative least squares; the times are searched on a logarithmic
    grid, refined once. Raises RecordingError where samples are too few or not positive at the start.
    """
    t, value = np.asarray(t, dtype=float), np.asarray(value, dtype=float)
    if len(t) < 3 * terms + 2 or not value[0] > 0 or not (np.diff(t) > 0).all():
        raise RecordingError(
            f"a relaxation of {terms} terms needs {3 * terms + 2} samples in time order that start above 0; "
            f"got {len(t)}"
        )
    t = t - t[0]
    share = value / value[0]
    shortest = max(np.median(np.diff(t)), t[-1] / 1e6)
    grid = np.geomspace(shortest, 2 * t[-1], 24)
    best = _search(t, share, grid, terms)
    step = grid[1] / grid[0]
    finer = np.unique(np.concatenate([tau * np.geomspace(1 / step, step, 9) for tau in best[0]]))
    best = _search(t, share, finer, terms)
    tau, weights, rms = best
    total = weights.sum()
    noise = float(np.std(np.diff(share)) / np.sqrt(2))
    loss = float(1 - np.mean(share[-max(1, len(t) // 20) :]))
    return Relaxation(
        g=tuple(map(float, weights[1:] / total)),
        tau_s=tuple(map(float, tau)),
        end=float(weights[0] / total),
        rms=rms,
        loss=loss,
        kelvin_voigt_can=abs(loss) < 5 * noise,
    )


def _search(
    t: np.ndarray, share: np.ndarray, grid: np.ndarray, terms: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """(times, weights with the end first, rms) of the best combination of `terms` times of the grid."""
    decay = np.exp(-t[:, None] / grid)

    def fitted(pick: tuple[int, ...]) -> tuple[float, tuple[int, ...], np.ndarray]:
        weights, norm = nnls(np.column_stack([np.ones_like(t), decay[:, pick]]), share)
        return norm, pick, weights

    norm, pick, weights = min(map(fitted, combinations(range(len(grid)), terms)), key=lambda each: each[0])
    return grid[list(pick)], weights, float(norm / np.sqrt(len(t)))


def thinned(t: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """At most 300 samples, even in the logarithm of time since just before the first."""
    since = t - t[0]
    first = since[1]
    at = np.unique(np.searchsorted(since, np.geomspace(first, since[-1], _MOST_ROWS)))
    keep = np.unique(np.concatenate([[0], np.minimum(at, len(t) - 1)]))
    return t[keep], value[keep]


_TERMS = (1, 2)
"""Exponentials that are tried."""


def held_out_relaxation(t: np.ndarray, value: np.ndarray) -> tuple[dict[str, float], Relaxation]:
    """(name -> rms error over rms value, blocks even in log time left out in turn; the fit of the best
    number of exponentials). 'spring' does not relax, 'power' falls by a power of time, 'spectrum' has two
    exponentials a decade, 'regression' interpolates."""
    t, value = thinned(np.asarray(t, float), np.asarray(value, float))
    since = np.log(t - t[0] + (t[1] - t[0]))
    block = np.minimum((BLOCKS * (since - since[0]) / np.ptp(since)).astype(int), BLOCKS - 1)
    predicted: dict[str, np.ndarray] = {}
    for b in np.unique(block):
        held, seen = block == b, block != b
        predicted.setdefault("spring", np.zeros(len(t)))[held] = value[seen].mean()
        line = np.polyfit(since[seen], np.log(np.maximum(value[seen], 1e-300)), 1)
        predicted.setdefault("power", np.zeros(len(t)))[held] = np.exp(np.polyval(line, since[held]))
        predicted.setdefault("regression", np.zeros(len(t)))[held] = np.interp(
            since[held], since[seen], value[seen]
        )
        ladder = np.geomspace(t[1] - t[0], 3 * np.ptp(t), max(4, 2 * round(np.ptp(since) / np.log(10))))
        kernel = np.column_stack([np.ones(len(t)), np.exp(-(t - t[0])[:, None] / ladder)])
        weights = nnls(kernel[seen], value[seen])[0]
        predicted.setdefault("spectrum", np.zeros(len(t)))[held] = kernel[held] @ weights
        for terms in _TERMS:
            out = predicted.setdefault(f"prony-{terms}", np.zeros(len(t)))
            out[held] = _at(
                fit_relaxation(t[seen], value[seen], terms=terms), t[seen][0], value[seen][0], t[held]
            )
    size = float(np.sqrt((value**2).mean()))
    errors = {name: float(np.sqrt(((p - value) ** 2).mean())) / size for name, p in predicted.items()}
    terms = min(_TERMS, key=lambda k: errors[f"prony-{k}"])
    return errors, fit_relaxation(t, value, terms=terms)


def _at(fit: Relaxation, begin: float, first: float, t: np.ndarray) -> np.ndarray:
    since = np.maximum(t - begin, 0.0)
    decay = np.exp(-since[:, None] / np.array(fit.tau_s))
    return first * (fit.end + decay @ np.array(fit.g))
