"""From a recording, its model and another simulator's forces to where, why and how far these are off."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from palpate.diagnosis.numerics.registry import NAMES, numerical
from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from palpate.diagnosis.other_simulator.against_law import Numerics
from palpate.diagnosis.other_simulator.declared_parameters import Stated
from palpate.diagnosis.other_simulator.forces import Forces, ForcesOptions, aligned
from palpate.diagnosis.other_simulator.gap_decomposition import (
    PARAMETER_OF,
    GapSums,
    Reality,
    StatedParameter,
    law_at,
    measured_parameters,
    reality_of,
    sizes_alone,
    wrong_parameters,
)
from palpate.diagnosis.other_simulator.own_flaws import Own, made_up, own_of, with_same_presses
from palpate.diagnosis.other_simulator.paired_presses import Sides, named_numerics, pair_forces
from palpate.diagnosis.other_simulator.result import GapPart, SimulatedGap, Simulator, advice_of
from palpate.diagnosis.pipeline import diagnose
from palpate.diagnosis.search.gaps import closed_share_ci95
from palpate.diagnosis.search.rivals import Explanation, joint, likeliest, names_of
from palpate.diagnosis.verdict.answer import Answer, Findings
from palpate.diagnosis.verdict.result import Diagnosis, EffectEntry
from palpate.diagnosis.verdict.where import locate
from palpate.mechanics.errors import DiagnosisError
from palpate.mechanics.model.model import Model
from palpate.mechanics.one_thread import one_thread
from palpate.mechanics.progress import Progress, part, silent
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.presses_on_model import presses_on

OWN_MODULUS = "stated_modulus"
LIKELIER = 0.5
"""Probability that what is named has more of."""


@dataclasses.dataclass(frozen=True)
class Asked:
    """What is asked of a simulation: its forces, what it was given, how the file is meant; of one run here
    its version, advice by numerical effect, settings in words, and greatest Poisson's ratio; base: the same
    simulator's forces at its best settings along the same path, given the same."""

    forces: Forces
    stated: Stated
    options: ForcesOptions = dataclasses.field(default_factory=ForcesOptions)
    version: str = ""
    advice: dict[str, str] = dataclasses.field(default_factory=dict)
    run_as: str = ""
    poisson_limit: float = math.inf
    base: Forces | None = None


@one_thread
def diagnose_simulated(
    recording: Recording,
    model: Model,
    asked: Asked,
    options: DiagnoseOptions | None = None,
    progress: Progress = silent,
    *,
    nuisance: NuisanceOptions | None = None,
    attribution: AttributionOptions | None = None,
    reality: Diagnosis | None = None,
) -> SimulatedGap:
    """Diagnose the gap between a recording and another simulator's forces along its path.

    reality: of the same recording and model, where it is known already. Raises OptionError where it is not
    plain what the forces mean, DiagnosisError where the data cannot carry it.
    """
    options = options or DiagnoseOptions()
    rules = attribution or AttributionOptions()
    progress("forces", 0.0)
    presses = presses_on(recording, model)
    if presses.quasi_static:
        raise DiagnosisError("points without a time are not a path that a simulator can follow")
    level = asked.stated.young_modulus_pa / model.material.young_modulus_pa
    given = aligned(asked.forces, presses, asked.options, level)
    if reality is None:
        reality = diagnose(
            recording, model, options, part(progress, 0.0, 0.6), nuisance=nuisance, attribution=attribution
        )
    findings: Findings = reality.findings
    own = None
    if asked.base is not None:
        best = aligned(asked.base, presses, asked.options, level)
        given, best = with_same_presses(given, best)
        own = own_of(pair_forces(best, findings, asked.stated), rules, part(progress, 0.6, 0.75))
    sides = pair_forces(given, findings, asked.stated)
    numerics = named_numerics(sides, rules, part(progress, 0.75, 0.95), own)
    result = _concluded(_weighed(asked, options, rules, reality, sides, numerics, own))
    progress("done", 1.0)
    return result


@dataclasses.dataclass(frozen=True)
class _Weighed:
    """What an answer is made of. gaps: (n, 3) N, local, as the parts are taken off, by name.
    least_n: N, what is said of a force at least."""

    asked: Asked
    seed: int
    resamples: int
    doubt: float
    reality: Diagnosis
    sides: Sides
    numerics: Numerics
    real: Reality
    wrong: list[StatedParameter]
    measured: Stated
    weighing: GapSums
    gaps: dict[str, np.ndarray]
    least_n: float
    own: Own | None

    @property
    def open_names(self) -> tuple[str, ...]:
        """Effects of the object that are as likely not there: they are candidates, as in a diagnosis."""
        likely = {e.name: e.probability for e in self.reality.entries}
        return tuple(name for name in self.real.names if likely[name] <= LIKELIER)

    @property
    def real_names(self) -> tuple[str, ...]:
        """Effects of the object that are named."""
        return tuple(name for name in self.real.names if name not in self.open_names)

    def square(self, name: str) -> float:
        """N^2, the mean square of a gap."""
        return self.weighing.gap_n(self.gaps[name]) ** 2


def _weighed(
    asked: Asked,
    options: DiagnoseOptions,
    rules: AttributionOptions,
    reality: Diagnosis,
    sides: Sides,
    numerics: Numerics,
    own: Own | None,
) -> _Weighed:
    """The gap, and what is left of it as the parts are taken off (`gap_decomposition`)."""
    findings: Findings = reality.findings
    forward, t, rows = sides.forward, sides.forward.touches, sides.rows
    named = {e.name: e.parameters for e in reality.entries if e.name in reality.effects}
    real = reality_of(findings, reality.effects, numerics.strain)
    weighing = GapSums(
        np.where(t.counted, t.site[t.press], -1), findings.forward.touches.thinned_away, reality.noise_n
    )
    modulus = real.modulus[rows]
    measured = measured_parameters(findings, asked.stated, float(np.median(modulus)), named)
    start = real.measured[rows] - sides.raw
    first = start + numerics.force["all"]
    wrong = wrong_parameters(first, forward, numerics, measured, modulus, weighing, rules)
    given = sum((p.force for p in wrong), np.zeros_like(first))
    second = first - given
    touched = second - (real.ideal.force[rows] - law_at(forward, asked.stated, numerics) - given)
    end = touched - (real.full.force[rows] - real.ideal.force[rows])
    gaps = {"simulated": start, "numerics": first, "parameters": second, "touches": touched, "reality": end}
    if weighing.gap_n(touched) ** 2 - weighing.gap_n(end) ** 2 < (rules.smallest * reality.noise_n) ** 2:
        real = dataclasses.replace(real, names=())  # true of the object, and no part of this gap
    return _Weighed(
        asked, options.seed, options.bootstrap, rules.doubt, reality, sides, numerics, real, wrong, measured,
        weighing, gaps, rules.smallest * reality.noise_n, own,
    )  # fmt: skip


def _concluded(w: _Weighed) -> SimulatedGap:
    reality, numerics, weighing = w.reality, w.numerics, w.weighing
    findings: Findings = reality.findings
    whole = w.square("simulated")

    def part_of(before: str, after: str, names: Sequence[str]) -> GapPart:
        drop = w.square(before) - w.square(after)
        return GapPart(math.sqrt(max(drop, 0.0)), drop / whole, tuple(names))

    parts = {
        "numerics": part_of("simulated", "numerics", numerics.named),
        "parameters": part_of("numerics", "parameters", [p.name for p in w.wrong]),
        "reality": part_of("touches", "reality", w.real_names),
    }
    explained = sum(p.share for p in parts.values())
    after, counts = _after(w), weighing.counts
    closed, interval = closed_share_ci95(
        weighing.squares(w.gaps["simulated"]), after, counts, reality.noise_n**2 - weighing.added,
        np.random.default_rng(w.seed), w.resamples,
    )  # fmt: skip
    names = _by_size(w)
    unstated = _unstated(w.asked.stated, numerics)
    candidates = [*numerics.candidates, *unstated, *w.open_names, *reality.candidates]
    coarse = w.sides.coarse
    reasons = [*numerics.reasons, *(f"of our own model: {r}" for r in reality.reasons)]
    if coarse:
        reasons.insert(0, coarse)
    unknown = bool(coarse) or numerics.remainder or "unknown" in reality.kind
    answer = Answer(names, candidates, reasons, unknown)
    forward = copy.copy(findings.forward)
    kept = np.isin(forward.touches.onset_s, w.sides.forward.touches.onset_s)
    forward.touches = forward.touches.of(kept)
    return SimulatedGap(
        simulator=Simulator(
            w.asked.forces.name, w.asked.version, w.asked.stated, w.sides.frame.axes, w.sides.frame.unit
        ),
        noise_n=reality.noise_n,
        gap_before_n=math.sqrt(whole),
        gap_after_n=math.sqrt(max(after.sum() / counts.sum() + weighing.added, 0.0)),
        gap_closed=closed,
        gap_closed_ci95=interval,
        kind=answer.kind,
        effects=tuple(names),
        candidates=answer.rivals,
        explanations=_explanations(w, names),
        parts=parts,
        unexplained=1 - explained,
        unexplained_n=math.sqrt(max(whole * (1 - explained), 0.0)),
        noise_share=min(reality.noise_n**2 / whole, 1.0),
        touch_share=(w.square("parameters") - w.square("touches")) / whole,
        where=locate(
            forward, w.gaps["simulated"], findings.readings.free, findings.site_sd[kept],
            (w.gaps["simulated"] ** 2).sum(axis=1), seed=w.seed,
        ),
        entries=_entries(w, names),
        young_modulus_pa=reality.young_modulus_pa,
        advice=advice_of(
            numerics, w.wrong, w.real_names, w.asked.advice,
            unstated=bool(unstated), poisson_limit=w.asked.poisson_limit,
        ),
        notes=(*w.sides.notes, *_defaults(w.asked.stated)),
        reasons=tuple(answer.reasons),
        reality=reality,
        touches=forward.touches,
        gaps=w.gaps,
        simulated=w.sides.raw,
        own=None if w.own is None else w.own.at(w.weighing),
        coarse=coarse,
        made_up=made_up(w.numerics, w.wrong, w.own, w.weighing, w.least_n),
    )  # fmt: skip


def _explanations(w: _Weighed, names: list[str]) -> tuple[Explanation, ...]:
    """The smallest collection of sets that holds all but `doubt` of the posterior, of numerics and reality
    together; what the samples or the recording's values show of themselves is in each."""
    real = w.reality.explanations if w.real.names else ()
    sets = joint(w.numerics.explanations, real or [Explanation((), 1.0)])
    weighed = names_of(sets)
    sets = joint([Explanation(tuple(n for n in names if n not in weighed), 1.0)], sets)
    return likeliest(sets, 1 - w.doubt)


def _by_size(w: _Weighed) -> list[str]:
    """All that is named, what changes the force most first, whatever part it is in. What reality adds is one
    force, so its effects stand together."""
    wrong = [p.name for p in w.wrong]
    sizes = sizes_alone(w.sides.forward, w.numerics, wrong, w.measured, w.weighing)
    real = w.weighing.rms_n(w.gaps["touches"] - w.gaps["reality"])
    sizes |= {name: real for name in w.real_names}
    return sorted(sizes, key=lambda name: -sizes[name])


def _after(w: _Weighed) -> np.ndarray:
    """(g,) N^2 once every named part is mended: what first touches take is not mended by anybody."""
    kept = w.weighing.squares(w.gaps["parameters"]) - w.weighing.squares(w.gaps["touches"])
    return w.weighing.squares(w.gaps["reality"]) + kept


def _unstated(stated: Stated, numerics: Numerics) -> list[str]:
    """A stiffness alike everywhere may be a modulus that nobody stated."""
    alike = "mesh_stiffness" in numerics.named and "young_modulus_pa" not in stated.given
    return [OWN_MODULUS] if alike else []


def _defaults(stated: Stated) -> tuple[str, ...]:
    """Which parameters were not said."""
    names = [n for n in stated.as_json() if n not in stated.given]
    if not names:
        return ()
    notes = [f"not stated, so the model's own are taken: {', '.join(names)} (--stated KEY=VALUE)"]
    if "friction" in names and math.isinf(stated.friction):
        notes.append(
            "the model names no friction, so the tip is taken to stick; what `palpate` renders, replays or "
            "exports slides at 1 then: --stated friction=1"
        )
    return tuple(notes)


def _entries(w: _Weighed, order: list[str]) -> tuple[EffectEntry, ...]:
    """Every effect's line: the gap once it alone is mended."""
    numerics, weighing, start = w.numerics, w.weighing, w.gaps["simulated"]
    before = weighing.squares(start)
    rng = np.random.default_rng(w.seed)

    def entry(name: str, domain: str, probability: float, gap: np.ndarray, keys: dict, **more: Any) -> Any:
        after = weighing.squares(gap)
        closed, interval = closed_share_ci95(
            before, after, weighing.counts, weighing.noise_n**2 - weighing.added, rng, 100
        )
        return EffectEntry(name, domain, probability, weighing.gap_n(gap), closed, interval, keys, **more)

    entries = [
        entry(
            name, numerical(name).domain, numerics.probability[name], start + numerics.force[name],
            numerics.keys[name], gain=numerics.gain.get(name, 0.0),
            intervals=numerics.intervals.get(name, {}),
            detectable_n=numerics.detectable_n.get(name, float("nan")),
        )
        for name in NAMES if name in numerics.keys and name in numerics.force
    ]  # fmt: skip
    forward, flaws = w.sides.forward, list(numerics.values)
    times = 1.0 if w.own is None else w.own.times()
    for p in w.wrong:
        # the run that has the right value has the simulator's flaws still: too stiff a mesh makes it more
        given = w.asked.stated
        both = (given, given.but(PARAMETER_OF[p.name], p.measured))
        was, now = (law_at(forward, each, numerics, flaws) for each in both)
        keys = {"stated": _finite(p.stated), "measured": _finite(p.measured)}
        entries.append(entry(p.name, "parameters", 0.95, start - times * (now - was), keys))
    for each in w.reality.entries:
        if (each.name,) == w.real.names:
            own = w.gaps["touches"] - w.gaps["reality"]
            entries.append(
                entry(each.name, each.domain, each.probability, start - own, each.parameters,
                      gain=each.gain, intervals=each.intervals)
            )  # fmt: skip
        else:
            entries.append(each)
    place = {n: i for i, n in enumerate(order)}
    return tuple(sorted(entries, key=lambda e: (place.get(e.name, 99), -e.probability, -e.gain)))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
