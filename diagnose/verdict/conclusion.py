"""What judged cases of known truth correct: how sure a name is, and how wide an interval must be.

A name is as sure as those that were named alike were right. sureness.toml holds the counts of judged cases,
by the effect's role and by how it was named, with the seeds that they come from (`python -m
tools.diagnose_sureness`). What is not named is there less often than its score says, as something else
explained the gap better.

A fit's covariance knows noise and the sites' scatter; it does not know what the law, the surface and the
search's own choice leave. Conformal factors make up for that: of judged cases the distance of the truth from
the value, in half intervals, and of these the quantile that 95 % do not exceed (widening.toml, written by
`python -m tools.diagnose_widening`).

The whole answer of a diagnosis: verdict, gaps before and after, every effect tried, the next touch.
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Callable, Collection, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from palpate.diagnosis.search.fit import parameter_intervals
from palpate.diagnosis.search.gaps import beside_modulus_n, closed_share, closed_share_ci95, gap
from palpate.diagnosis.search.limits import detectable
from palpate.diagnosis.search.rivals import alike
from palpate.diagnosis.search.site_stiffness import repeat_scatter
from palpate.diagnosis.verdict.answer import Answer, Findings, answer_of, stated_gap
from palpate.diagnosis.verdict.held_out import Gaps, held_out_gaps, without_what_makes_it_worse
from palpate.diagnosis.verdict.next_touch import proposed
from palpate.diagnosis.verdict.result import Diagnosis, EffectEntry
from palpate.diagnosis.verdict.where import locate
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Role
from palpate.mechanics.effects.registry import effect

SURENESS_FILE = Path(__file__).with_name("sureness.toml")
WIDENING_FILE = Path(__file__).with_name("widening.toml")
ALONE, RIVALLED, REMAINDER, BOTH = "alone", "rivalled", "beside a remainder", "rivalled beside a remainder"
CANDIDATE, UNNAMED = "candidate", "not named"
PRIOR = 2.0
"""Cases that the share of all roles counts for, beside those of the effect's own."""


def how_named(name: str, named: Collection[str], candidates: Collection[str], kind: str) -> str:
    """How an effect is named in an answer of that kind, in words."""
    if name not in named:
        return CANDIDATE if name in candidates else UNNAMED
    if "unknown" in kind:
        return BOTH if candidates else REMAINDER
    return RIVALLED if candidates else ALONE


@cache
def counts() -> Mapping[str, Mapping[str, tuple[float, float]]]:
    """{how named: {role: (right, of)}}; of what is not named `of` is the sum of its scores' probabilities."""
    return {
        how: {role: (right, of) for role, (right, of) in each.items()}
        for how, each in tomllib.loads(SURENESS_FILE.read_text()).items()
    }


def sureness(name: str, how: str, scored: float = 1.0) -> float:
    """Probability that an effect is there which is named so. scored: by its own score, used where it is not
    named."""
    own = counts().get(how, {})
    pooled = [sum(c) for c in zip(*own.values(), strict=True)] or [0.0, 0.0]
    usual = (pooled[0] + 1) / (pooled[1] + 2)  # Laplace's rule of succession
    right, of = own.get(effect(name).role.name.lower(), (0.0, 0.0))
    share = (right + PRIOR * usual) / (of + PRIOR)
    return min(scored * share, 1.0) if how == UNNAMED else share


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
        candidates=tuple(dict.fromkeys(answer.candidates)),
        where=locate(
            forward, residual_before, findings.readings.free, findings.site_sd, stated_gap(findings, answer),
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
        free_air=findings.readings.free,
        residual_before=residual_before,
        residual_after=found.final.residual,
        findings=findings,
    )  # fmt: skip
    lap("verdict")
    return result


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


def entries_of(
    findings: Findings, answer: Answer, gaps: Gaps, counts: np.ndarray, rng: np.random.Generator
) -> tuple[EffectEntry, ...]:
    """The lines, what is named first, then the likeliest. counts: (g,) thinned contact samples."""
    forward, search, found = findings.forward, findings.search, findings.found
    offsets, strain = findings.instrument_offsets, search.finite_strain
    noise, added = findings.noise_n, forward.touches.thinned_away
    draws = max(100, findings.bootstrap // 4)
    limits = detectable(search, found.base, [score.effect for score, _ in found.scored.values()])

    def sure(name: str, scored: float = 1.0) -> float:
        return sureness(name, how_named(name, answer.names, answer.candidates, answer.kind), scored)

    def closed_by(plain: np.ndarray, draws: int) -> tuple[float | None, tuple[float, float] | None]:
        return closed_share_ci95(gaps.before, plain, counts, noise**2 - added, rng, draws)

    counted = forward.touches.counted
    plain = (forward.touches.local_force - found.base.residual)[counted]

    def felt(change: np.ndarray) -> float:
        return beside_modulus_n(change[counted], plain)

    entries = []
    for name, (score, p) in found.scored.items():
        own = score.effect
        alone = score.candidate
        if name not in found.scores:
            alone = search.judge([*found.base.found.effects, own], like=found.base)
        closed, interval = closed_by(alone.plain, draws)
        fitted = found.final.found if name in found.chosen else score.candidate.found
        entries.append(
            EffectEntry(
                name, own.domain, sure(name, score.probability), gap(alone.plain, counts, added),
                closed, interval, own.report(fitted.of(name), forward, fitted.modulus), score.gain,
                parameter_intervals(fitted, name, forward, search.dof, rng), p,
                limits.get(name, float("nan")), felt(alone.residual - found.base.residual),
            )
        )  # fmt: skip
    if found.finite_strain_gain > -search.options.beyond_doubt or strain.name in answer.names:
        left = gap(found.deep.plain, counts, added)
        closed, interval = closed_by(found.deep.plain, draws)
        entries.append(
            EffectEntry(
                strain.name, strain.domain, sure(strain.name), left, closed, interval, {},
                found.finite_strain_gain, size_n=felt(found.deep.residual - found.ideal.residual),
            )
        )  # fmt: skip
    for name in offsets.names:
        left = gap(found.ideal.plain, counts, added)
        closed, interval = closed_by(found.ideal.plain, OFFSET_DRAWS)
        entries.append(
            EffectEntry(
                name, effect(name).domain, sure(name), left, closed, interval, offsets.parameters[name],
                CERTAIN_GAIN, offsets.intervals[name],
            )
        )  # fmt: skip
    for rest in (effect(n) for n in answer.names if effect(n).role is Role.REST):
        left = gap(found.final.plain, counts, added)
        entries.append(EffectEntry(rest.name, rest.domain, sure(rest.name), left, 0.0, None, {}))
    entries = [dataclasses.replace(e, intervals=widened(e.name, e.parameters, e.intervals)) for e in entries]
    place = {n: i for i, n in enumerate(answer.names)}
    entries.sort(key=lambda e: (place.get(e.name, 99), -e.probability, -e.gain))
    return tuple(entries)
