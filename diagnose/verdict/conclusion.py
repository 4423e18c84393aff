"""The whole answer of a diagnosis: verdict, gaps before and after, every effect tried, the next touch."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from diagnose.search.attribution import Attribution
from diagnose.search.detectable import detectable
from diagnose.search.evidence import Score, Search
from diagnose.search.gaps import closed_share, gap
from diagnose.search.intervals import parameter_intervals
from diagnose.search.shape import repeat_scatter
from diagnose.verdict.answer import Answer, Evidence, answer_of
from diagnose.verdict.confusable import alike
from diagnose.verdict.held_out import held_out_by_refit
from diagnose.verdict.never_worse import never_worse
from diagnose.verdict.next_touch import next_touch
from diagnose.verdict.result import Diagnosis, EffectEntry, NextTouch
from diagnose.verdict.stated import stated_gap
from diagnose.verdict.sureness import standing, sureness
from diagnose.verdict.where import locate
from diagnose.verdict.widening import widened
from mechanics.effects.base import Role
from mechanics.effects.registry import effect


@dataclass(frozen=True)
class Gaps:
    """Held-out plain sums of squares (g,) N^2 before and after. held: N, of deepest and fastest places."""

    before: np.ndarray
    after: np.ndarray
    held: dict[str, tuple[float, float]]


def conclude(evidence: Evidence, lap: Callable[[str], None]) -> Diagnosis:
    """The answer to where, which and how far. lap(name) is called where a timed part ends."""
    found, forward = evidence.found, evidence.forward
    counts, noise, added = (
        evidence.search.whitener.counts(),
        evidence.noise_n,
        evidence.forward.touches.thinned_away,
    )
    rng = np.random.default_rng(evidence.seed)
    gaps = _gaps(evidence)
    lap("held out")
    answer = answer_of(evidence, counts)
    gaps = dataclasses.replace(gaps, after=_never_worse(evidence, answer, gaps, counts))
    before_n = gap(gaps.before, counts, added)
    after_n = gap(gaps.after, counts, added) if answer.names else before_n
    closed, interval = closed_share(gaps.before, gaps.after, counts, noise, added, rng, evidence.bootstrap)
    if answer.names and interval is not None and interval[1] < 0:
        # resamples of the share may say what those of the growth left open: then nothing is named either
        answer.candidates[:0] = answer.names
        answer.names, answer.remainder, after_n = [], True, before_n
        answer.reasons.append("the gap grows with what would be named on places that were not fitted")
    if not answer.names:
        closed, interval = (0.0, (0.0, 0.0)) if before_n > noise else (None, None)
    residual_before = found.ideal.residual + evidence.instrument_offsets.residual
    result = Diagnosis(
        noise_n=noise,
        gap_before_n=before_n,
        gap_after_n=after_n,
        gap_closed=closed,
        gap_closed_ci95=interval,
        kind=answer.kind,
        effects=tuple(answer.names),
        candidates=tuple(dict.fromkeys(answer.candidates)),
        where=locate(
            forward, residual_before, evidence.free, evidence.site_sd, stated_gap(evidence, answer),
            seed=evidence.seed,
        ),
        entries=_entries(evidence, answer, gaps, counts, rng),
        young_modulus_pa=found.final.found.modulus,
        next_touch=_next(evidence.search, found, answer.candidates),
        errors_n=_errors(evidence),
        reasons=tuple(answer.reasons),
        confusable=tuple(_alike(evidence)),
        held_out_n=gaps.held,
        forward=forward,
        attribution=found,
        free_air=evidence.free,
        residual_before=residual_before,
        residual_after=found.final.residual,
    )  # fmt: skip
    lap("verdict")
    return result


def _gaps(evidence: Evidence) -> Gaps:
    search, found, offsets = evidence.search, evidence.found, evidence.instrument_offsets
    if not evidence.refit:
        return Gaps(found.ideal.plain + offsets.plain(search.whitener, found.ideal), found.final.plain, {})
    added = evidence.forward.touches.thinned_away
    old = held_out_by_refit(search, found.ideal.found, offsets.residual, added)
    new = held_out_by_refit(search, found.final.found, None, added)
    held = {"deepest": (old.deepest_n, new.deepest_n), "fastest": (old.fastest_n, new.fastest_n)}
    return Gaps(old.plain, new.plain, held)


def _never_worse(evidence: Evidence, answer: Answer, gaps: Gaps, counts: np.ndarray) -> np.ndarray:
    """(g,) N^2, held out with what may be named; what makes the gap grow goes to the answer's candidates."""
    search, offsets = evidence.search, evidence.instrument_offsets
    whitener = search.whitener
    final, base = evidence.found.final.found, evidence.found.base.found.names
    added = evidence.forward.touches.thinned_away

    def after(names: tuple[str, ...]) -> np.ndarray:
        if names == tuple(answer.names):
            return gaps.after
        fitted = search.judge([e for e in final.effects if e.name in (*names, *base)])
        put_back = None if set(offsets.names) <= set(names) else offsets.residual
        if evidence.refit:
            return held_out_by_refit(search, fitted.found, put_back, added).plain
        return fitted.plain if put_back is None else fitted.plain + offsets.plain(whitener, fitted)

    kept = never_worse(answer.names, gaps.before, after, counts, whitener.explained, seed=evidence.seed)
    if kept.dropped:
        answer.names = list(kept.names)
        # where noise, first touch and shape explain what is left there is nothing that it might be
        answer.candidates += kept.dropped if kept.unexplained else ()
        answer.remainder |= kept.unexplained
        dropped = " and ".join(n.replace("_", " ") for n in kept.dropped)
        answer.reasons.append(
            f"{dropped}: the gap grows with it on places that were not fitted, so it is not named"
        )
    return kept.after


def _entries(
    evidence: Evidence,
    answer: Answer,
    gaps: Gaps,
    counts: np.ndarray,
    rng: np.random.Generator,
) -> tuple[EffectEntry, ...]:
    forward, search, found = evidence.forward, evidence.search, evidence.found
    offsets = evidence.instrument_offsets
    noise, added = evidence.noise_n, evidence.forward.touches.thinned_away
    draws = max(100, evidence.bootstrap // 4)
    limits = detectable(search, found.base, [s.effect for s in found.scores.values()])
    entries = []

    def sure(name: str, scored: float = 1.0) -> float:
        return sureness(name, standing(name, answer.names, answer.candidates, answer.kind), scored)

    for name, score in found.scores.items():
        own = score.effect
        closed, interval = closed_share(gaps.before, score.candidate.plain, counts, noise, added, rng, draws)
        fitted = found.final.found if name in found.chosen else score.candidate.found
        entries.append(
            EffectEntry(
                name,
                own.domain,
                sure(name, score.probability),
                gap(score.candidate.plain, counts, added),
                closed,
                interval,
                own.report(fitted.of(name), forward, fitted.modulus),
                score.gain,
                parameter_intervals(fitted, name, forward, search.dof, rng),
                found.standing[name],
                limits.get(name, float("nan")),
            )
        )
    strain = search.finite_strain
    if found.finite_strain_gain > -search.options.beyond_doubt or strain.name in answer.names:
        deep = found.deep
        closed, interval = closed_share(gaps.before, deep.plain, counts, noise, added, rng, draws)
        entries.append(
            EffectEntry(
                strain.name, strain.domain, sure(strain.name), gap(deep.plain, counts, added), closed,
                interval, {}, found.finite_strain_gain,
            )
        )  # fmt: skip
    entries += offsets.entries(gaps.before, found.ideal, counts, noise, added, rng, sure)
    for rest in (effect(n) for n in answer.names if effect(n).role is Role.REST):
        left = gap(found.final.plain, counts, added)
        entries.append(EffectEntry(rest.name, rest.domain, sure(rest.name), left, 0.0, None, {}))
    entries = [dataclasses.replace(e, intervals=widened(e.name, e.parameters, e.intervals)) for e in entries]
    place = {n: i for i, n in enumerate(answer.names)}
    entries.sort(key=lambda e: (place.get(e.name, 99), -e.probability, -e.gain))
    return tuple(entries)


def _errors(evidence: Evidence) -> dict[str, float]:
    """Our own errors in newtons rms: sensor noise, repeatability of sites, shape, and the rest of the
    model."""
    t = evidence.forward.touches
    residual = evidence.found.final.residual
    return {
        "sensor": evidence.noise_n,
        "repeatability": repeat_scatter(residual, t),
        "shape": float(np.sqrt(np.mean(evidence.site_sd**2)) * t.force_rms_n),
        "model": float(np.sqrt(max((residual[t.counted] ** 2).sum(axis=1).mean() - 3 * t.noise_n**2, 0))),
    }


def _alike(evidence: Evidence) -> list[tuple[str, str, float]]:
    """Confusable pairs among the effects that gain anything to speak of."""
    found = evidence.found
    least = 0.1 * max((s.gain for s in found.scores.values()), default=0.0)
    strong = {n: s.candidate for n, s in found.scores.items() if s.gain > least}
    return alike(evidence.search, found.base, strong)


def _next(search: Search, found: Attribution, candidates: list[str]) -> NextTouch | None:
    """The press that parts the two explanations that stand closest."""
    for scores, name in zip(found.steps, found.picked, strict=False):
        rival = next((c for c in candidates if c in scores and c != name), None)
        if rival is not None:
            return _parting(search, scores, name, rival)
    ranked = sorted(found.scores.values(), key=lambda s: -s.gain)
    if len(ranked) < 2:
        return None
    first = found.picked[0] if found.picked else ranked[0].name
    second = next(s.name for s in ranked if s.name != first)
    return _parting(search, found.scores, first, second)


def _parting(search: Search, scores: dict[str, Score], first: str, second: str) -> NextTouch | None:
    pair = ((first, scores[first].candidate), (second, scores[second].candidate))
    return next_touch(search.forward, *pair, search.nuisance)
