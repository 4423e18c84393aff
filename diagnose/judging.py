"""Weighing: a set of effects fitted, judged on sites that it has not seen, and scored against another set."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnose.first_touch import first_touches
from diagnose.fit import Descent, Fit, fit, settings_of
from diagnose.forward import Forward
from diagnose.leave_one_out import held_out, levelled
from diagnose.shape import repeat_scatter
from diagnose.whiten import NuisanceOptions, Whitener
from mechanics.effects.base import Effect, Scope
from mechanics.options import option

STEADY_Z = 2.0
"""What every site feels, and any further effect that differs from place to place, gains by this many standard
errors across sites: one site alone that a wrong surface bends cannot speak for them."""

SURE_Z = 3.0
"""What every site feels is named on a small gain only if so many standard errors of the sites agree ..."""

CLOSING_GAIN, CLOSING_SHARE = 50.0, 0.5
"""... or if the gain is not that small and half of the gap closes on held-out sites."""

FELT, PLENTY = 0.7, 150.0
"""What every site feels must change the force by this share of the noise (of the 3-vector), unless the
evidence is plenty: a surface that is off everywhere by the same little bends all presses alike, by little."""

ANEW = 0.8
"""A fit from unmoved first touches replaces the usual one where its loss is this much less."""


@dataclass(frozen=True)
class AttributionOptions:
    """When an effect is named. Calibrated on recordings without any effect; see docs/diagnosis.md."""

    gain: float = option(120.0, "least gain in log likelihood over held-out sites that names an effect")
    spatial_gain: float = option(
        75.0, "the same for effects that differ from site to site, penalised in sample"
    )
    lump_gain: float = option(120.0, "the same for an inclusion, which lives in a few places")
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

    def chi_but_for_one(self, counts: np.ndarray) -> tuple[float, int]:
        """(chi without the site that misses most, that site); counts: (g,) samples of each site."""
        each = self.found.gram[:, 0, 0]
        worst = int(np.argmax(each / counts))
        return float((each.sum() - each[worst]) / (3.0 * (counts.sum() - counts[worst]))), worst


@dataclass(frozen=True)
class Score:
    """How much better a candidate is than what it was added to.

    added: the effects in which the two differ. gain: log likelihood, deflated by its own lack of fit. z: gain
    over its standard error across sites.
    per_group: (g,) the gain of each site, deflated likewise.
    size_n: rms change of the predicted force, N. share: of the old held-out excess over the noise.
    toward: plain mean square taken away in sample over size squared: 1 where the change meets the gap.
    scatter_n: N rms by which repeats at one place still differ.
    """

    added: tuple[Effect, ...]
    gain: float
    z: float
    size_n: float
    share: float
    toward: float
    per_group: np.ndarray
    candidate: Candidate
    scatter_n: float = 0.0

    @property
    def effect(self) -> Effect:
        """The effect that is scored; the first of a pair."""
        return self.added[0]

    @property
    def name(self) -> str:
        """Its name; of a pair both."""
        return "+".join(e.name for e in self.added)

    @property
    def evidence(self) -> float:
        """The gain that counts: without the site that gains most, as one place that slipped, or whose surface
        is wrong, speaks for whatever bends it; a lump lives in few places, so there all of it."""
        return self.gain if self.effect.few_places else self.gain - max(float(self.per_group.max()), 0.0)


class Search:
    """Holds what all fits share: forward model, whitener, options, and a cache of fits by names.

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
        self.forward, self.options, self.nuisance, self.site_sd = forward, options, nuisance, site_sd
        whitener = Whitener(forward, forward.ideal(modulus), nuisance, site_sd)
        onset = first_touches(forward, whitener, modulus)
        rough = fit(forward, whitener, [finite_strain], modulus=modulus, onset=onset)
        self.finite_strain = finite_strain
        self.starts: dict[str, list[np.ndarray]] = {}
        self.felt_n = FELT * forward.touches.vector_noise_n
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
            known = effect.name in near.names
            own = [near.of(effect.name)] if known else self.starts.get(effect.name) or effect.starts()
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

    def score(self, added: Sequence[Effect], new: Candidate, old: Candidate) -> Score:
        """Compare a candidate with the one that lacks `added`."""
        extra = len(new.found.values) - len(old.found.values)
        over = max(1.0, new.chi) * self.forward.touches.noise.variance_inflation
        per_group = old.held - new.held
        gain = float(per_group.sum())
        if all(e.scope.between_places for e in added):
            # a few places hold the evidence: leaving them out leaves nothing, so the sample pays a price
            per_group = 0.5 * (old.found.gram[:, 0, 0] - new.found.gram[:, 0, 0])
            gain = old.found.loss - new.found.loss - 4.0 * extra
        z = per_group.sum() / (per_group.std() * np.sqrt(len(per_group)) + 1e-9)
        counted = self.forward.touches.counted
        before, after = old.residual[counted], new.residual[counted]
        size = float(np.sqrt(((after - before) ** 2).sum(axis=1).mean()))
        squares = [(r**2).sum(axis=1).mean() for r in (before, after)]
        toward = float((squares[0] - squares[1]) / max(size**2, 1e-12))
        noise = 3 * self.forward.touches.noise_n**2
        excess = max(float(old.plain.sum() / counted.sum()) - noise, 0.02 * noise)
        share = float((old.plain.sum() - new.plain.sum()) / counted.sum()) / excess
        scatter = np.nan_to_num(repeat_scatter(new.residual, self.forward.touches))
        return Score(
            tuple(added), float(gain / over), float(z), size, share, toward, per_group / over, new,
            scatter,
        )  # fmt: skip

    def passes(self, score: Score, *, first: bool = True) -> bool:
        """Whether a score names its effect; one beside another must close a fair share of what is left."""
        o, effect = self.options, score.effect
        everywhere, between = effect.scope is Scope.EVERYWHERE, effect.scope.between_places
        if score.size_n < o.size_n:
            return False
        if effect.only_first and not first:
            return False
        if effect.few_places:
            return score.evidence > o.lump_gain and score.share > -0.3 and score.toward > o.toward
        if everywhere:
            unfelt = score.size_n < self.felt_n and score.evidence < PLENTY
            if score.z < STEADY_Z or unfelt:
                return False
        if not first and between and score.z < STEADY_Z:
            # one place that a law misses by far must not name a second effect
            return False
        if first and score.evidence > o.strong_gain * max(1.0, score.candidate.chi) and score.z > o.z:
            return True
        if score.share < (o.first_share if first else o.further_share) or score.toward < o.toward:
            return False
        closing = score.evidence > CLOSING_GAIN and score.share > CLOSING_SHARE
        steady = SURE_Z if everywhere and not closing else STEADY_Z
        if score.evidence > o.plain_gain and score.share > o.plain_share and score.z > steady:
            # repeats of one place that differ by more than the effect changes may be all that it fits
            if not between or score.size_n > score.scatter_n:
                return True
        if between:
            return score.evidence > o.spatial_gain
        return score.evidence > o.gain and score.z > o.z


SIDEWAYS_SHARE = 0.3
"""Sideways misfit, of the predicted sideways force, from which sticking is in doubt (13 % where it holds)."""


def sideways_off(forward: Forward, candidate: Candidate) -> float:
    """Share by which a fit misses the sideways force where that is large and felt; else 0.

    The nuisances trust the stick to a quarter only, press by press, so a fit may let that force go wrong.
    """
    t = forward.touches
    if not t.local_force[t.counted, 1:].any():
        return 0.0  # a machine of one axis reads none
    residual = candidate.residual[t.counted, 1:]
    predicted = t.local_force[t.counted, 1:] - residual
    missed, force = (float(np.sqrt((x**2).sum(axis=1).mean())) for x in (residual, predicted))
    # points without a time are not thinned: their noise is none of the miss
    missed = float(np.sqrt(max(missed**2 - 2 * t.noise_n**2, 0.0)))
    if missed < np.sqrt(2) * t.noise.raw_n or missed < SIDEWAYS_SHARE * force:
        return 0.0
    return missed / force
