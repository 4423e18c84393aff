"""Which effects the sites cannot tell apart: the model confidence set, rivals of a chosen one, look-alikes.

Hansen, Lunde & Nason (2011), "The Model Confidence Set", Econometrica 79: explanations are dropped one after
another while the hypothesis that all that are left predict equally well is rejected. The units are sites, as
samples within a touch, and touches within a place, are not independent.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.diagnosis.search.naming import Score
from palpate.mechanics.effects.base import Effect

ALIKE = 0.92
"""Cosine of the angle between two effects' residual patterns from which they are called confusable."""


def confidence_set_p(scores: dict[str, Score]) -> dict[str, float]:
    """p value of each effect of a step, and of 'none', in the model confidence set over sites."""
    names = [*scores, "none"]
    losses = np.array([-s.per_group for s in scores.values()])
    losses = np.vstack([losses, np.zeros(losses.shape[1])])
    return dict(zip(names, confidence_p(losses, np.random.default_rng(0)), strict=True))


def confidence_p(losses: np.ndarray, rng: np.random.Generator, draws: int = 1000) -> np.ndarray:
    """(m,) p value of each explanation: it is in the set of confidence 1 - alpha where p > alpha.

    losses: (m, g) loss of each of m explanations at each of g sites, smaller is better. Statistic: the
    greatest t of an explanation's loss against the mean of those left (T_max), its distribution by bootstrap
    of sites. The best explanation has p = 1.
    """
    m, g = losses.shape
    p = np.ones(m)
    left = list(range(m))
    weight = rng.multinomial(g, np.full(g, 1 / g), size=draws) / g  # (draws, g), shared by all rounds
    level = 0.0
    while len(left) > 1:
        excess = losses[left] - losses[left].mean(axis=0)
        mean = excess.mean(axis=1)
        drawn = weight @ excess.T - mean
        error = np.sqrt((drawn**2).mean(axis=0)) + 1e-12
        t = mean / error
        level = max(level, float((np.max(drawn / error, axis=1) >= t.max()).mean()))
        worst = int(np.argmax(t))
        p[left.pop(worst)] = level
    return p


def rivals_of(
    search: Search,
    picked: list[tuple[dict[str, Score], dict[str, float], str]],
    chosen: list[str],
) -> tuple[str, ...]:
    """Effects that would be named themselves and that the sites do not tell from the one picked in the same
    step; the likeliest first. picked: a step's scores, their `confidence_set_p`, and what it took."""
    found: dict[str, float] = {}
    for scores, p, name in picked:
        if name not in chosen:
            continue
        first = scores[name]
        for score in scores.values():
            if score.name in chosen or of_one_phenomenon(score.effect, first.added):
                continue
            if score.effect.hints.any_form and first.effect.scope.between_places and score.gain < first.gain:
                continue
            if p[score.name] > search.options.doubt and search.passes(score):
                found.setdefault(score.name, first.log_odds - score.log_odds)
    return tuple(sorted(found, key=lambda n: found[n]))


def of_one_phenomenon(effect: Effect, others: Sequence[Effect]) -> bool:
    """Whether one of the others is another law of the same phenomenon."""
    return bool(effect.hints.phenomenon) and any(
        o.hints.phenomenon == effect.hints.phenomenon and o.name != effect.name for o in others
    )


def alike(search: Search, base: JudgedSet, candidates: dict[str, JudgedSet]) -> list[tuple[str, str, float]]:
    """Pairs whose best-fit patterns point the same way once modulus and nuisance are taken out, closest
    first."""
    names = list(candidates)
    if len(names) < 2:
        return []
    stack = np.stack([c.residual - base.residual for c in candidates.values()], axis=2)
    gram = search.whitener.gram(np.concatenate([base.found.jacobian[:, :, :1], stack], axis=2)).sum(axis=0)
    modulus = gram[0, 0]
    projected = gram[1:, 1:] - np.outer(gram[1:, 0], gram[0, 1:]) / max(modulus, 1e-12)
    size = np.sqrt(np.maximum(np.diag(projected), 1e-12))
    cosine = projected / np.outer(size, size)
    pairs = [
        (names[i], names[j], float(cosine[i, j]))
        for i in range(len(names))
        for j in range(i)
        if min(size[i], size[j]) > 3 and abs(cosine[i, j]) > ALIKE
    ]
    return sorted(pairs, key=lambda p: -abs(p[2]))
