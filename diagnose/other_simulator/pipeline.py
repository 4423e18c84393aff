"""From a recording, its model and another simulator's forces to where, why and how far these are off."""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from diagnose.forward.touches import LEAST_PRESSES, LEAST_ROWS, reached, touches_of
from diagnose.numerics.base import signal_of
from diagnose.numerics.registry import NAMES, numerical
from diagnose.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from diagnose.other_simulator.against_law import LEAST_SHARE, Numerics, numerics_of, seen_in_samples
from diagnose.other_simulator.forces import Aligned, Forces, ForcesOptions, aligned
from diagnose.other_simulator.parts import (
    Parameter,
    Reality,
    Weighing,
    law_at,
    measured_parameters,
    reality_of,
    wrong_parameters,
)
from diagnose.other_simulator.result import Part, SimulatedGap, Simulator
from diagnose.other_simulator.stated import Stated, StatedForward
from diagnose.pipeline import diagnose, with_tip_of
from diagnose.search.gaps import closed_share
from diagnose.verdict.answer import Answer, Findings
from diagnose.verdict.result import Diagnosis, EffectEntry
from diagnose.verdict.where import locate
from mechanics.compliance.pressed_places import Places
from mechanics.errors import DiagnosisError
from mechanics.model.model import Model
from mechanics.presses.table import MARGIN_S, Presses
from mechanics.progress import Progress, part, silent
from mechanics.recording.recording import Recording
from reconstruct.presses_on_model import presses_on

OWN_MODULUS = "stated_modulus"


@dataclasses.dataclass(frozen=True)
class Asked:
    """What is asked of a simulation: its forces, what it was given, how the file is meant; of one run
    here its version, advice by numerical effect, settings in words, and greatest Poisson's ratio."""

    forces: Forces
    stated: Stated
    options: ForcesOptions = dataclasses.field(default_factory=ForcesOptions)
    version: str = ""
    advice: dict[str, str] = dataclasses.field(default_factory=dict)
    run_as: str = ""
    poisson_limit: float = math.inf


@dataclasses.dataclass
class _Sides:
    """The simulation's presses beside the real ones. forward: of all its presses, with the mended signal;
    raw: (n, 3) N, local, the force as it came; rows: of the real touches; fell_s: (p,) s, from when on the
    tip had fallen through, inf where it did not; seen: what the samples themselves showed."""

    forward: StatedForward
    raw: np.ndarray
    rows: np.ndarray
    fell_s: np.ndarray
    seen: dict[str, dict[str, float]]
    notes: tuple[str, ...]


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
        raise DiagnosisError("points without a time have no path that a simulator could follow")
    given = aligned(asked.forces, presses, asked.options)
    if reality is None:
        reality = diagnose(
            recording, model, options, part(progress, 0.0, 0.6), nuisance=nuisance, attribution=attribution
        )
    findings: Findings = reality.findings
    sides = _beside(presses, with_tip_of(model, presses), given, findings, asked.stated)
    numerics = _numerics(sides, rules, part(progress, 0.6, 0.95))
    result = _concluded(_weighed(asked, options, rules, reality, sides, numerics))
    progress("done", 1.0)
    return result


def _beside(presses: Presses, model: Model, given: Aligned, findings: Findings, stated: Stated) -> _Sides:
    """The forces as touches, row by row beside the real ones."""
    met = reached(presses) if model.fitted_to(presses) else np.ones(len(presses), dtype=bool)
    run = np.flatnonzero(given.usable)
    own = presses.rows(run)
    signal, seen = seen_in_samples(signal_of(presses.of(run), given.force[own]))
    force = given.force.copy()
    force[own] = signal.force

    def touches(force: np.ndarray) -> Presses:
        nothing = np.zeros_like(force)
        return touches_of(dataclasses.replace(presses, force=force, free_air=nothing).of(met))

    raw, mended = touches(given.force), touches(force)
    keep = np.isin(raw.onset_s, presses.onset_s[given.usable])
    fell_s = np.full(len(presses), np.inf)
    np.minimum.at(fell_s, presses.press[own][signal.left], signal.t[signal.left])
    real = findings.forward
    rows = raw.rows(np.flatnonzero(keep))
    forward = StatedForward(mended.of(keep), _of(real.places, keep), stated)
    fell_s = fell_s[np.searchsorted(presses.onset_s, forward.touches.onset_s)]
    keys = {name: values for name, (_, values) in seen.items()}
    return _Sides(forward, raw.local_force[rows], rows, fell_s, keys, given.notes)


def _of(places: Places, keep: np.ndarray) -> Places:
    """The places of some presses."""
    if keep.all():
        return places
    own = ("point", "normal", "frame", "far", "curvature", "bracing")
    cut = {name: getattr(places, name)[keep] for name in own}
    return dataclasses.replace(places, **cut, stages={})


def _numerics(sides: _Sides, rules: AttributionOptions, progress: Progress) -> Numerics:
    """What is named against the law. Presses that the tip fell through have a say until they did, where that
    is long enough, and get the law's force with what was named from there on."""
    forward, t = sides.forward, sides.forward.touches
    until = np.minimum(t.end_s, sides.fell_s - MARGIN_S)
    cut = dataclasses.replace(t, end_s=until)
    seen = np.bincount(t.press[(t.t > t.onset_s[t.press]) & cut.counted], minlength=len(t))
    held = np.isinf(sides.fell_s) | (seen >= LEAST_ROWS)
    if held.sum() < LEAST_PRESSES:
        cut, held = t, np.ones(len(t), bool)
    sides = dataclasses.replace(sides, fell_s=np.where(held, sides.fell_s, -np.inf))
    if held.all() and np.isinf(sides.fell_s).all():
        return _with_seen(sides, numerics_of(forward, rules, progress))
    of_held = StatedForward(cut.of(held), _of(forward.places, held), forward.stated)
    return _with_seen(sides, _over_all(sides, numerics_of(of_held, rules, progress), held))


def _over_all(sides: _Sides, found: Numerics, held: np.ndarray) -> Numerics:
    """The same over all presses: those that had no say have our law's force."""
    forward, t = sides.forward, sides.forward.touches
    rows = t.rows(np.flatnonzero(held))
    law = law_at(forward, forward.stated, found)
    together = law.copy()
    together[rows] = found.with_numerics
    force = {}
    for name, own in found.force.items():
        force[name] = np.zeros_like(law)
        force[name][rows] = own
    return dataclasses.replace(found, law=law, with_numerics=together, force=force)


def _with_seen(sides: _Sides, found: Numerics) -> Numerics:
    """With what the samples themselves showed, where it matters."""
    t = sides.forward.touches
    fell = t.t >= sides.fell_s[t.press]
    mended = np.where(fell[:, None], found.with_numerics, t.local_force)
    parts = {
        "lost_contact": np.where(fell[:, None], 0.0, sides.raw - t.local_force),
        "tunnelling": np.where(fell[:, None], sides.raw - found.with_numerics, 0.0),
    }
    typical = float(np.sqrt((mended[t.counted] ** 2).sum(axis=1).mean()))
    sizes = {n: float(np.sqrt((f[t.counted] ** 2).sum(axis=1).mean())) for n, f in parts.items()}
    named = [n for n in sides.seen if sizes[n] > LEAST_SHARE * typical]
    all_of = found.force["all"] + sum((parts[n] for n in named), np.zeros_like(mended))
    strength = {n: float((found.force[n][t.counted] ** 2).sum()) for n in found.named}
    strength |= {n: float((parts[n][t.counted] ** 2).sum()) for n in named}
    order = tuple(sorted(strength, key=lambda n: -strength[n]))
    # a tip that is never felt at a place may go between nodes there
    between = "tunnelling" in named and sides.seen["tunnelling"]["never_felt"] > 0
    rivals = ("contact_nodes",) if between and "contact_nodes" not in order else ()
    return dataclasses.replace(
        found,
        named=order,
        candidates=(*found.candidates, *(r for r in rivals if r not in found.candidates)),
        keys={**found.keys, **sides.seen},
        probability={**found.probability, **{n: 1.0 if n in named else 0.0 for n in sides.seen}},
        force={**found.force, **{n: parts[n] for n in sides.seen}, "all": all_of},
    )


@dataclasses.dataclass(frozen=True)
class _Weighed:
    """What an answer is made of. gaps: (n, 3) N, local, as the parts are taken off, by name."""

    asked: Asked
    seed: int
    resamples: int
    reality: Diagnosis
    sides: _Sides
    numerics: Numerics
    real: Reality
    wrong: list[Parameter]
    weighing: Weighing
    gaps: dict[str, np.ndarray]

    def square(self, name: str) -> float:
        """N^2, the mean square of a gap."""
        return self.weighing.gap_n(self.gaps[name]) ** 2


def _weighed(
    asked: Asked,
    options: DiagnoseOptions,
    rules: AttributionOptions,
    reality: Diagnosis,
    sides: _Sides,
    numerics: Numerics,
) -> _Weighed:
    """The gap, and what is left of it as the parts are taken off (`diagnose.other_simulator.parts`)."""
    findings: Findings = reality.findings
    forward, t, rows = sides.forward, sides.forward.touches, sides.rows
    named = {e.name: e.parameters for e in reality.entries if e.name in reality.effects}
    real = reality_of(findings, reality.effects, numerics.strain)
    weighing = Weighing(
        np.where(t.counted, t.site[t.press], -1), findings.forward.touches.thinned_away, reality.noise_n
    )
    modulus = real.ideal.modulus[rows]
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
        asked, options.seed, options.bootstrap, reality, sides, numerics, real, wrong, weighing, gaps
    )


def _concluded(w: _Weighed) -> SimulatedGap:
    reality, numerics, weighing = w.reality, w.numerics, w.weighing
    findings: Findings = reality.findings
    whole = w.square("simulated")

    def part_of(before: str, after: str, names: Sequence[str]) -> Part:
        drop = w.square(before) - w.square(after)
        return Part(math.sqrt(max(drop, 0.0)), drop / whole, tuple(names))

    parts = {
        "numerics": part_of("simulated", "numerics", numerics.named),
        "parameters": part_of("numerics", "parameters", [p.name for p in w.wrong]),
        "reality": part_of("touches", "reality", w.real.names),
    }
    explained = sum(p.share for p in parts.values())
    after, counts = _after(w), weighing.counts
    closed, interval = closed_share(
        weighing.squares(w.gaps["simulated"]), after, counts, reality.noise_n, weighing.added,
        np.random.default_rng(w.seed), w.resamples,
    )  # fmt: skip
    names = _by_size(w)
    candidates = [*numerics.candidates, *_unstated(w.asked.stated, numerics), *reality.candidates]
    reasons = [*numerics.reasons, *(f"of our own model: {r}" for r in reality.reasons)]
    answer = Answer(names, candidates, reasons, numerics.remainder or "unknown" in reality.kind)
    forward = copy.copy(findings.forward)
    kept = np.isin(forward.touches.onset_s, w.sides.forward.touches.onset_s)
    forward.touches = forward.touches.of(kept)
    return SimulatedGap(
        simulator=Simulator(w.asked.forces.name, w.asked.version, w.asked.stated),
        noise_n=reality.noise_n,
        gap_before_n=math.sqrt(whole),
        gap_after_n=math.sqrt(max(after.sum() / counts.sum() + weighing.added, 0.0)),
        gap_closed=closed,
        gap_closed_ci95=interval,
        kind=answer.kind,
        effects=tuple(names),
        candidates=tuple(dict.fromkeys(c for c in candidates if c not in names)),
        parts=parts,
        unexplained=1 - explained,
        unexplained_n=math.sqrt(max(whole * (1 - explained), 0.0)),
        noise_share=min(reality.noise_n**2 / whole, 1.0),
        touch_share=(w.square("parameters") - w.square("touches")) / whole,
        where=locate(
            forward, w.gaps["simulated"], findings.free, findings.site_sd[kept],
            (w.gaps["simulated"] ** 2).sum(axis=1), seed=w.seed,
        ),
        entries=_entries(w, names),
        young_modulus_pa=reality.young_modulus_pa,
        advice=_advice(w),
        notes=(*w.sides.notes, *_defaults(w.asked.stated)),
        reasons=tuple(answer.reasons),
        reality=reality,
        touches=forward.touches,
        gaps=w.gaps,
        simulated=w.sides.raw,
    )  # fmt: skip


def _by_size(w: _Weighed) -> list[str]:
    """All that is named, what changes the force most first, whatever part it is in. What reality adds is one
    force, so its effects stand together."""
    weighing, numerics = w.weighing, w.numerics
    sizes = {name: weighing.gap_n(numerics.force[name]) for name in numerics.named}
    sizes |= {p.name: weighing.gap_n(p.force) for p in w.wrong}
    real = weighing.gap_n(w.gaps["touches"] - w.gaps["reality"])
    sizes |= {name: real for name in w.real.names}
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
    return (f"not stated, so the model's own are taken: {', '.join(names)} (--stated KEY=VALUE)",)


def _entries(w: _Weighed, order: list[str]) -> tuple[EffectEntry, ...]:
    """Every effect's line: the gap once it alone is mended."""
    numerics, weighing, start = w.numerics, w.weighing, w.gaps["simulated"]
    before = weighing.squares(start)
    rng = np.random.default_rng(w.seed)

    def entry(name: str, domain: str, probability: float, gap: np.ndarray, keys: dict, **more: Any) -> Any:
        after = weighing.squares(gap)
        closed, interval = closed_share(
            before, after, weighing.counts, weighing.noise_n, weighing.added, rng, 100
        )
        return EffectEntry(name, domain, probability, weighing.gap_n(gap), closed, interval, keys, **more)

    entries = [
        entry(
            name, numerical(name).domain, numerics.probability[name], start + numerics.force[name],
            numerics.keys[name], gain=numerics.gain.get(name, 0.0),
            intervals=numerics.intervals.get(name, {}),
            confidence_set_p=numerics.confidence_set_p.get(name, float("nan")),
            detectable_n=numerics.detectable_n.get(name, float("nan")),
        )
        for name in NAMES if name in numerics.keys and name in numerics.force
    ]  # fmt: skip
    for p in w.wrong:
        keys = {"stated": _finite(p.stated), "measured": _finite(p.measured)}
        entries.append(entry(p.name, "parameters", 0.95, start - p.force, keys))
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


def _advice(w: _Weighed) -> tuple[str, ...]:
    said = []
    for name in (*w.numerics.named, *w.numerics.candidates):
        words = w.asked.advice.get(name) or numerical(name).advice
        which = "" if name in w.numerics.named else "or "
        said.append(f"{which}{name.replace('_', ' ')}: {words}")
    units = {
        "stated_modulus": ("Young's modulus", "Pa"),
        "stated_poisson_ratio": ("Poisson's ratio", ""),
        "stated_friction": ("friction", ""),
        "stated_tip_radius": ("the tip's radius", "m"),
    }
    if _unstated(w.asked.stated, w.numerics):
        said.append("or stated modulus: nobody said what it was given; say it: --stated young_modulus_pa=PA")
    for p in w.wrong:
        what, unit = units[p.name]
        now = f"{p.measured:.4g} {unit}".strip() if math.isfinite(p.measured) else "infinite: the tip sticks"
        limit = w.asked.poisson_limit if p.name == "stated_poisson_ratio" else math.inf
        if p.measured <= limit or not math.isfinite(p.measured):
            words = f"give it {now} for {what} (it had {p.stated:.4g} {unit})"
        elif p.stated < limit:
            words = f"give it {limit:g} for {what}, the most that it takes (the recording says {now})"
        else:
            words = f"the recording says {now}, and {limit:g} is the most that it takes: this part stays"
        said.append(f"{p.name.replace('_', ' ')}: {words}")
    for name in w.real.names:
        said.append(
            f"{name.replace('_', ' ')}: no setting of an ideal elastic simulation has it; "
            "'palpate diagnose REC --apply MODEL2' writes a model that does"
        )
    return tuple(said)
