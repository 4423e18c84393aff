"""How likely each set of causes is beside all others that were weighed; and which patterns look alike.

A search goes step by step: something more is there, one of what was tried, or nothing more. The naming's log
odds of each against nothing more are that step's posterior; along the steps they multiply.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import softmax

from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.mechanics.effects.base import Effect

ALIKE = 0.92
"""Cosine of the angle between two effects' residual patterns from which they are called confusable."""
Names = tuple[str, ...]


@dataclass(frozen=True)
class Explanation:
    """A set of causes, and the probability that these, and no others, are there."""

    effects: Names
    probability: float


@dataclass(frozen=True)
class Choice:
    """One step: log odds, against nothing more, of what may be there beside what is chosen, and what was
    taken (() where nothing was). certain: it is known from elsewhere."""

    log_odds: Mapping[Names, float]
    taken: Names
    certain: bool = False

    def probabilities(self) -> dict[Names, float]:
        """Of each, and of nothing more."""
        if self.certain:
            return {self.taken: 1.0}
        odds = {(): 0.0, **self.log_odds}
        return dict(zip(odds, softmax(list(odds.values())).tolist(), strict=True))


def posterior(choices: Sequence[Choice], found: Names) -> tuple[Explanation, ...]:
    """Every set of causes that was weighed, the likeliest first.

    found: the names that the last step's set was put back to. What stands beside a choice that was not taken
    is not weighed: its set stands for all that hold it.
    """
    sets: list[Explanation] = []
    reached: Names = ()
    left = 1.0
    for choice in choices:
        each = choice.probabilities()
        sets += [Explanation((*reached, *n), left * p) for n, p in each.items() if n != choice.taken]
        left *= each[choice.taken]
        reached = (*reached, *choice.taken)
        if not choice.taken:
            break
    return _gathered([Explanation(found, left), *sets])


def joint(one: Sequence[Explanation], two: Sequence[Explanation]) -> tuple[Explanation, ...]:
    """Of two answers that do not depend on each other."""
    return _gathered(
        [Explanation((*a.effects, *b.effects), a.probability * b.probability) for a in one for b in two]
    )


def without(explanations: Sequence[Explanation], names: Collection[str]) -> tuple[Explanation, ...]:
    """The same once these names are known not to be there."""
    left = (Explanation(tuple(n for n in e.effects if n not in names), e.probability) for e in explanations)
    return _gathered(list(left))


def _gathered(sets: Sequence[Explanation]) -> tuple[Explanation, ...]:
    """Each set once, in the order of the names that came first."""
    found: dict[frozenset[str], Explanation] = {}
    for e in sets:
        key = frozenset(e.effects)
        before = found.get(key, Explanation(e.effects, 0.0))
        found[key] = Explanation(before.effects, before.probability + e.probability)
    return tuple(sorted((e for e in found.values() if e.probability > 0), key=lambda e: -e.probability))


def names_of(explanations: Sequence[Explanation]) -> Names:
    """The names in any of them, those of the likeliest first."""
    return tuple(dict.fromkeys(n for e in explanations for n in e.effects))


def likeliest(explanations: Sequence[Explanation], share: float) -> tuple[Explanation, ...]:
    """The smallest collection, the likeliest first, that holds a share of the posterior."""
    total = np.cumsum([e.probability for e in explanations])
    return tuple(explanations[: int(np.searchsorted(total, share - 1e-9)) + 1])


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
