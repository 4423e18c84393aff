"""Which effect: every one is fitted, judged on sites that it has not seen, and combined where two are
needed."""

from __future__ import annotations

import copy
import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnose.effects.base import Effect
from diagnose.fit import Descent, Fit, first_touches, fit, held_out, levelled, settings_of
from diagnose.forward import Forward
from diagnose.solved_again import solve_inclusion
from diagnose.whiten import NuisanceOptions, Whitener
from mechanics.options import option
from mechanics.progress import Progress, silent

SPATIAL = (
    "inclusion",
    "modulus_gradient",
    "skin_layer",
    "poisson_ratio",
    "unbonded_base",
    "compliant_base",
    "tip_radius",
    "tool_compliance",
    "force_gain",
    "surface_offset",
    "strain_stiffening",
)
"""Effects that differ from site to site rather than within a press."""

ANEW = 0.8
"""A fit from unmoved first touches replaces the usual one where its loss is this much less."""

REEXAMINED = 4
"""The strongest effects of a step that are weighed once more before they are turned down."""

IN_TIME = ("time_delay", "viscoelasticity", "backlash", "adhesion", "mullins_softening")
"""Effects that are also tried two at a time where none helps alone."""

LINEAR_UNLESS = -8.0
"""Real solids strain finitely: the linear law is taken only where it fits better by this log likelihood."""


@dataclass(frozen=True)
class AttributionOptions:
    """When an effect is named. Calibrated on recordings without any effect; see docs/diagnosis.md."""

    gain: float = option(150.0, "least gain in log likelihood over held-out sites that names an effect")
    spatial_gain: float = option(120.0, "the same for effects that live in a few places, penalised in sample")
    plain_gain: float = option(35.0, "a lower gain that is enough where the gap closes plainly ...")
    plain_share: float = option(0.35, "... by at least this share on held-out sites")
    strong_gain: float = option(
        300.0, "gain, times the lack of fit, that names the first effect whatever plain gap shapes leave"
    )
    z: float = option(2.5, "least gain over its own standard error across sites")
    size_n: float = option(0.009, "least size of an effect: rms change of force after the refit", unit="N")
    toward: float = option(
        0.2, "least share of an effect's own size by which it lowers the plain gap in sample"
    )
    first_share: float = option(0.10, "least share of the held-out gap that the first effect closes")
    further_share: float = option(0.25, "the same for each further effect, of what is left")
    least_of_first: float = option(
        0.25,
        "least size of a further effect, of the first's: no law is exact, what it leaves is no effect",
    )
    rival_share: float = option(
        0.12, "a rival within this share of the winner's gain counts as not told apart"
    )
    most: int = option(3, "effects in one answer, at most")
    unknown_chi: float = option(1.9, "lack of fit (whitened mean square) beyond which a remainder is unknown")


@dataclass(frozen=True)
class Candidate:
    """A set of effects judged: its fit, losses and plain sums of squares of held-out groups, and gains on the
    base."""

    found: Fit
    held: np.ndarray
    plain: np.ndarray
    dof: float

    @property
    def residual(self) -> np.ndarray:
        """(n, 3) N, measured less predicted, with the modulus of the plain fit."""
        return levelled(self.found)

    @property
    def chi(self) -> float:
        """Whitened mean square per component: about 1 where the noise model holds."""
        return float(self.found.gram[:, 0, 0].sum() / self.dof)


@dataclass(frozen=True)
class Score:
    """How much better a candidate is than what it was added to.

    gain: log likelihood, deflated by its own lack of fit. z: gain over its standard error across sites.
    size_n: rms change of the predicted force, N. closes: plain held-out mean square it takes away, N^2.
    share: of the old excess over the noise.
    toward: plain mean square taken away in sample over size squared: 1 where the change meets the gap.
    """

    name: str
    gain: float
    z: float
    size_n: float
    closes: float
    share: float
    toward: float
    per_group: np.ndarray
    candidate: Candidate


@dataclass(frozen=True)
class Attribution:
    """The search's outcome.

    base: what effects were added to (finite strain in it where the data prefer it). ideal: linear elasticity
    alone; deep: neo-Hookean alone. scores: of every single effect on the base. chosen: names, strongest
    first. rivals: names not told apart from a chosen one. final: the chosen set. steps, picked: what each
    step looked like and what it took. finite_strain_gain: log likelihood, in the final set.
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


class Search:
    """Holds what all fits share: forward model, whitener, options, and a cache of fits by names."""

    def __init__(
        self,
        forward: Forward,
        modulus: float,
        *,
        nuisance: NuisanceOptions,
        options: AttributionOptions,
        site_sd: np.ndarray | None,
        finite_strain: Effect,
    ) -> None:
        self.forward, self.options, self.nuisance, self.site_sd = forward, options, nuisance, site_sd
        whitener = Whitener(forward, forward.ideal(modulus), nuisance, site_sd)
        onset = first_touches(forward, whitener, modulus)
        rough = fit(forward, whitener, [finite_strain], modulus=modulus, onset=onset)
        self.finite_strain = finite_strain
        self.renew(rough)

    def renew(self, found: Fit) -> None:
        """Weigh from now on with the nuisances as they are at a fit; earlier judgements are forgotten."""
        settings = settings_of(self.forward, found.effects, found.values, found.onset)
        self.whitener = Whitener(self.forward, settings, self.nuisance, self.site_sd)
        self.dof = 3.0 * float(self.whitener.counts().sum())
        self._near = found
        self._cache: dict[tuple[str, ...], Candidate] = {}

    def reweighed(self, found: Fit) -> Search:
        """The same search, weighing with the nuisances as they are at a fit."""
        other = copy.copy(self)
        other.renew(found)
        return other

    def judge(self, effects: Sequence[Effect], like: Candidate | None = None) -> Candidate:
        """Fit a set and judge it on held-out groups; starts from `like`, or from what was last settled on."""
        key = tuple(sorted(e.name for e in effects))
        if key in self._cache:
            return self._cache[key]
        near = self._near if like is None else like.found
        starts = [np.array([near.values[0]])]
        for effect in effects:
            own = [near.of(effect.name)] if effect.name in near.names else effect.starts(self.forward)
            starts = [np.concatenate([s, o]) for s in starts for o in own]
        found = self._best(list(effects), starts, near.onset)
        held, plain = held_out(found)
        candidate = Candidate(found, held, plain, self.dof)
        self._cache[key] = candidate
        return candidate

    def _best(self, order: list[Effect], starts: list[np.ndarray], onset: np.ndarray) -> Fit:
        descent = Descent(self.forward, self.whitener, tuple(order), None)

        def best(onset: np.ndarray, most: int) -> Fit:
            scored = [descent.loss(s, descent.residual(s, onset), onset) for s in starts]
            return min(
                (descent.run(starts[i], onset, 12) for i in np.argsort(scored)[:most]), key=lambda f: f.loss
            )

        found = best(onset, 3)
        # first touches that an earlier fit moved to make up for what it lacked may hold a better one back
        if found.loss > self.options.unknown_chi * self.dof / 2:
            anew = best(np.zeros_like(onset), 2)
            found = anew if anew.loss < ANEW * found.loss else found
        return found

    def score(self, name: str, new: Candidate, old: Candidate) -> Score:
        """Compare two candidates."""
        extra = len(new.found.values) - len(old.found.values)
        over = max(1.0, new.chi) * self.forward.touches.slowness
        per_group = old.held - new.held
        gain = float(per_group.sum())
        if name in SPATIAL:
            # a few places hold the evidence: leaving them out leaves nothing, so the sample pays a price
            per_group = 0.5 * (old.found.gram[:, 0, 0] - new.found.gram[:, 0, 0])
            gain = old.found.loss - new.found.loss - 4.0 * extra
        z = per_group.sum() / (per_group.std() * np.sqrt(len(per_group)) + 1e-9)
        counted = self.forward.touches.counted
        before, after = old.residual[counted], new.residual[counted]
        size = float(np.sqrt(((after - before) ** 2).sum(axis=1).mean()))
        closes = float((old.plain.sum() - new.plain.sum()) / counted.sum())
        squares = [(r**2).sum(axis=1).mean() for r in (before, after)]
        toward = float((squares[0] - squares[1]) / max(size**2, 1e-12))
        noise = 3 * self.forward.touches.noise_n**2
        excess = max(float(old.plain.sum() / counted.sum()) - noise, 0.02 * noise)
        share = closes / excess
        return Score(name, float(gain / over), float(z), size, closes, share, toward, per_group / over, new)

    def passes(self, score: Score, *, first: bool = True) -> bool:
        """Whether a score names its effect; one beside another must close a fair share of what is left."""
        o = self.options
        if score.size_n < o.size_n:
            return False
        if score.name == "surface_offset" and not first:
            # a delay or a play has already moved the first touches that the surface was fitted to
            return False
        if score.name == "inclusion":
            return score.gain > o.spatial_gain and score.share > -0.3 and score.toward > o.toward
        if first and score.gain > o.strong_gain * max(1.0, score.candidate.chi) and score.z > o.z:
            return True
        if score.share < (o.first_share if first else o.further_share) or score.toward < o.toward:
            return False
        if score.gain > o.plain_gain and score.share > o.plain_share and score.z > 2.0:
            return True
        return score.gain > o.spatial_gain if score.name in SPATIAL else score.gain > o.gain and score.z > o.z


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
            scores[effect.name] = search.score(effect.name, candidate, current)
        first = not chosen
        for score in sorted(scores.values(), key=lambda s: -s.gain)[:REEXAMINED]:
            if score.gain > search.options.plain_gain and not search.passes(score, first=first):
                scores[score.name] = _reexamined(search, score, current)
        steps.append(scores)
        least = search.options.least_of_first * max((steps[0][n].size_n for n in chosen[:1]), default=0.0)
        passing = [s for s in scores.values() if search.passes(s, first=not chosen) and s.size_n > least]
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
    rivals = _rivals(search, picked, chosen)
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
    )


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
    over = max(1.0, min(without.chi, deep.chi)) * search.forward.touches.slowness
    gain = (without.found.loss - deep.found.loss) / over
    return (deep if gain > LINEAR_UNLESS else without), float(gain)


def _without_idle(search: Search, chosen: list[str], current: Candidate) -> tuple[Candidate, list[str]]:
    """Drop effects that later ones made idle."""
    chosen = list(chosen)
    for name in list(chosen):
        if len(chosen) < 2:
            break
        without = search.judge([e for e in current.found.effects if e.name != name])
        score = search.score(name, current, without)
        if score.gain < search.options.strong_gain * current.chi and not search.passes(score, first=False):
            chosen.remove(name)
            current = without
    return current, chosen


def _rivals(search: Search, picked: list[tuple[dict[str, Score], str]], chosen: list[str]) -> tuple[str, ...]:
    """Effects whose gain comes so close to that of the one picked in the same step that the sites do not tell
    them apart."""
    found: dict[str, float] = {}
    for scores, name in picked:
        if name not in chosen:
            continue
        first = scores[name]
        for score in scores.values():
            if score.name in chosen or score.gain <= 0.6 * search.options.plain_gain:
                continue
            if score.share < 0 and score.name != "inclusion":
                continue
            behind = first.gain - score.gain
            difference = first.per_group - score.per_group
            spread = difference.std() * np.sqrt(len(difference))
            near = behind < max(search.options.rival_share * first.gain, 2.0 * spread, 25.0)
            as_good = score.share > first.share - 0.05 and score.gain > 0.3 * first.gain
            if (near and behind < 0.6 * first.gain) or as_good:
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
