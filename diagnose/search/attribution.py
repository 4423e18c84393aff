"""An answer of several effects is put back to fewer, or to a likelier one, where those explain the places
that were not fitted as well.

Forward selection takes what gains most where nuisances are weighed as they were before it. An effect that
says itself how little it knows (where in its play the tip is) gains less there than one that bends to the
data, and what it leaves is taken for a second and a third. So each set is weighed by its own covariance:
its held-out log likelihood, the covariance's volume in it, group by group, and the difference of two sets
with its standard error over the groups.

Which effect: added one at a time, two at a time in time where one does not help, and taken off again where
idle.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.diagnosis.search.naming import Score
from palpate.diagnosis.search.own_size import own_n, size_n, without_wider
from palpate.diagnosis.search.rivals import Choice, Explanation, Names, of_one_phenomenon, posterior
from palpate.mechanics.effects.base import Effect, Scope
from palpate.mechanics.progress import Progress, part, silent

TRIED = 3
"""So many others are tried, those that gain most by themselves."""
SURE = 2.0
"""Standard errors by which another of as many effects must be better."""


def drop_redundant(
    search: Search, chosen: Sequence[str], current: JudgedSet, alone: dict[str, Score], seen: frozenset[str]
) -> tuple[JudgedSet, list[str]]:
    """(the set, its names): what was chosen, or fewer that do as well within one standard error.

    alone: every effect by itself, of the first step. seen: names that stay.
    """
    effects = [e for e in current.found.effects if e.name in chosen]
    base = [e for e in current.found.effects if e.name not in chosen]
    # what is certainly less likely by itself is not what fewer effects would be
    least = max((alone[n].log_odds for n in chosen if n in alone), default=0.0) - search.options.beyond_doubt
    able = (s for s in alone.values() if s.name not in chosen and search.passes(s) and s.log_odds > least)
    others = [s.effect for s in able]
    others.sort(key=lambda e: -alone[e.name].gain)
    own = _cost(search, current)
    over = current.over
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


def _cost(search: Search, candidate: JudgedSet) -> np.ndarray:
    """(g,) less the log likelihood of each group left out, by the covariance as it is at the set's own
    fit."""
    there = search.reweighed(candidate.found)
    return there.judge(candidate.found.effects, like=candidate).held + there.whitener.volume


UNLIKELY, MOST_TOLD_APART = 0.02, 4
"""Probability down to which others are told apart from the best by fits of both; how many at most."""
SHOWN, MOST_SHOWN = 10.0, 4
"""Gain in log likelihood from which an effect on a simulator's force is there, if not alone; of how many such
effects pairs are tried."""


@dataclass(frozen=True)
class Attribution:
    """The search's outcome.

    base: what effects were added to (finite strain in it where the data prefer it). ideal: linear elasticity
    alone; deep: neo-Hookean alone. scores: of every single effect on the base. chosen: names, strongest
    first. final: the chosen set. explanations: every set of causes that was weighed, the likeliest first.
    steps, picked: what each step looked like and what it took. finite_strain_gain: log likelihood, in the
    final set; finite_strain_closes: N^2, by how much it lowers there the sum of held-out squares.
    """

    base: JudgedSet
    ideal: JudgedSet
    deep: JudgedSet
    scores: dict[str, Score]
    chosen: tuple[str, ...]
    final: JudgedSet
    explanations: tuple[Explanation, ...]
    steps: tuple[dict[str, Score], ...]
    picked: tuple[str, ...]
    finite_strain_gain: float
    finite_strain_closes: float

    @property
    def scored(self) -> dict[str, Score]:
        """{name: score} of the first step; what only a later one tried, as another law of a phenomenon, with
        that step's, where it was chosen."""
        later = {n: step[n] for step in reversed(self.steps[1:]) for n in self.chosen if n in step}
        return later | self.scores


def attribute(
    search: Search,
    effects: Sequence[Effect],
    *,
    seen: frozenset[str] = frozenset(),
    progress: Progress = silent,
) -> Attribution:
    """Forward selection with backward check of effects to be tried, and how likely each set is.

    seen: names that are known to be there from elsewhere: they are taken first, and stay.
    """
    selection = _Selection(search, effects, seen)
    most = search.options.greatest_number
    for step in range(most):
        if not selection.step(part(progress, step / most, (step + 1) / most)):
            break
    steps, current, chosen = selection.steps, selection.current, selection.chosen
    picked = tuple(chosen)[: len(steps)]
    together = current
    current, chosen = _without_idle(search, chosen, current, seen)
    if not search.forward.measured:
        current, chosen = without_wider(search, chosen, current, together)
    if any(n not in seen for n in chosen):
        current, chosen = drop_redundant(search, chosen, current, steps[0], seen)
    for effect in current.found.effects:
        current = _refined(search, effect, current)
    order = tuple(_strongest_first(search, current, chosen))
    return Attribution(
        selection.base, selection.ideal, selection.deep, steps[0], order, current,
        posterior(selection.choices, order), tuple(steps), picked,
        selection.strain_gain, selection.strain_closes,
    )  # fmt: skip


class _Selection:
    """Forward selection: each step scores every effect on what is there, and takes the likeliest, two that
    close the gap only together, or nothing more.

    base: linear or neo-Hookean, as the data prefer it; current: the set so far; chosen: its names in order;
    steps: the scores of each step; choices: what each took; strain_gain, strain_closes: of finite strain in
    the set (`_with_strain`).
    """

    def __init__(self, search: Search, effects: Sequence[Effect], seen: frozenset[str]) -> None:
        self.search, self.effects, self.seen = search, effects, seen
        self.ideal, self.deep = search.judge([]), search.judge([search.finite_strain])
        _, self.strain_gain, self.strain_closes = _with_strain(search, [])
        self.base = self.deep if self.strain_gain > -search.options.beyond_doubt else self.ideal
        self.current = self.base
        self.chosen: list[str] = []
        self.steps: list[dict[str, Score]] = []
        self.choices: list[Choice] = []

    def step(self, progress: Progress) -> bool:
        """Whether one effect was taken, so that there may be more."""
        scores = self._scores(progress)
        if not scores:
            return False
        self.steps.append(scores)
        able = self._able(scores)
        odds: dict[Names, float] = {(s.name,): s.log_odds for s in able}
        known = [scores[n] for n in sorted(self.seen) if n in scores]
        known = [s for s in known if s.size_n > self.search.smallest_n]
        likely = known or [s for s in able if s.probability > self.search.options.sure]
        if likely:
            self._take_one(max(likely, key=lambda s: s.log_odds), scores, odds, certain=bool(known))
        else:
            self._take_two(scores, odds)
        return bool(likely)

    def _scores(self, progress: Progress) -> dict[str, Score]:
        """Of every effect that is not there; of the laws of one phenomenon the first stands for all until it
        is picked."""
        scores: dict[str, Score] = {}
        there = self.current.found
        for i, effect in enumerate(self.effects):
            if effect.name in there.names or of_one_phenomenon(effect, [*there.effects, *self.effects[:i]]):
                continue
            progress(f"effect {len(self.steps) + 1}: {effect.name}", i / len(self.effects))
            candidate = self.search.judge([*there.effects, effect], like=self.current)
            if not self.chosen:
                candidate = _with_hidden_strain(self.search, effect, candidate, self.current)
            scores[effect.name] = self.search.score([effect], candidate, self.current)
        return scores

    @property
    def _least_n(self) -> float:
        """N rms by which whatever is named beside the first changes the force at least."""
        sizes = (self.steps[0][n].size_n for n in self.chosen[:1])
        return self.search.options.least_of_first * max(sizes, default=0.0)

    def _able(self, scores: dict[str, Score]) -> list[Score]:
        """What may be there: it foretells places, and changes enough beside the first."""
        search, first, least = self.search, self.chosen[:1], self._least_n
        able = [s for s in scores.values() if search.able(s, first=not first)]
        able = [s for s in able if size_n(search, s, self.chosen, least) > least]
        if search.forward.measured and search.sideways_off(self.current):
            able = _not_blind_to_slip(search, able)
        return able

    def _take_one(
        self, best: Score, scores: dict[str, Score], odds: dict[Names, float], certain: bool
    ) -> None:
        """The likeliest, or a rival that says all that it says and more; by that law of its phenomenon which
        has the most evidence."""
        choice, instead = self._choice_of(best, scores, odds, certain)
        if instead is not None and not certain:
            choice, _ = self._choice_of(instead, scores, odds, certain)
        best = scores[choice.taken[0]]
        self.chosen.append(best.name)
        self.choices.append(choice)
        self._weigh_strain(best)

    def _choice_of(
        self, best: Score, scores: dict[str, Score], odds: dict[Names, float], certain: bool
    ) -> tuple[Choice, Score | None]:
        """The choice of the best, by its likeliest law, and of `_told_apart` what is to be taken instead."""
        for effect in self.effects:
            if of_one_phenomenon(effect, [best.effect]) and effect.name not in scores:
                candidate = self.search.judge([*self.current.found.effects, effect], like=self.current)
                scores[effect.name] = self.search.score([effect], candidate, self.current)
        laws = [s for s in scores.values() if of_one_phenomenon(s.effect, [best.effect])]
        best = _best_law(self.search, laws, best)
        others = {n: x for n, x in odds.items() if _another(scores[n[0]], best)}
        choice = Choice({**others, (best.name,): best.log_odds}, (best.name,), certain)
        self.search.renew(best.candidate.found)
        return _told_apart(self.search, choice, scores, best)

    def _take_two(self, scores: dict[str, Score], odds: dict[Names, float]) -> None:
        """Two that close the gap only together, where as many may still be named; else nothing more."""
        pair = None
        if len(self.steps) < self.search.options.greatest_number:
            able = _able_together(self.search, self.effects, self.current, scores)
            pair = _paired(self.search, able, self.current, self._least_n)
        if pair is None:
            self.choices.append(Choice(odds, ()))
            return
        names = tuple(e.name for e in pair.added)
        self.choices.append(Choice({**odds, names: pair.log_odds}, names))
        self._settle(pair)
        self._weigh_strain(pair)

    def _settle(self, taken: Score) -> None:
        self.chosen += [e.name for e in taken.added]
        self.search.renew(taken.candidate.found)

    def _weigh_strain(self, taken: Score) -> None:
        found = _with_strain(self.search, taken.candidate.found.effects)
        self.current, self.strain_gain, self.strain_closes = found


def _another(score: Score, best: Score) -> bool:
    """Whether a score may be instead of the best: of another phenomenon, and not the best in a wider form."""
    wider = score.effect.hints.any_form and best.effect.scope.between_places and score.gain < best.gain
    return not (wider or of_one_phenomenon(score.effect, best.added))


def _told_apart(
    search: Search, choice: Choice, scores: dict[str, Score], best: Score
) -> tuple[Choice, Score | None]:
    """The choice, with the odds of the likeliest others as they follow from the best and both together; and
    of those that are there beside the best, which is not beside them, the one that adds most.

    Two effects that leave the same to each other are as likely; one that leaves much to the best, to which it
    adds nothing, is not, whatever either gains by itself. search: weighs as things are at the best.
    """
    likely = sorted(choice.probabilities().items(), key=lambda item: -item[1])
    others = [n for n, p in likely if n and n != choice.taken and p > UNLIKELY][:MOST_TOLD_APART]
    odds = dict(choice.log_odds)
    rest = [e for e in best.candidate.found.effects if e not in best.added]
    most, more = 0.0, None
    for names in others:
        other = scores[names[0]]
        alone = search.judge(best.candidate.found.effects, like=best.candidate)
        instead = search.judge([*rest, *other.added], like=other.candidate)
        both = search.judge([*alone.found.effects, *other.added], like=alone)
        adds = search.score(other.added, both, alone).odds_of_shown
        lacks = search.score(best.added, both, instead).odds_of_shown
        odds[names] = min(odds[names], best.log_odds + adds - lacks)
        if adds > most and lacks < 0.0:
            most, more = adds, other
    return dataclasses.replace(choice, log_odds=odds), more


def _best_law(search: Search, others: Sequence[Score], best: Score) -> Score:
    """Of the laws of the best one's phenomenon that with the most evidence: held-out log likelihood, where
    nuisances are weighed as they are at its fit and finite strain is free to stay away, less what parameters
    cost by BIC, an observation a group of presses."""
    if not others:
        return best
    there = search.reweighed(best.candidate.found)
    each = 0.5 * np.log(len(best.per_group))

    def price(score: Score) -> float:
        rest = [e for e in score.candidate.found.effects if e is not search.finite_strain]
        sets = (rest, [search.finite_strain, *rest])
        held = min(there.judge(s, like=score.candidate).held.sum() for s in sets)
        return float(held) + each * len(score.effect.parameters)

    return min((best, *others), key=price)


def _with_hidden_strain(
    search: Search, effect: Effect, candidate: JudgedSet, current: JudgedSet
) -> JudgedSet:
    """The candidate, or with finite strain beside it where each may have hidden the other."""
    if not effect.hints.hides_strain or search.finite_strain in current.found.effects:
        return candidate
    both = search.judge([search.finite_strain, *candidate.found.effects], like=candidate)
    return both if both.found.loss < candidate.found.loss else candidate


def _able_together(
    search: Search, effects: Sequence[Effect], current: JudgedSet, scores: dict[str, Score]
) -> list[Effect]:
    """What may close a gap two at a time where none does alone: effects in time, as memory and delay bend
    loops opposite ways; of a simulator's force, which no noise hides, whatever the places show."""
    if not search.forward.measured:
        shown = sorted((s for s in scores.values() if s.gain > SHOWN), key=lambda s: -s.gain)
        return [s.effect for s in shown[:MOST_SHOWN]]
    if current.chi < search.options.unknown_chi:
        return []
    able = [e for e in effects if e.scope is Scope.TIME and e.name not in current.found.names]
    # of the laws of one phenomenon the first stands for all
    return list({e.hints.phenomenon or e.name: e for e in reversed(able)}.values())


def _paired(search: Search, able: Sequence[Effect], current: JudgedSet, least_n: float) -> Score | None:
    """Two effects that close the gap only together; of a simulator's force each changes it by least_n."""
    found: list[Score] = []
    for one, two in itertools.combinations(able, 2):
        candidate = search.judge([*current.found.effects, one, two], like=current)
        score = search.score([one, two], candidate, current)
        small = not search.forward.measured and any(
            own_n(search, candidate, e) <= least_n for e in score.added
        )
        if search.passes(score) and not small:
            found.append(score)
    return min(found, key=lambda s: s.candidate.found.loss, default=None)


def _not_blind_to_slip(search: Search, passing: list[Score]) -> list[Score]:
    """What may be named while the sideways force is off: of effects that differ from place to place only
    those that mend it, or a sliding tip is taken for a soft place."""
    return [s for s in passing if not s.effect.scope.between_places or not search.sideways_off(s.candidate)]


def _refined(search: Search, effect: Effect, current: JudgedSet) -> JudgedSet:
    """The set with an effect's law made exact at its fit, twice; as it was where its law is exact already."""
    if effect.hints.refine is None:
        return current
    for _ in range(2):
        effect.hints.refine(search.forward, current.found.of(effect.name))
        search.renew(current.found)
        current = search.judge(current.found.effects, like=current)
    return current


def _with_strain(search: Search, effects: Sequence[Effect]) -> tuple[JudgedSet, float, float]:
    """The set with or without finite strain, whichever fits better, the gain of having it, and what it closes
    of held-out squares, N^2: a law may be far likelier where noise is small, and still predict worse."""
    rest = [e for e in effects if e is not search.finite_strain]
    without, deep = search.judge(rest), search.judge([search.finite_strain, *rest])
    over = min(without.over, deep.over)
    each = 0.5 * (without.found.gram[:, 0, 0] - deep.found.gram[:, 0, 0])
    # the site that speaks loudest, for or against, may be one that slipped
    gain = (each.sum() - each.max() - each.min()) / over
    closes = float(without.plain.sum() - deep.plain.sum())
    return (deep if gain > -search.options.beyond_doubt else without), float(gain), closes


def _without_idle(
    search: Search, chosen: list[str], current: JudgedSet, seen: frozenset[str]
) -> tuple[JudgedSet, list[str]]:
    """Drop effects that later ones made idle, and what was seen elsewhere where it makes the held-out gap
    larger: a reading may be wrong."""
    chosen = list(chosen)
    for name in list(chosen):
        if len(chosen) < 2 and name not in seen:
            continue
        without = search.judge([e for e in current.found.effects if e.name != name])
        if name in seen:
            if current.plain.sum() > without.plain.sum():
                chosen.remove(name)
                current = without
            continue
        effect = next(e for e in current.found.effects if e.name == name)
        if effect.hints.slips and search.sideways_off(without):
            continue
        score = search.score([effect], current, without)
        if score.probability <= search.options.doubt:
            chosen.remove(name)
            current = without
    return current, chosen


def _strongest_first(search: Search, final: JudgedSet, chosen: list[str]) -> list[str]:
    if len(chosen) < 2:
        return list(chosen)
    loss = {}
    for name in chosen:
        rest = [e for e in final.found.effects if e.name != name]
        loss[name] = search.judge(rest).found.loss
    return sorted(chosen, key=lambda n: -loss[n])
