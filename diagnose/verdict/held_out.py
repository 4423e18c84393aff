"""Held-out gaps by fitting again: neighbouring places together, and the deepest and the fastest presses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from diagnose.search.evidence import Search
from diagnose.search.fit import Descent, Fit
from diagnose.search.gaps import gap
from mechanics.presses import Presses

FOLDS = 6
ITERATIONS = 6
SHARE = 0.2
"""Of the places, held out as the deepest and as the fastest."""


@dataclass(frozen=True)
class HeldOut:
    """plain: (g,) N^2, sums of squares of each site when its fold was not fitted. deepest_n, fastest_n: N rms
    over the places that hold those presses, fitted to all the others."""

    plain: np.ndarray
    deepest_n: float
    fastest_n: float


def held_out_by_refit(search: Search, found: Fit, extra: np.ndarray | None, added: float) -> HeldOut:
    """Fit modulus, effects and first touches again without each fold, and weigh the fold.

    extra: (n, 3) N, put back onto the residual (instrument offsets). added: N^2, noise that
    thinning took off. A press's own first touch is a nuisance and is moved for held-out presses too; neither
    modulus nor effects see them.
    """
    t = search.forward.touches
    plain = np.zeros(search.whitener.groups)
    for fold in neighbours(t):
        plain[fold] = _without(search, found, fold, extra)[fold]
    counts = search.whitener.counts()
    special = []
    for fold in (deepest(t), fastest(t)):
        special.append(gap(_without(search, found, fold, extra)[fold], counts[fold], added))
    return HeldOut(plain, *special)


def _without(search: Search, found: Fit, fold: np.ndarray, extra: np.ndarray | None) -> np.ndarray:
    """(g,) plain sums of squares of a fit that has not seen the sites of `fold`."""
    weights = np.ones(search.whitener.groups)
    weights[fold] = 0.0
    descent = Descent(search.forward, search.whitener, found.effects, weights)
    again = descent.run(found.values, found.onset, ITERATIONS)
    residual = again.residual if extra is None else again.residual + extra
    modulus = again.jacobian[:, :, 0]
    raw = search.whitener.raw_gram(np.stack([residual, modulus], axis=2))
    others = weights @ raw.reshape(len(raw), 4)
    # a gap is never one that another modulus would close on the places that were fitted
    level = others[1] / max(others[3], 1e-12)
    return raw[:, 0, 0] - 2 * level * raw[:, 0, 1] + level**2 * raw[:, 1, 1]


def neighbours(t: Presses) -> list[np.ndarray]:
    """Site numbers of each fold: sites nearest to one of FOLDS centres, spread by farthest points; of one
    place, its presses by turns."""
    place = t.site_point
    centres = [int(np.argmax(np.linalg.norm(place - place.mean(axis=0), axis=1)))]
    while len(centres) < min(FOLDS, t.sites):
        away = np.linalg.norm(place[:, None] - place[centres], axis=2).min(axis=1)
        if not away.max() > 0:
            return [np.arange(t.sites)[k :: min(FOLDS, t.sites)] for k in range(min(FOLDS, t.sites))]
        centres.append(int(np.argmax(away)))
    nearest = np.linalg.norm(place[:, None] - place[centres], axis=2).argmin(axis=1)
    return [np.flatnonzero(nearest == k) for k in range(len(centres))]


def deepest(t: Presses) -> np.ndarray:
    """Sites that hold the deepest presses."""
    return _most(np.array([t.deepest[t.site == s].max() for s in range(t.sites)]))


def fastest(t: Presses) -> np.ndarray:
    """Sites that hold the fastest presses."""
    speed = np.array([t.speed[part].max() for part in t.parts])
    return _most(np.array([speed[t.site == s].max() for s in range(t.sites)]))


def _most(value: np.ndarray) -> np.ndarray:
    return np.argsort(-value)[: max(1, round(SHARE * len(value)))]
