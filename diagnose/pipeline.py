"""The diagnosis from recording and model to verdict: where, which, how far."""

from __future__ import annotations

import dataclasses

import numpy as np

from palpate.diagnosis.forward.prediction import build_forward, solved
from palpate.diagnosis.forward.touches import REACH_M, reached, touches_of, unobservable_effects
from palpate.diagnosis.instrument.free_air import free_air_of
from palpate.diagnosis.instrument.instrument_effects import (
    find_instrument_offsets,
    read_sideways,
    ruled_out,
    seen_play,
    with_move,
)
from palpate.diagnosis.instrument.retraced import move_of
from palpate.diagnosis.instrument.support_readings import rigid_of
from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from palpate.diagnosis.search.attribution import attribute
from palpate.diagnosis.search.descent import misfit_of
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.site_stiffness import site_stiffness_sd
from palpate.diagnosis.verdict.answer import Findings
from palpate.diagnosis.verdict.conclusion import conclude
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.effects.base import Role
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Clock, Progress, part, silent
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.presses_on_model import presses_on


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
    nuisance = nuisance or NuisanceOptions()
    rules = attribution or AttributionOptions()
    rules = rules.within(1) if options.fast else rules
    clock = Clock()

    progress("touches", 0.02)
    presses = presses_on(recording, model)
    given, model = model, with_tip_of(model, presses)
    # a surface of another recording's presses may be passed because the object moved
    own = model.fitted_to(presses)
    met = reached(presses) if own else np.ones(len(presses), dtype=bool)
    touches = touches_of(presses.of(met))
    clock.lap("touches")
    progress("sites", 0.05)
    forward = build_forward(touches, model)
    clock.lap("sites")
    if options.exact:
        forward = solved(forward, part(progress, 0.05, 0.1))
        clock.lap("solved places")

    unobservable = unobservable_effects(presses)
    excluded = {*options.left_out, *unobservable}
    free = free_air_of(recording, presses)
    rigid = rigid_of(recording, presses, model.support.normal)
    offsets = find_instrument_offsets(forward, free, rigid, excluded, rules)
    centre = touches.point.mean(axis=0)
    move = move_of(recording, presses, model.support.normal, centre) if own else None
    offsets = with_move(offsets, forward, move, excluded, rules)

    settled = {*offsets.names, *ruled_out(forward, rigid, move, rules)}
    site_sd = site_stiffness_sd(forward, nuisance)
    if touches.sites != presses.of(met).sites:
        # repeats of one place share whatever is wrong with it: they differ by what repeats differ by
        site_sd = np.full(len(touches), nuisance.press_stiffness)
    search = Search(
        forward, model.material.young_modulus_pa, nuisance=nuisance, options=rules, site_sd=site_sd,
        finite_strain=next(e for e in effects() if e.role is Role.KNOWN),
    )  # fmt: skip
    left_out = {e.name for e in effects() if e.hints.expensive and options.fast}
    hidden = {e.name for e in effects() if e.hints.by_first_touches and own}
    able = [e for e in effects(without=excluded) if e.role is Role.SEARCHED]
    tried = [e for e in able if e.name not in (left_out | settled | hidden)]
    progress("baseline", 0.12)
    base = search.judge([search.finite_strain])
    misfit = misfit_of(forward, base.found, site_sd)
    search.starts = {e.name: e.hints.seek(forward, misfit) for e in tried if e.hints.seek is not None}
    clock.lap("baseline")
    seen = read_sideways(rigid, rules) & frozenset(e.name for e in tried)
    if rigid is not None and seen:
        offsets = dataclasses.replace(offsets, reasons=(*offsets.reasons, rigid.words))
    known = seen_play(rigid, excluded, rules)
    if rigid is not None and known is not None:
        seen |= {known.name}
        tried = [known if e.name == known.name else e for e in tried]
        offsets = dataclasses.replace(offsets, reasons=(*offsets.reasons, rigid.words_of_play))
    if not met.all():
        lost = f"presses not weighed, as the surface passes them by over {1e3 * REACH_M:g} mm: {(~met).sum()}"
        offsets = dataclasses.replace(offsets, reasons=(*offsets.reasons, lost))
    found = attribute(search, tried, seen=seen, progress=lambda s, x: progress(s, 0.15 + 0.7 * x))
    clock.lap("effects")
    for name in sorted(seen - set(found.chosen)):
        refused = f"{name.replace('_', ' ')}: the presses do not bear that out, so it is not named"
        offsets = dataclasses.replace(offsets, reasons=(*offsets.reasons, refused))

    findings = Findings(
        forward, search, found, free, offsets, site_sd, frozenset(excluded),
        options.bootstrap, options.seed, refit=not options.fast,
    )  # fmt: skip
    result = conclude(findings, clock.lap)
    progress("done", 1.0)
    return dataclasses.replace(
        result,
        seconds={name: round(s, 2) for name, s in clock.laps.items()},
        left_out=tuple(sorted(left_out | unobservable | hidden - settled)),
        recording=recording,
        model=given,
    )


def with_tip_of(model: Model, presses: Presses) -> Model:
    """The model with the tip that the presses were made with: another recording's may be of another size."""
    if model.tool.tip_radius_m == presses.tip_radius_m:
        return model
    tool = dataclasses.replace(model.tool, tip_radius_m=presses.tip_radius_m)
    return model.replaced(tool=tool)
