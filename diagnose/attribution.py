"""Which effect: every one is fitted, judged on sites that it has not seen, and combined where two are
needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnose.effects.base import Effect
from diagnose.fit import Fit, first_touches, fit, held_out, settings_of
from diagnose.forward import Forward
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

SLOW_STAGES = ("poisson", "unbonded", "springs")


@dataclass(frozen=True)
class AttributionOptions:
    """When an effect is named. Calibrated on recordings without any effect; see docs/diagnosis.md."""

    gain: float = option(150.0, "least gain in log likelihood over held-out sites that names an effect")
    spatial_gain: float = option(120.0, "the same for effects that live in a few places, penalised in sample")
    z: float = option(2.5, "least gain over its own standard error across sites")
    size_n: float = option(0.009, "least size of an effect: rms change of force after the refit", unit="N")
    toward: float = option(
        0.3, "least share of an effect's own size by which it lowers the plain gap in sample"
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
    def chi(self) -> float:
        """Whitened mean square per component: about 1 where the noise model holds."""
        return float(self.found.gram[:, 0, 0].sum() / self.dof)


@dataclass(frozen=True)
class Score:
    """How much better a candidate is than what it was added to.

    gain: log likelihood, deflated by its own lack of fit. z: gain over its standard error across sites.
    size_n: rms change of the predicted force, N. closes: plain held-out mean square it takes away, N^2.
    toward: plain mean square taken away in sample over size squared: 1 where the change meets the gap.
    """

    name: str
    gain: float
    z: float
    size_n: float
    closes: float
    toward: float
    per_group: np.ndarray
    candidate: Candidate


@dataclass(frozen=True)
class Attribution:
    """The search's outcome. base: what effects were added to (finite strain in it where the data prefer it).

    ideal: linear elasticity alone. chosen: names, strongest first. scores: of every single effect on the
    base.
    final: the chosen set. rivals: names not told apart from a chosen one. path: what each step looked like.
    """

    base: Candidate
    ideal: Candidate
    scores: dict[str, Score]
    chosen: tuple[str, ...]
    rivals: tuple[str, ...]
    final: Candidate
    steps: tuple[dict[str, Score], ...]
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
        settings = settings_of(forward, [finite_strain], rough.values, rough.onset)
        self.whitener = Whitener(forward, settings, nuisance, site_sd)
        self.dof = 3.0 * float(self.whitener.counts().sum())
        self._start = (rough.modulus, rough.onset)
        self._cache: dict[tuple[str, ...], Candidate] = {}
        self.finite_strain = finite_strain

    def judge(self, effects: Sequence[Effect], like: Candidate | None = None) -> Candidate:
        """Fit a set and judge it on held-out groups; starts from `like` where given."""
        key = tuple(sorted(e.name for e in effects))
        if key in self._cache:
            return self._cache[key]
        modulus, onset = self._start if like is None else (like.found.modulus, like.found.onset)
        start = None
        found: Fit | None = None
        if like is not None and len(effects) == len(like.found.effects) + 1:
            added = [e for e in effects if e.name not in like.found.names][0]
            order = [*like.found.effects, added]
            starts = [np.concatenate([like.found.values, own]) for own in added.starts(self.forward)]
            found = self._best(order, starts, modulus, onset)
        if found is None:
            found = fit(self.forward, self.whitener, effects, modulus=modulus, start=start, onset=onset)
        held, plain = held_out(found)
        candidate = Candidate(found, held, plain, self.dof)
        self._cache[key] = candidate
        return candidate

    def _best(self, order: list[Effect], starts: list[np.ndarray], modulus: float, onset: np.ndarray) -> Fit:
        from diagnose.fit import _Descent

        descent = _Descent(self.forward, self.whitener, tuple(order), None)
        if len(starts) > 3:
            scored = [descent.loss(s, descent.residual(s, onset), onset) for s in starts]
            starts = [starts[i] for i in np.argsort(scored)[:3]]
        return min((descent.run(s, onset, 12) for s in starts), key=lambda f: f.loss)

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
        change = (new.found.residual - old.found.residual)[counted]
        size = float(np.sqrt((change**2).sum(axis=1).mean()))
        closes = float((old.plain.sum() - new.plain.sum()) / counted.sum())
        squares = [(c.found.residual[counted] ** 2).sum(axis=1).mean() for c in (old, new)]
        toward = float((squares[0] - squares[1]) / max(size**2, 1e-12))
        return Score(name, float(gain / over), float(z), size, closes, toward, per_group / over, new)

    def passes(self, score: Score) -> bool:
        """Whether a score names its effect."""
        o = self.options
        if score.size_n < o.size_n:
            return False
        if score.name in SPATIAL:
            held = score.closes > 0 or (score.name == "inclusion" and score.closes > -0.3 * score.size_n**2)
            return score.gain > o.spatial_gain and score.toward > o.toward and held
        return score.gain > o.gain and score.z > o.z and score.closes > 0 and score.toward > o.toward


def attribute(search: Search, effects: Sequence[Effect], *, progress: Progress = silent) -> Attribution:
    """Forward selection with backward check; rivals of the first choice are declared."""
    fs = search.finite_strain
    ideal = search.judge([])
    deep = search.judge([fs])
    finite_strain_gain = float(ideal.found.loss - deep.found.loss)
    base = deep if finite_strain_gain > 0 else ideal
    library = [e for e in effects if e.name not in ("finite_strain", "surface_shape")]
    current, chosen = base, []
    steps: list[dict[str, Score]] = []
    for step in range(search.options.most):
        scores: dict[str, Score] = {}
        for i, effect in enumerate(library):
            if effect.name in current.found.names:
                continue
            progress(f"effect {step + 1}: {effect.name}", (step + i / len(library)) / search.options.most)
            candidate = search.judge([*current.found.effects, effect], like=current)
            scores[effect.name] = search.score(effect.name, candidate, current)
        steps.append(scores)
        passing = [s for s in scores.values() if search.passes(s)]
        if not passing:
            break
        best = max(passing, key=lambda s: s.gain)
        chosen.append(best.name)
        current = best.candidate
    chosen, current = _without_idle(search, base, chosen, current, library)
    rivals = _rivals(search, steps, chosen)
    order = _strongest_first(search, current, chosen)
    return Attribution(base, ideal, steps[0], tuple(order), rivals, current, tuple(steps), finite_strain_gain)


def _without_idle(search: Search, base: Candidate, chosen: list[str], current: Candidate, library):  # type: ignore[no-untyped-def]
    """Drop effects that later ones made idle."""
    for name in list(chosen):
        if len(chosen) < 2:
            break
        rest = [e for e in current.found.effects if e.name != name]
        without = search.judge(rest)
        if not search.passes(search.score(name, current, without)):
            chosen.remove(name)
            current = without
    return chosen, current


def _rivals(search: Search, steps: list[dict[str, Score]], chosen: list[str]) -> tuple[str, ...]:
    """Effects whose single gain comes so close to the first choice's that the sites do not tell them
    apart."""
    if not chosen or not steps:
        return ()
    first = steps[0][chosen[0]] if chosen[0] in steps[0] else None
    if first is None:
        return ()
    found = []
    for score in steps[0].values():
        if score.name in chosen or score.gain <= 0.3 * search.options.gain:
            continue
        if score.toward < search.options.toward or (score.closes < 0 and score.name != "inclusion"):
            continue
        behind = first.gain - score.gain
        difference = first.per_group - score.per_group
        spread = difference.std() * np.sqrt(len(difference))
        if (
            behind < max(search.options.rival_share * first.gain, 1.0 * spread, 25.0)
            and behind < 0.5 * first.gain
        ):
            found.append((behind, score.name))
    return tuple(name for _, name in sorted(found))


def _strongest_first(search: Search, final: Candidate, chosen: list[str]) -> list[str]:
    if len(chosen) < 2:
        return list(chosen)
    loss = {}
    for name in chosen:
        rest = [e for e in final.found.effects if e.name != name]
        loss[name] = search.judge(rest).found.loss
    return sorted(chosen, key=lambda n: -loss[n])
