"""Every effect's line in the answer: its probability, the held-out gap with it alone, and its parameters."""

from __future__ import annotations

import dataclasses

import numpy as np

from diagnose.search.detectable import detectable
from diagnose.search.gaps import closed_share, gap
from diagnose.search.intervals import parameter_intervals
from diagnose.verdict.answer import Answer, Findings
from diagnose.verdict.corrections import how_named, sureness, widened
from diagnose.verdict.held_out import Gaps
from diagnose.verdict.result import EffectEntry
from mechanics.effects.base import Role
from mechanics.effects.registry import effect

CERTAIN_GAIN = 1e3
"""Log likelihood that stands for what was read off free air or the support."""
OFFSET_DRAWS = 100


def entries_of(
    findings: Findings, answer: Answer, gaps: Gaps, counts: np.ndarray, rng: np.random.Generator
) -> tuple[EffectEntry, ...]:
    """The lines, what is named first, then the likeliest. counts: (g,) thinned contact samples."""
    forward, search, found = findings.forward, findings.search, findings.found
    offsets, strain = findings.instrument_offsets, search.finite_strain
    noise, added = findings.noise_n, forward.touches.thinned_away
    draws = max(100, findings.bootstrap // 4)
    limits = detectable(search, found.base, [s.effect for s in found.scores.values()])

    def sure(name: str, scored: float = 1.0) -> float:
        return sureness(name, how_named(name, answer.names, answer.candidates, answer.kind), scored)

    def closed_by(plain: np.ndarray, draws: int) -> tuple[float | None, tuple[float, float] | None]:
        return closed_share(gaps.before, plain, counts, noise, added, rng, draws)

    entries = []
    for name, score in found.scores.items():
        own = score.effect
        closed, interval = closed_by(score.candidate.plain, draws)
        fitted = found.final.found if name in found.chosen else score.candidate.found
        entries.append(
            EffectEntry(
                name, own.domain, sure(name, score.probability), gap(score.candidate.plain, counts, added),
                closed, interval, own.report(fitted.of(name), forward, fitted.modulus), score.gain,
                parameter_intervals(fitted, name, forward, search.dof, rng), found.confidence_set_p[name],
                limits.get(name, float("nan")),
            )
        )  # fmt: skip
    if found.finite_strain_gain > -search.options.beyond_doubt or strain.name in answer.names:
        left = gap(found.deep.plain, counts, added)
        closed, interval = closed_by(found.deep.plain, draws)
        entries.append(
            EffectEntry(
                strain.name, strain.domain, sure(strain.name), left, closed, interval, {},
                found.finite_strain_gain,
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
