"""Which effect: added one at a time, two at a time in time where one does not help, and taken off again where
idle."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnose.confidence_set import confidence_p
from diagnose.effects.base import Effect
from diagnose.judging import EVERYWHERE, SPATIAL, Candidate, Score, Search, sideways_off
from diagnose.solved_again import solve_inclusion
from mechanics.progress import Progress, silent

REEXAMINED = 4
"""The strongest effects of a step that are weighed once more before they are turned down."""

IN_TIME = ("time_delay", "viscoelasticity", "backlash", "adhesion", "mullins_softening")
"""Effects that are also tried two at a time where none helps alone."""

OUT_OF_SET = 0.1
"""An effect with a smaller p value is not in the model confidence set of 90 %."""

RIVAL_CLOSES = 0.3
"""A rival closes at least this share of what the one that was picked closes of the plain held-out gap."""

HIDING = (*EVERYWHERE, "skin_layer", "compliant_base")
"""Effects that bend the depth law the other way than finite strain does, so that neither shows alone."""

HIDDEN_LEAST = 10.0
"""Such an effect gains this much alone before it is tried with finite strain as well."""

LINEAR_UNLESS = -8.0
"""Real solids strain finitely: the linear law is taken only where it fits better by this log likelihood."""


@dataclass(frozen=True)
class Attribution:
    """The search's outcome.

    base: what effects were added to (finite strain in it where the data prefer it). ideal: linear elasticity
    alone; deep: neo-Hookean alone. scores: of every single effect on the base. chosen: names, strongest
    first. rivals: names not told apart from a chosen one. final: the chosen set. steps, picked: what each
    step looked like and what it took. finite_strain_gain: log likelihood, in the final set. standing: p value
    by which each effect, and 'none', is in the first step's model confidence set.
    """

    base: Candidate
    ideal: Candidate
    deep: Candidate
    scores: dict[str, Score]
    chosen: tuple[str, ...]
    rivals: tuple[str, ...]
    final: Candidate
    steps: tuple[dict[str, Score], ...]
    picked: tuple[str, ...]
    finite_strain_gain: float
    standing: dict[str, float]


def attribute(search: Search, effects: Sequence[Effect], *, progress: Progress = silent) -> Attribution:
    """Forward selection with backward check; rivals of the first choice are declared."""
    fs = search.finite_strain
    ideal, deep = search.judge([]), search.judge([fs])
    _, strain_gain = _with_strain(search, [])
    base = deep if strain_gain > LINEAR_UNLESS else ideal
    library = [e for e in effects if e.name not in ("finite_strain", "surface_shape")]
    current = base
    chosen: list[str] = []
    steps: list[dict[str, Score]] = []
    for step in range(search.options.most):
        scores: dict[str, Score] = {}
        for i, effect in enumerate(library):
            if effect.name in current.found.names:
                continue
            progress(f"effect {step + 1}: {effect.name}", (step + i / len(library)) / search.options.most)
            candidate = search.judge([*current.found.effects, effect], like=current)
            if not chosen:
                candidate = _with_hidden_strain(search, effect, candidate, current)
            scores[effect.name] = search.score(effect.name, candidate, current)
        first = not chosen
        for score in sorted(scores.values(), key=lambda s: -s.gain)[:REEXAMINED]:
            if score.gain > search.options.plain_gain and not search.passes(score, first=first):
                scores[score.name] = _reexamined(search, score, current)
        steps.append(scores)
        least = search.options.least_of_first * max((steps[0][n].size_n for n in chosen[:1]), default=0.0)
        passing = [s for s in scores.values() if search.passes(s, first=not chosen) and s.size_n > least]
        off = sideways_off(search.forward, current)
        if off:
            passing = _not_blind_to_slip(search, passing, scores.get("friction_slip"), off)
        if not passing:
            pair = None if step + 2 > search.options.most else _paired(search, library, current)
            if pair is None:
                break
            chosen += [n for n in pair.found.names if n not in current.found.names]
            search.renew(pair.found)
            current, strain_gain = _with_strain(search, pair.found.effects)
            break
        best = max(passing, key=lambda s: s.gain)
        chosen.append(best.name)
        search.renew(best.candidate.found)
        current, strain_gain = _with_strain(search, best.candidate.found.effects)
    picked = list(zip(steps, chosen, strict=False))
    current, chosen = _without_idle(search, chosen, current)
    if "inclusion" in chosen:
        current = _solved_again(search, current)
    sets = [standing(scores) for scores in steps]
    rivals = _rivals(search, picked, sets, chosen)
    order = _strongest_first(search, current, chosen)
    return Attribution(
        base,
        ideal,
        deep,
        steps[0],
        tuple(order),
        rivals,
        current,
        tuple(steps),
        tuple(name for _, name in picked),
        float(strain_gain),
        sets[0],
    )


def _with_hidden_strain(
    search: Search, effect: Effect, candidate: Candidate, current: Candidate
) -> Candidate:
    """The candidate, or with finite strain beside it where each may have hidden the other."""
    if effect.name not in HIDING or "finite_strain" in current.found.names:
        return candidate
    if (
        current.found.loss - candidate.found.loss
        < HIDDEN_LEAST * search.forward.touches.noise.variance_inflation
    ):
        return candidate
    both = search.judge([search.finite_strain, *candidate.found.effects], like=candidate)
    return both if both.found.loss < candidate.found.loss else candidate


def _paired(search: Search, library: Sequence[Effect], current: Candidate) -> Candidate | None:
    """Two effects in time that close the gap only together: memory and delay bend loops opposite ways."""
    if current.chi < search.options.unknown_chi:
        return None
    able = [e for e in library if e.name in IN_TIME and e.name not in current.found.names]
    found = []
    for one, two in itertools.combinations(able, 2):
        candidate = search.judge([*current.found.effects, one, two], like=current)
        score = search.score(f"{one.name}+{two.name}", candidate, current)
        if candidate.chi < 0.5 * current.chi and score.gain > 2 * search.options.gain and score.share > 0:
            found.append(candidate)
    return min(found, key=lambda c: c.found.loss, default=None)


def _not_blind_to_slip(search: Search, passing: list[Score], slip: Score | None, off: float) -> list[Score]:
    """What may be named while the sideways force is off by a share: slip where it helps; of effects that
    differ from place to place only those that mend it, or a sliding tip is taken for a soft place."""
    kept = [
        s for s in passing if s.name not in SPATIAL or sideways_off(search.forward, s.candidate) < 0.7 * off
    ]
    if slip is not None and slip not in kept:
        if slip.gain > search.options.plain_gain and slip.share > search.options.further_share:
            kept.append(slip)
    return kept


def _solved_again(search: Search, current: Candidate) -> Candidate:
    """The set with its lump solved anew; as it was where that fits worse."""
    first = current
    for _ in range(2):
        solve_inclusion(search.forward, current.found.of("inclusion"))
        search.renew(current.found)
        current = search.judge(current.found.effects, like=current)
    if current.found.loss < first.found.loss + search.options.plain_gain:
        return current
    del search.forward.stages["inclusion_scale"]
    search.renew(first.found)
    return first


def _reexamined(search: Search, score: Score, current: Candidate) -> Score:
    """The score with size and plain gap as they are where nuisances are weighed at the new fit.

    Where an effect changes the force much, first touches and stiffnesses of the old fit had made up for it.
    """
    there = search.reweighed(score.candidate.found)
    old = there.judge(current.found.effects, like=current)
    new = there.judge(score.candidate.found.effects, like=score.candidate)
    again = there.score(score.name, new, old)
    return dataclasses.replace(again, gain=score.gain, z=score.z, per_group=score.per_group)


def _with_strain(search: Search, effects: Sequence[Effect]) -> tuple[Candidate, float]:
    """The set with or without finite strain, whichever fits better, and the gain of having it."""
    rest = [e for e in effects if e.name != "finite_strain"]
    without, deep = search.judge(rest), search.judge([search.finite_strain, *rest])
    over = max(1.0, min(without.chi, deep.chi)) * search.forward.touches.noise.variance_inflation
    each = 0.5 * (without.found.gram[:, 0, 0] - deep.found.gram[:, 0, 0])
    # the site that speaks loudest, for or against, may be one that slipped
    gain = (each.sum() - each.max() - each.min()) / over
    return (deep if gain > LINEAR_UNLESS else without), float(gain)


def _without_idle(search: Search, chosen: list[str], current: Candidate) -> tuple[Candidate, list[str]]:
    """Drop effects that later ones made idle."""
    chosen = list(chosen)
    for name in list(chosen):
        if len(chosen) < 2:
            break
        without = search.judge([e for e in current.found.effects if e.name != name])
        if name == "friction_slip" and sideways_off(search.forward, without):
            continue
        score = search.score(name, current, without)
        if score.gain < search.options.strong_gain * current.chi and not search.passes(score, first=False):
            chosen.remove(name)
            current = without
    return current, chosen


def standing(scores: dict[str, Score]) -> dict[str, float]:
    """p value of each effect of a step, and of 'none', in the model confidence set over sites."""
    names = [*scores, "none"]
    losses = np.array([-s.per_group for s in scores.values()])
    losses = np.vstack([losses, np.zeros(losses.shape[1])])
    return dict(zip(names, confidence_p(losses, np.random.default_rng(0)), strict=True))


def _rivals(
    search: Search,
    picked: list[tuple[dict[str, Score], str]],
    sets: list[dict[str, float]],
    chosen: list[str],
) -> tuple[str, ...]:
    """Effects whose gain comes so close to that of the one picked in the same step that the sites do not tell
    them apart."""
    found: dict[str, float] = {}
    for (scores, name), p in zip(picked, sets, strict=False):
        if name not in chosen:
            continue
        first = scores[name]
        for score in scores.values():
            if score.name in chosen or score.gain <= 0.6 * search.options.plain_gain:
                continue
            if score.share < RIVAL_CLOSES * max(first.share, 0.0) and score.name != "inclusion":
                continue
            behind = first.gain - score.gain
            difference = first.per_group - score.per_group
            spread = difference.std() * np.sqrt(len(difference))
            near = behind < max(search.options.rival_share * first.gain, 2.0 * spread, 25.0)
            as_good = score.share > first.share - 0.05 and score.gain > 0.3 * first.gain
            standing_beside = p[score.name] > OUT_OF_SET and score.gain > 0.6 * first.gain
            if (near and behind < 0.6 * first.gain) or as_good or standing_beside:
                found.setdefault(score.name, behind)
    return tuple(sorted(found, key=lambda n: found[n]))


def _strongest_first(search: Search, final: Candidate, chosen: list[str]) -> list[str]:
    if len(chosen) < 2:
        return list(chosen)
    loss = {}
    for name in chosen:
        rest = [e for e in final.found.effects if e.name != name]
        loss[name] = search.judge(rest).found.loss
    return sorted(chosen, key=lambda n: -loss[n])
