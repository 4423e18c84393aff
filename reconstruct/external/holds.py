"""Relaxation curves: how many exponentials they need, judged on stretches of time that were left out."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from reconstruct.external.relaxation import Relaxation, fit_relaxation

BLOCKS = 8
_MOST_ROWS = 300


def thinned(t: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """At most 300 samples, even in the logarithm of time since just before the first."""
    since = t - t[0]
    first = since[1]
    at = np.unique(np.searchsorted(since, np.geomspace(first, since[-1], _MOST_ROWS)))
    keep = np.unique(np.concatenate([[0], np.minimum(at, len(t) - 1)]))
    return t[keep], value[keep]


def held_out_relaxation(
    t: np.ndarray, value: np.ndarray, most_terms: int = 2
) -> tuple[dict[str, float], Relaxation]:
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
        for terms in range(1, most_terms + 1):
            out = predicted.setdefault(f"prony-{terms}", np.zeros(len(t)))
            out[held] = _at(
                fit_relaxation(t[seen], value[seen], terms=terms), t[seen][0], value[seen][0], t[held]
            )
    size = float(np.sqrt((value**2).mean()))
    errors = {name: float(np.sqrt(((p - value) ** 2).mean())) / size for name, p in predicted.items()}
    terms = min(range(1, most_terms + 1), key=lambda k: errors[f"prony-{k}"])
    return errors, fit_relaxation(t, value, terms=terms)


def _at(fit: Relaxation, begin: float, first: float, t: np.ndarray) -> np.ndarray:
    since = np.maximum(t - begin, 0.0)
    decay = np.exp(-since[:, None] / np.array(fit.tau_s))
    return first * (fit.end + decay @ np.array(fit.g))
