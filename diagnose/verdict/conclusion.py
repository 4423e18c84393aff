"""The whole answer of a diagnosis: verdict, gaps before and after, every effect tried, the next touch."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from diagnose.search.gaps import closed_share, gap
from diagnose.search.rivals import alike
from diagnose.search.shape import repeat_scatter
from diagnose.verdict.answer import Findings, answer_of, stated_gap
from diagnose.verdict.entries import entries_of
from diagnose.verdict.held_out import held_out_gaps, without_what_makes_it_worse
from diagnose.verdict.next_touch import proposed
from diagnose.verdict.result import Diagnosis
from diagnose.verdict.where import locate


def conclude(findings: Findings, lap: Callable[[str], None]) -> Diagnosis:
    """The answer to where, which and how far. lap(name) is called where a timed part ends."""
    found, forward = findings.found, findings.forward
    counts, noise, added = findings.search.whitener.counts(), findings.noise_n, forward.touches.thinned_away
    rng = np.random.default_rng(findings.seed)
    gaps = held_out_gaps(findings)
    lap("held out")
    answer = answer_of(findings, counts)
    gaps = dataclasses.replace(gaps, after=without_what_makes_it_worse(findings, answer, gaps, counts))
    before_n = gap(gaps.before, counts, added)
    after_n = gap(gaps.after, counts, added) if answer.names else before_n
    closed, interval = closed_share(gaps.before, gaps.after, counts, noise, added, rng, findings.bootstrap)
    if answer.names and interval is not None and interval[1] < 0:
        # resamples of the share may say what those of the growth left open: then nothing is named either
        answer.candidates[:0] = answer.names
        answer.names, answer.remainder, after_n = [], True, before_n
        answer.reasons.append("the gap grows with what would be named on places that were not fitted")
    if not answer.names:
        closed, interval = (0.0, (0.0, 0.0)) if before_n > noise else (None, None)
    residual_before = found.ideal.residual + findings.instrument_offsets.residual
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
            forward, residual_before, findings.free, findings.site_sd, stated_gap(findings, answer),
            seed=findings.seed,
        ),
        entries=entries_of(findings, answer, gaps, counts, rng),
        young_modulus_pa=found.final.found.modulus,
        next_touch=proposed(findings.search, found, answer.candidates),
        errors_n=_errors(findings),
        reasons=tuple(answer.reasons),
        confusable=tuple(_alike(findings)),
        held_out_n=gaps.held,
        forward=forward,
        attribution=found,
        free_air=findings.free,
        residual_before=residual_before,
        residual_after=found.final.residual,
        findings=findings,
    )  # fmt: skip
    lap("verdict")
    return result


def _errors(findings: Findings) -> dict[str, float]:
    """Our own errors in newtons rms: sensor noise, repeatability of sites, shape, and the rest of the
    model."""
    t = findings.forward.touches
    residual = findings.found.final.residual
    return {
        "sensor": findings.noise_n,
        "repeatability": repeat_scatter(residual, t),
        "shape": float(np.sqrt(np.mean(findings.site_sd**2)) * t.force_rms_n),
        "model": float(np.sqrt(max((residual[t.counted] ** 2).sum(axis=1).mean() - 3 * t.noise_n**2, 0))),
    }


def _alike(findings: Findings) -> list[tuple[str, str, float]]:
    """Confusable pairs among the effects that gain anything to speak of."""
    found = findings.found
    least = 0.1 * max((s.gain for s in found.scores.values()), default=0.0)
    strong = {n: s.candidate for n, s in found.scores.items() if s.gain > least}
    return alike(findings.search, found.base, strong)
