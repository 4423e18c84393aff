"""The whole answer of a diagnosis: verdict, gaps before and after, every effect tried, the next touch.

An effect is as probable as all sets of causes that hold it are together. A fit's covariance knows noise and
the sites' scatter; it does not know what the law, the surface and the search's own choice leave. Conformal
factors make up for that: of judged cases the distance of the truth from the value, in half intervals, and of
these the quantile that 95 % do not exceed (widening.toml, by `python -m tools.diagnose_widening`).
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import expit

from palpate.diagnosis.search.fit import parameter_intervals
from palpate.diagnosis.search.gaps import beside_modulus_n, closed_share, closed_share_ci95, gap
from palpate.diagnosis.search.limits import detectable
from palpate.diagnosis.search.naming import WEIGHTS
from palpate.diagnosis.search.rivals import Explanation, alike, likeliest
from palpate.diagnosis.search.site_stiffness import repeat_scatter
from palpate.diagnosis.verdict.answer import Answer, Findings, answer_of, stated_gap
from palpate.diagnosis.verdict.held_out import Gaps, held_out_gaps, without_what_makes_it_worse
from palpate.diagnosis.verdict.next_touch import proposed
from palpate.diagnosis.verdict.result import Diagnosis, EffectEntry
from palpate.diagnosis.verdict.where import locate
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Role
from palpate.mechanics.effects.registry import effect

WIDENING_FILE = Path(__file__).with_name("widening.toml")


@cache
def factors() -> Mapping[str, float]:
    """{effect: factor}; "all": of effects that too few cases hold."""
    return dict(tomllib.loads(WIDENING_FILE.read_text())["factor"])


def widened(name: str, parameters: Mapping[str, Any], intervals: Mapping[str, Any]) -> dict[str, Any]:
    """{key: [low, high]} of an effect's parameters, about their values, within what their keys allow."""
    factor = factors().get(name, factors()["all"])
    keys = effect(name).keys or {}
    wider = {}
    for key, (low, high) in intervals.items():
        value = np.asarray(parameters[key], float)
        stated = keys.get(key)
        allowed = stated if isinstance(stated, FileKey) else FileKey()
        wider[key] = [
            np.clip(value + factor * (np.asarray(end, float) - value), allowed.low, allowed.high).tolist()
            for end in (low, high)
        ]
    return wider


CERTAIN_GAIN = 1e3
"""Log likelihood that stands for what was read off free air or the support."""
OFFSET_DRAWS = 100
READ = 0.95
"""Probability of what was read in free air or on the support: it was there in 62 of 65 judged cases (seeds
60000, 70000, 80000 and 110000 of the laboratory)."""


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
    closed, interval = closed_share_ci95(
        gaps.before, gaps.after, counts, noise**2 - added, rng, findings.bootstrap
    )
    if answer.names and interval is not None and interval[1] < 0:
        # resamples of the share may say what those of the growth left open: then nothing is named either
        answer.candidates[:0] = answer.names
        answer.names, answer.remainder, after_n = [], True, before_n
        answer.reasons.append("at held-out places the gap grows with the effects that would be named")
    if not answer.names:
        closed, interval = (0.0, (0.0, 0.0)) if before_n > noise else (None, None)
    answer.reasons += _with_all_places(findings, answer, gaps, counts, closed)
    residual_before = found.ideal.residual + findings.instrument_offsets.residual
    result = Diagnosis(
        noise_n=noise,
        gap_before_n=before_n,
        gap_after_n=after_n,
        gap_closed=closed,
        gap_closed_ci95=interval,
        kind=answer.kind,
        effects=tuple(answer.names),
        candidates=answer.rivals,
        where=locate(
            forward, residual_before, findings.readings.free, findings.site_sd, stated_gap(findings, answer),
            seed=findings.seed,
        ),
        entries=entries_of(findings, answer, gaps, counts),
        young_modulus_pa=found.final.found.modulus,
        next_touch=proposed(findings.search, found, answer.names, answer.rivals),
        errors_n=_errors(findings),
        reasons=tuple(answer.reasons),
        confusable=tuple(_alike(findings)),
        held_out_n=gaps.held,
        forward=forward,
        attribution=found,
        free_air=findings.readings.free,
        residual_before=residual_before,
        residual_after=found.final.residual,
        findings=findings,
        explanations=_explanations(findings, answer),
    )  # fmt: skip
    lap("verdict")
    return result


def _explanations(findings: Findings, answer: Answer) -> tuple[Explanation, ...]:
    """The smallest collection of sets that holds all but `doubt` of the posterior; what was named by other
    means (free air, depth, shape) is in each."""
    found, beside = findings.found, [n for n in answer.names if n not in findings.found.chosen]
    left = likeliest(found.explanations, 1 - findings.search.options.doubt)
    share = 1 - WEIGHTS.lapse
    return tuple(Explanation((*beside, *e.effects), share * e.probability) for e in left)


def _with_all_places(
    findings: Findings, answer: Answer, gaps: Gaps, counts: np.ndarray, closed: float | None
) -> list[str]:
    """What a lump closes where the places above it are in the fit, where that is more: to the other places
    it is unknown, so places left out say little of it."""
    lumps = [n for n in answer.names if effect(n).hints.few_places]
    if not lumps or closed is None:
        return []
    t, after = findings.forward.touches, findings.found.final.fitted_plain
    share = float(closed_share(gaps.before, after, counts, findings.noise_n**2 - t.thinned_away))
    if not share > closed:
        return []
    name = lumps[0].replace("_", " ")
    why = f"few of them lie above the {name}, and the others say nothing of it"
    return [f"fitted to all places it is {100 * share:.0f} %: {why}"]


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


def entries_of(findings: Findings, answer: Answer, gaps: Gaps, counts: np.ndarray) -> tuple[EffectEntry, ...]:
    """The lines, what is named first, then the likeliest. counts: (g,) thinned contact samples. Each effect
    has its own draws, so that another in the library moves no number."""
    forward, search, found = findings.forward, findings.search, findings.found
    offsets, strain = findings.instrument_offsets, search.finite_strain
    noise, added = findings.noise_n, forward.touches.thinned_away
    draws = max(100, findings.bootstrap // 4)
    limits = detectable(search, found.base, [score.effect for score in found.scored.values()])

    def sure(name: str) -> float:
        held = sum(e.probability for e in found.explanations if name in e.effects)
        return float((1 - WEIGHTS.lapse) * held)

    def drawn(name: str) -> np.random.Generator:
        return np.random.default_rng([findings.seed, *name.encode()])

    def closed_by(
        name: str, plain: np.ndarray, draws: int
    ) -> tuple[float | None, tuple[float, float] | None]:
        return closed_share_ci95(gaps.before, plain, counts, noise**2 - added, drawn(name), draws)

    counted = forward.touches.counted
    plain = (forward.touches.local_force - found.base.residual)[counted]

    def felt(change: np.ndarray) -> float:
        return beside_modulus_n(change[counted], plain)

    entries = []
    for name, score in found.scored.items():
        own = score.effect
        alone = score.candidate
        if name not in found.scores:
            alone = search.judge([*found.base.found.effects, own], like=found.base)
        closed, interval = closed_by(name, alone.plain, draws)
        fitted = found.final.found if name in found.chosen else score.candidate.found
        entries.append(
            EffectEntry(
                name, own.domain, sure(name), gap(alone.plain, counts, added),
                closed, interval, own.report(fitted.of(name), forward, fitted.modulus), score.gain,
                parameter_intervals(fitted, name, forward, search.dof, drawn(name)),
                limits.get(name, float("nan")), felt(alone.residual - found.base.residual),
            )
        )  # fmt: skip
    if found.finite_strain_gain > -search.options.beyond_doubt or strain.name in answer.names:
        left = gap(found.deep.plain, counts, added)
        there = (1 - WEIGHTS.lapse) * float(expit(found.finite_strain_gain))
        closed, interval = closed_by(strain.name, found.deep.plain, draws)
        entries.append(
            EffectEntry(
                strain.name, strain.domain, there, left, closed, interval,
                {},
                found.finite_strain_gain, size_n=felt(found.deep.residual - found.ideal.residual),
            )
        )  # fmt: skip
    for name in offsets.names:
        left = gap(found.ideal.plain, counts, added)
        closed, interval = closed_by(name, found.ideal.plain, OFFSET_DRAWS)
        entries.append(
            EffectEntry(
                name, effect(name).domain, READ, left, closed, interval, offsets.parameters[name],
                CERTAIN_GAIN, offsets.intervals[name],
            )
        )  # fmt: skip
    for rest in (effect(n) for n in answer.names if effect(n).role is Role.REST):
        left = gap(found.final.plain, counts, added)
        there = (1 - WEIGHTS.lapse) * float(expit(WEIGHTS.log_odds(answer.shape_gain, WEIGHTS.border)))
        entries.append(EffectEntry(rest.name, rest.domain, there, left, 0.0, None, {}))
    entries = [dataclasses.replace(e, intervals=widened(e.name, e.parameters, e.intervals)) for e in entries]
    place = {n: i for i, n in enumerate(answer.names)}
    entries.sort(key=lambda e: (place.get(e.name, 99), -e.probability, -e.gain))
    return tuple(entries)
