"""Where evidence is weighed: a set of effects is fitted, judged on sites that it has not seen, and scored
against another set.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.descent import Descent, first_touches, fit
from palpate.diagnosis.search.fit import Fit, settings_of
from palpate.diagnosis.search.leave_one_out import JudgedSet, held_out
from palpate.diagnosis.search.naming import WEIGHTS, Score
from palpate.diagnosis.search.whiten import Whitener
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.settings import ForwardSettings

REFIT_TURNS = 6


class Search:
    """Holds what all fits share: forward model, whitener, options, and caches of fits by names and by what
    was held out.

    starts: start vectors by effect that were sought in the data, in place of the effect's own.
    """

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
        self.forward, self.options, self.nuisance = forward, options, nuisance
        self.site_sd = np.full(len(forward.touches), nuisance.site_stiffness) if site_sd is None else site_sd
        whitener = self._whitener(forward.ideal(modulus))
        onset = first_touches(forward, whitener, modulus)
        rough = fit(forward, whitener, [finite_strain], modulus=modulus, onset=onset)
        self.finite_strain = finite_strain
        self.starts: dict[str, list[np.ndarray]] = {}
        self.renew(rough)

    @property
    def smallest_n(self) -> float:
        """N rms of a 3-vector: the smallest gap that matters."""
        return self.options.smallest * self.forward.touches.vector_noise_n

    def _whitener(self, settings: ForwardSettings) -> Whitener:
        slow = self.forward.touches.noise.variance_inflation
        return Whitener(self.forward, settings, self.nuisance, self.site_sd, slow=slow)

    def renew(self, found: Fit) -> None:
        """Weigh from now on with the nuisances as they are at a fit; earlier judgements are forgotten."""
        settings = settings_of(self.forward, found.effects, found.values, found.onset)
        self.whitener = self._whitener(settings)
        self.dof = 3.0 * float(self.whitener.counts().sum())
        self._near = found
        self._cache: dict[tuple[str, ...], JudgedSet] = {}
        self._refitted: dict[tuple[int, bytes], tuple[Fit, Fit]] = {}

    def reweighed(self, found: Fit) -> Search:
        """The same search, weighing with the nuisances as they are at a fit."""
        other = copy.copy(self)
        other.renew(found)
        return other

    def judge(self, effects: Sequence[Effect], like: JudgedSet | None = None) -> JudgedSet:
        """Fit a set and judge it on held-out groups; starts from `like`, or from what was last settled on."""
        key = tuple(sorted(e.name for e in effects))
        if key in self._cache:
            return self._cache[key]
        near = self._near if like is None else like.found
        starts = [np.array([near.values[0]])]
        for effect in effects:
            known = effect.name in near.names
            own = [near.of(effect.name)] if known else self.starts.get(effect.name) or effect.starts()
            starts = [np.concatenate([s, o]) for s in starts for o in own]
        starts = [np.append(s, near.shared) for s in starts]
        descent = Descent(self.forward, self.whitener, tuple(effects), None)
        scored = [descent.loss(s, descent.residual(s, near.onset), near.onset) for s in starts]
        runs = (descent.run(starts[i], near.onset, 12) for i in np.argsort(scored)[:3])
        found = min(runs, key=lambda f: f.loss)
        held, plain = held_out(found, descent)
        # the widths of a simulator's comparison are set by hand, so nothing is told by what exceeds them
        wide = self.whitener.place_chi(found.residual) if self.forward.measured else 1.0
        missed = self.whitener.misfit(found.residual)
        candidate = JudgedSet(found, held, plain, missed, self.dof, wide)
        self._cache[key] = candidate
        return candidate

    def without(self, found: Fit, fold: np.ndarray) -> Fit:
        """A fit again that has not seen the groups of `fold` (k,), numbers: a place's first touches are moved
        all the same. What was asked before is not fitted again."""
        key = id(found), fold.tobytes()
        if key not in self._refitted:
            weights = np.ones(self.whitener.groups)
            weights[fold] = 0.0
            descent = Descent(self.forward, self.whitener, found.effects, weights)
            # beside the fit, whose number another one could have once it is gone
            self._refitted[key] = found, descent.run(found.values, found.onset, REFIT_TURNS)
        return self._refitted[key][1]

    def score(self, added: Sequence[Effect], new: JudgedSet, old: JudgedSet) -> Score:
        """Compare a candidate with the one that lacks `added`."""
        extra = len(new.found.values) - len(old.found.values)
        between = all(e.scope.between_places for e in added)
        over = new.over_of(between_places=between)
        fitted = 0.5 * (old.found.gram[:, 0, 0] - new.found.gram[:, 0, 0])
        # predicted with what the other places alone would have added: a lump under one place is none
        predicted = (fitted.sum() - fitted) / over > extra
        per_group = np.where(predicted, old.held - new.held, 0.0)
        gain = float(per_group.sum())
        if between:
            # a few places hold the evidence: leaving them out leaves nothing, so the sample pays a price
            per_group = fitted
            gain = old.found.loss - new.found.loss - 0.5 * np.log(len(fitted)) * extra
        foretold = np.where(predicted, old.held - new.held, 0.0).sum()
        if all(e.hints.few_places for e in added):
            # most places know nothing of a lump; where it is, its force must be the one that is missing
            foretold = fitted.sum() if new.fitted_plain.sum() < old.fitted_plain.sum() else 0.0
        t = self.forward.touches
        before, after = old.residual[t.counted], new.residual[t.counted]
        size = float(np.sqrt(((after - before) ** 2).sum(axis=1).mean()))
        return Score(
            tuple(added), float(gain / over), size, size / t.force_rms_n, float(foretold / over),
            per_group / over, new, WEIGHTS.border_of(added[0].scope, measured=self.forward.measured),
        )  # fmt: skip

    def able(self, score: Score, *, first: bool = True) -> bool:
        """Whether a score's effect may be there at all. first: nothing else is named yet."""
        if score.effect.hints.by_first_touches and not first:
            return False
        return score.foretold > 0

    def passes(self, score: Score, *, first: bool = True) -> bool:
        """Whether a score names its effect."""
        return self.able(score, first=first) and score.probability > self.options.sure

    def sideways_off(self, candidate: JudgedSet) -> float:
        """Share by which the sideways force falls short of a fit's where that is large and felt; else 0.

        The nuisances trust the stick to a share only, press by press, so a fit may let that force go wrong.
        A tip that slips drags less than one that sticks, never more: more is a normal that is not the
        surface's.
        """
        t = self.forward.touches
        if not t.local_force[t.counted, 1:].any():
            return 0.0  # a machine of one axis reads none
        residual = candidate.residual[t.counted, 1:]
        predicted = t.local_force[t.counted, 1:] - residual
        size = np.linalg.norm(predicted, axis=1)
        short = np.clip(-(residual * predicted).sum(axis=1) / np.maximum(size, 1e-12), 0.0, None)
        # what the air may have done unseen is no slip
        known = 1 / (1 + self.whitener.air[t.counted] / t.noise_n**2)
        missed, force = (float(np.sqrt(np.average(x**2, weights=known))) for x in (short, size))
        # noise falls short half of the time; points without a time are not thinned
        missed = float(np.sqrt(max(missed**2 - 0.5 * t.noise_n**2, 0.0)))
        if missed < np.sqrt(2) * t.noise.raw_n or missed < self.nuisance.stick * force:
            return 0.0
        return missed / force
