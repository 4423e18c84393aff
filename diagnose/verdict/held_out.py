"""Held-out gaps: fitted again without neighbouring places, and without the deepest and the fastest presses.

A verdict never names effects that make the held-out gap larger: the weakest go until it does not grow.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.instrument.free_air_offsets import InstrumentOffsets
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import Fit
from palpate.diagnosis.search.gaps import gap, resampled
from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.diagnosis.search.whiten import Whitener
from palpate.diagnosis.verdict.answer import Answer, Findings
from palpate.mechanics.presses.table import Presses

FOLDS = 6
SHARE = 0.2
"""Of the places, held out as the deepest and as the fastest."""


@dataclass(frozen=True)
class HeldOutLosses:
    """plain: (g,) N^2, sums of squares of each site when its fold was not fitted. deepest_n, fastest_n: N rms
    over the places that hold those presses, fitted to all the others."""

    plain: np.ndarray
    deepest_n: float
    fastest_n: float


@dataclass(frozen=True)
class Gaps:
    """Held-out plain sums of squares (g,) N^2 before and after. held: N, of deepest and fastest places."""

    before: np.ndarray
    after: np.ndarray
    held: dict[str, tuple[float, float]]


def held_out_gaps(findings: Findings) -> Gaps:
    """Without what the search found, and with it."""
    search, found, offsets = findings.search, findings.found, findings.instrument_offsets
    if not findings.refit:
        return Gaps(
            found.ideal.plain + put_back(offsets, search.whitener, found.ideal), found.final.plain, {}
        )
    added = findings.forward.touches.thinned_away
    old = held_out_by_refit(search, found.ideal.found, offsets.residual, added)
    new = held_out_by_refit(search, found.final.found, None, added)
    held = {"deepest": (old.deepest_n, new.deepest_n), "fastest": (old.fastest_n, new.fastest_n)}
    return Gaps(old.plain, new.plain, held)


def without_what_makes_it_worse(
    findings: Findings, answer: Answer, gaps: Gaps, counts: np.ndarray
) -> np.ndarray:
    """(g,) N^2, held out with what may be named; what makes the gap grow goes to the answer's candidates."""
    search, offsets = findings.search, findings.instrument_offsets
    whitener = search.whitener
    final, base = findings.found.final.found, findings.found.base.found.names
    added = findings.forward.touches.thinned_away

    def after(names: tuple[str, ...]) -> np.ndarray:
        if names == tuple(answer.names):
            return gaps.after
        fitted = search.judge([e for e in final.effects if e.name in (*names, *base)])
        returned = None if set(offsets.names) <= set(names) else offsets.residual
        if findings.refit:
            return held_out_by_refit(search, fitted.found, returned, added).plain
        return fitted.plain if returned is None else fitted.plain + put_back(offsets, whitener, fitted)

    kept = never_worse(answer.names, gaps.before, after, counts, whitener.explained, seed=findings.seed)
    if kept.dropped:
        answer.names = list(kept.names)
        # where noise, first touch and shape explain what is left there is nothing that it might be
        answer.candidates += kept.dropped if kept.unexplained else ()
        answer.remainder |= kept.unexplained
        dropped = " and ".join(n.replace("_", " ") for n in kept.dropped)
        answer.reasons.append(f"{dropped}: at held-out places the gap grows with it, so it is not named")
    return kept.after


def put_back(offsets: InstrumentOffsets, whitener: Whitener, candidate: JudgedSet) -> np.ndarray:
    """(g,) N^2: what putting the instrument's readings back adds to a candidate's plain sums of squares."""
    if not offsets.names:
        return np.zeros(whitener.groups)
    gram = whitener.raw_gram(np.stack([candidate.residual, offsets.residual], axis=2))
    return gram[:, 1, 1] + 2 * gram[:, 0, 1]


def held_out_by_refit(search: Search, found: Fit, extra: np.ndarray | None, added: float) -> HeldOutLosses:
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
    return HeldOutLosses(plain, *special)


def _without(search: Search, found: Fit, fold: np.ndarray, extra: np.ndarray | None) -> np.ndarray:
    """(g,) plain sums of squares of a fit that has not seen the sites of `fold`."""
    weights = np.ones(search.whitener.groups)
    weights[fold] = 0.0
    again = search.without(found, fold)
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


@dataclass(frozen=True)
class Kept:
    """names: what may be named, strongest first. dropped: weakest first. after: (g,) N^2, held out so.

    unexplained: what was dropped had stood for a gap that is there all the same.
    """

    names: tuple[str, ...]
    dropped: tuple[str, ...]
    after: np.ndarray
    unexplained: bool


def never_worse(
    names: Sequence[str],
    before: np.ndarray,
    after: Callable[[tuple[str, ...]], np.ndarray],
    counts: np.ndarray,
    explained: float,
    *,
    beyond_chance: bool = True,
    resamples: int = 1000,
    seed: int = 0,
) -> Kept:
    """The longest run of the strongest `names` with which the held-out gap does not grow.

    before: (g,) N^2, held-out sums of squares of each site with nothing named; after(names): the same with
    these, asked for fewer names only where more made it worse. counts: (g,) samples. explained: N^2, the
    mean square a sample that noise, first touch and shape explain. beyond_chance: growth counts only where
    the 95 % interval by resampled sites lies wholly above zero (a lump in one place cannot be confirmed in
    the others); else any growth does.
    """
    kept = tuple(names)
    dropped: list[str] = []
    left = after(kept) if kept else before
    while kept and _grows(before, left, beyond_chance, resamples, seed):
        dropped.append(kept[-1])
        kept = kept[:-1]
        left = after(kept) if kept else before
    unexplained = bool(dropped) and left.sum() / counts.sum() > explained
    return Kept(kept, tuple(dropped), left, bool(unexplained))


def _grows(before: np.ndarray, after: np.ndarray, beyond_chance: bool, resamples: int, seed: int) -> bool:
    growth = after - before
    if not beyond_chance or growth.sum() <= 0:
        return bool(growth.sum() > 0)
    drawn = resampled((growth,), np.sum, resamples, np.random.default_rng(seed))
    return bool(np.quantile(drawn, 0.025) > 0)
