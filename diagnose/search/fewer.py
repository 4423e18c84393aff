"""An answer of several effects is put back to fewer, or to a likelier one, where those explain the places
that were not fitted as well.

Forward selection takes what gains most where nuisances are weighed as they were before it. An effect that
says itself how little it knows (where in its play the tip is) gains less there than one that bends to the
data, and what it leaves is taken for a second and a third. So each set is weighed by its own covariance:
its held-out log likelihood, the covariance's volume in it, group by group, and the difference of two sets
with its standard error over the groups.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.leave_one_out import Candidate
from palpate.diagnosis.search.naming import Score
from palpate.diagnosis.search.rivals import of_one_phenomenon
from palpate.mechanics.effects.base import Effect, Scope

TRIED = 3
"""So many others are tried, those that gain most by themselves."""
SURE = 2.0
"""Standard errors by which another of as many effects must be better."""


def fewer(
    search: Search, chosen: Sequence[str], current: Candidate, alone: dict[str, Score], seen: frozenset[str]
) -> tuple[Candidate, list[str]]:
    """(the set, its names): what was chosen, or fewer that do as well within one standard error.

    alone: every effect by itself, of the first step. seen: names that stay.
    """
    effects = [e for e in current.found.effects if e.name in chosen]
    base = [e for e in current.found.effects if e.name not in chosen]
    others = [s.effect for s in alone.values() if s.name not in chosen and search.passes(s)]
    others.sort(key=lambda e: -alone[e.name].gain)
    own = _cost(search, current)
    over = max(1.0, current.chi) * search.forward.touches.noise.variance_inflation
    found = []
    for tried in _sets(effects, others[:TRIED], seen):
        candidate = search.judge([*base, *tried])
        if search.sideways_off(candidate) > search.sideways_off(current):
            continue
        excess = (_cost(search, candidate) - own) / over
        error = float(np.sqrt(len(excess)) * excess.std())
        allowed = error if len(tried) < len(effects) else -SURE * error
        if excess.sum() <= allowed:
            found.append((len(tried), float(excess.sum()), candidate, [e.name for e in tried]))
    if not found:
        return current, list(chosen)
    _, _, best, names = min(found, key=lambda f: f[:2])
    search.renew(best.found)
    return search.judge(best.found.effects, like=best), names


def _sets(
    effects: Sequence[Effect], others: Sequence[Effect], seen: frozenset[str]
) -> Iterator[list[Effect]]:
    """Each other by itself and beside one of the chosen; of as many as were chosen only in place of an effect
    in time by another."""
    stay = [e for e in effects if e.name in seen]
    rest = [e for e in effects if e.name not in seen]
    for other in others:
        beside = [stay] + [[*stay, e] for e in rest if not of_one_phenomenon(other, [e])]
        for kept in beside:
            in_time = all(e.scope is Scope.TIME for e in (other, *(e for e in rest if e not in kept)))
            if len(kept) + 1 < len(effects) or (len(kept) + 1 == len(effects) and in_time):
                yield [*kept, other]


def _cost(search: Search, candidate: Candidate) -> np.ndarray:
    """(g,) less the log likelihood of each group left out, by the covariance as it is at the set's own
    fit."""
    there = search.reweighed(candidate.found)
    return there.judge(candidate.found.effects, like=candidate).held + there.whitener.volume
