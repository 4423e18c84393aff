"""One score: the log density of each place's presses, predicted from all the other places.

Linearised at the fit of all: a place's share is taken out of the normal equations, parameters and the random
field over the surface follow from the rest, and the place is judged with their remaining uncertainty.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.benchmarks._density_covariance import Terms, Weighed


def drawn(a: np.ndarray, side: np.ndarray, precision: np.ndarray) -> np.ndarray:
    """(d,) log predictive density of all places of d drawn residuals, less what no column changes.

    a: (g, k, k) inner products of the columns, side: (g, d, k) with the residuals. precision: (k,) of the
    columns' priors.
    """
    total = _firm(a.sum(axis=0) + np.diag(precision))
    rest = total - a
    delta = (side.sum(axis=0) - side) @ np.linalg.inv(rest)
    left = side - delta @ a
    gained = ((side + left) * delta).sum(axis=(0, 2)) + ((left @ np.linalg.inv(total)) * left).sum(
        axis=(0, 2)
    )
    loose = len(a) * np.linalg.slogdet(total)[1] - np.linalg.slogdet(rest)[1].sum()
    return 0.5 * (gained - loose)


def predictive(terms: Terms, weighed: Weighed) -> np.ndarray:
    """(g,) of a fit's terms; parameters that cannot move, or would leave where a linear answer holds,
    stay."""
    a, side = weighed.inner[:, 1:, 1:], weighed.inner[:, 1:, 0]
    low, high = _reach(terms)
    own = -0.5 * (weighed.log_det + weighed.inner[:, 0, 0])
    total, pull = a.sum(axis=0) + np.diag(weighed.precision), side.sum(axis=0) - weighed.pull
    gained = np.empty(len(a))
    for g in range(len(a)):
        rest = total - a[g]
        delta, free = _settled(rest, pull - side[g], low, high)
        left = side[g] - a[g] @ delta
        some = np.ix_(free, free)
        known, new = _firm(rest[some]), _firm(total[some])
        gained[g] = (side[g] + left) @ delta + left[free] @ np.linalg.solve(new, left[free])
        gained[g] -= np.linalg.slogdet(new)[1] - np.linalg.slogdet(known)[1]
    return own + 0.5 * gained


def in_sample(terms: Terms, weighed: Weighed) -> np.ndarray:
    """(g,) the same with parameters fitted to all places, less one a parameter (Akaike), spread evenly."""
    a, side = weighed.inner[:, 1:, 1:], weighed.inner[:, 1:, 0]
    total = a.sum(axis=0) + np.diag(weighed.precision)
    delta, free = _settled(total, side.sum(axis=0) - weighed.pull, *_reach(terms))
    left = side - a @ delta
    some = np.ix_(free, free)
    price = np.trace(np.linalg.solve(_firm(total[some]), a.sum(axis=0)[some]))
    return 0.5 * (
        ((side + left) * delta).sum(axis=1) - weighed.log_det - weighed.inner[:, 0, 0]
    ) - price / len(a)


def _reach(terms: Terms) -> tuple[np.ndarray, np.ndarray]:
    far = np.full(len(terms.field), np.inf)
    return np.concatenate([terms.low, -far]), np.concatenate([terms.high, far])


def _firm(a: np.ndarray) -> np.ndarray:
    return a + 1e-9 * np.diag(np.diag(a) + 1e-12)


def _settled(
    a: np.ndarray, side: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(move (k,), which are free (k,) bool) of the quadratic with curvature a and slope `side`, within
    bounds: what would leave them is held there, the others settle anew."""
    free = high > low
    delta = np.zeros(len(side))
    while free.any():
        some = np.flatnonzero(free)
        delta[some] = np.linalg.solve(
            _firm(a[np.ix_(some, some)]), side[some] - a[some][:, ~free] @ delta[~free]
        )
        outside = free & ((delta < low) | (delta > high))
        if not outside.any():
            break
        delta = np.clip(delta, low, high)
        free &= ~outside
    return delta, free


def null_gains(
    terms: Terms,
    weighed: Weighed,
    kept: int,
    sets: Sequence[np.ndarray],
    draws: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """(draws,) the greatest gain of any set of columns over the null.

    terms, weighed: with all columns, first those of the null (`kept` of them), then those of effects, then
    the field's. sets: numbers of the columns that each effect adds.
    """
    m = len(terms.field)
    field = np.arange(terms.k, terms.k + m)
    a = weighed.inner[:, 1:, 1:]
    side = np.empty((len(a), draws, a.shape[1]))
    for g, each in enumerate(a):
        value, vector = np.linalg.eigh(each)
        root = vector * np.sqrt(np.maximum(value, 0.0))
        side[g] = rng.standard_normal((draws, len(each))) @ root.T
    waves = rng.standard_normal((draws, m)) / np.sqrt(weighed.precision[field])
    side += waves @ a[:, field]
    base = np.concatenate([np.arange(kept), field])
    precision = weighed.precision
    old = drawn(a[:, base][:, :, base], side[:, :, base], precision[base])
    best = np.full(draws, -np.inf)
    for own in sets:
        both = np.concatenate([np.arange(kept), own, field])
        new = drawn(a[:, both][:, :, both], side[:, :, both], precision[both])
        best = np.maximum(best, new - old)
    return best


def linear_gains(terms: Terms, weighed: Weighed, kept: int, sets: Sequence[np.ndarray]) -> list[float]:
    """The same gains for the recording's own residual."""
    field = np.arange(terms.k, terms.k + len(terms.field))
    a, side = weighed.inner[:, 1:, 1:], weighed.inner[:, None, 0, 1:]
    base = np.concatenate([np.arange(kept), field])
    precision = weighed.precision
    old = drawn(a[:, base][:, :, base], side[:, :, base], precision[base])[0]
    gains = []
    for own in sets:
        both = np.concatenate([np.arange(kept), own, field])
        gains.append(float(drawn(a[:, both][:, :, both], side[:, :, both], precision[both])[0] - old))
    return gains
