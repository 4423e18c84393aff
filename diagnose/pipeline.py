"""The diagnosis from recording and model to verdict, where, which, how far: measure, search, conclude.

Each stage is a function of what came before; the recording ends with the first.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.forward.prediction import Forward, build_forward, solved
from palpate.diagnosis.instrument.free_air_offsets import InstrumentOffsets
from palpate.diagnosis.instrument.instrument_effects import read_sideways, ruled_out, seen_play, taken_off
from palpate.diagnosis.instrument.readings import Readings, readings_of
from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from palpate.diagnosis.search.attribution import attribute
from palpate.diagnosis.search.descent import misfit_of
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.site_stiffness import site_stiffness_sd, stands_open
from palpate.diagnosis.verdict.answer import Findings
from palpate.diagnosis.verdict.conclusion import conclude
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.effects.base import Effect, Role
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.model.model import Model
from palpate.mechanics.one_thread import one_thread
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Clock, Progress, part, silent
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.presses_on_model import presses_on


@one_thread
def diagnose(
    recording: Recording,
    model: Model,
    options: DiagnoseOptions | None = None,
    progress: Progress = silent,
    *,
    nuisance: NuisanceOptions | None = None,
    attribution: AttributionOptions | None = None,
) -> Diagnosis:
    """Diagnose the gap between a recording and its model. Raises DiagnosisError where the data cannot carry
    it."""
    options = options or DiagnoseOptions()
    rules = attribution or AttributionOptions()
    rules = rules.within(1) if options.fast else rules
    clock = Clock()
    corrected = measure(recording, model, options, rules, progress, clock)
    findings = search(corrected, options, nuisance or NuisanceOptions(), rules, progress, clock)
    result = conclude(findings, clock.lap)
    progress("done", 1.0)
    return dataclasses.replace(
        result,
        seconds={name: round(s, 2) for name, s in clock.laps.items()},
        left_out=corrected.untried,
        recording=recording,
        model=model,
    )


@dataclass(frozen=True)
class Corrected:
    """The presses with all taken off that the instrument shows of itself, and what is left to search for.

    forward: their mechanics. offsets: what was taken off. excluded: names left out by options or that such
    presses cannot show. tried: effects that are searched for; untried: names of the others, sorted.
    """

    readings: Readings
    forward: Forward
    offsets: InstrumentOffsets
    excluded: frozenset[str]
    tried: tuple[Effect, ...]
    untried: tuple[str, ...]


def measure(
    recording: Recording,
    model: Model,
    options: DiagnoseOptions,
    rules: AttributionOptions,
    progress: Progress,
    clock: Clock,
) -> Corrected:
    """What the recording shows before any effect is searched for."""
    progress("touches", 0.02)
    presses = presses_on(recording, model)
    fitted, model = model.fitted_to(presses), with_tip_of(model, presses)
    readings = readings_of(recording, presses, model.support.normal, fitted=fitted)
    clock.lap("touches")
    progress("sites", 0.05)
    forward = build_forward(readings.touches, model)
    clock.lap("sites")
    if options.exact:
        forward = solved(forward, part(progress, 0.05, 0.1))
        clock.lap("solved places")
    unseen = set(readings.unobservable)
    if stands_open(model):
        unseen |= {e.name for e in effects() if e.hints.by_base}
    excluded = frozenset({*options.left_out, *unseen})
    offsets = taken_off(readings, forward, excluded, rules)
    settled = {*offsets.names, *ruled_out(forward, readings.rigid, readings.move, rules)}
    left_out = {e.name for e in effects() if e.hints.expensive and options.fast}
    hidden = {e.name for e in effects() if e.hints.by_first_touches and fitted}
    able = [e for e in effects(without=set(excluded)) if e.role is Role.SEARCHED]
    return Corrected(
        readings,
        forward,
        offsets,
        excluded,
        tried=tuple(e for e in able if e.name not in (left_out | settled | hidden)),
        untried=tuple(sorted(left_out | unseen | (hidden - settled))),
    )


def search(
    corrected: Corrected,
    options: DiagnoseOptions,
    nuisance: NuisanceOptions,
    rules: AttributionOptions,
    progress: Progress,
    clock: Clock,
) -> Findings:
    """What explains the presses best: all that a verdict rests on."""
    readings, forward, tried = corrected.readings, corrected.forward, list(corrected.tried)
    progress("baseline", 0.12)
    weighed = search_of(corrected, nuisance, rules)
    clock.lap("baseline")
    rigid, why = readings.rigid, list(corrected.offsets.reasons)
    seen = read_sideways(rigid, rules) & frozenset(e.name for e in tried)
    if rigid is not None and seen:
        why.append(rigid.words)
    play = seen_play(rigid, corrected.excluded, rules)
    if rigid is not None and play is not None:
        seen |= {play.name}
        tried = [play if e.name == play.name else e for e in tried]
        why.append(rigid.words_of_play)
    found = attribute(weighed, tried, seen=seen, progress=lambda s, x: progress(s, 0.15 + 0.7 * x))
    clock.lap("effects")
    why += readings.not_weighed
    if words := stands_open(forward.model):
        why.append(words)
    for name in sorted(seen - set(found.chosen)):
        why.append(f"{name.replace('_', ' ')}: the presses do not confirm it, so it is not named")
    offsets = dataclasses.replace(corrected.offsets, reasons=tuple(why))
    return Findings(
        forward, weighed, found, readings, offsets, weighed.site_sd, corrected.excluded,
        options.bootstrap, options.seed, refit=not options.fast,
    )  # fmt: skip


def search_of(corrected: Corrected, nuisance: NuisanceOptions, rules: AttributionOptions) -> Search:
    """Where the presses' evidence is weighed, with starts that are sought in what the ideal law leaves."""
    forward, t = corrected.forward, corrected.readings.touches
    # repeats of one place share whatever is wrong with it: they differ by what repeats differ by
    alike = np.full(len(t), nuisance.press_stiffness)
    site_sd = alike if corrected.readings.one_by_one else site_stiffness_sd(forward, nuisance)
    found = Search(
        forward, forward.model.material.young_modulus_pa, nuisance=nuisance, options=rules, site_sd=site_sd,
        finite_strain=next(e for e in effects() if e.role is Role.KNOWN),
    )  # fmt: skip
    misfit = misfit_of(forward, found.judge([found.finite_strain]).found, site_sd)
    found.starts = {
        e.name: e.hints.seek(forward, misfit) for e in corrected.tried if e.hints.seek is not None
    }
    return found


def with_tip_of(model: Model, presses: Presses) -> Model:
    """The model with the tip that the presses were made with: another recording's may be of another size."""
    if model.tool.tip_radius_m == presses.tip_radius_m:
        return model
    tool = dataclasses.replace(model.tool, tip_radius_m=presses.tip_radius_m)
    return model.replaced(tool=tool)
