"""The diagnosis from recording and model to verdict: where, which, how far."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass

import numpy as np

from diagnose.instrument.freeair import free_air_of
from diagnose.instrument.offsets import find_instrument_offsets, read_sideways, ruled_out, with_move
from diagnose.instrument.retraced import move_of
from diagnose.instrument.rigid import rigid_of
from diagnose.search.attribution import attribute
from diagnose.search.deciding import AttributionOptions
from diagnose.search.first_touch import REACH_M, reached
from diagnose.search.forward import build_forward
from diagnose.search.judging import Search
from diagnose.search.misfit import misfit_of
from diagnose.search.shape import site_stiffness_sd
from diagnose.search.touches import LEAST_SITES, touches_of
from diagnose.search.whiten import NuisanceOptions
from diagnose.verdict.answer import Evidence
from diagnose.verdict.conclusion import conclude
from diagnose.verdict.result import Diagnosis
from mechanics.effects.base import Role, Scope
from mechanics.effects.registry import effects
from mechanics.model import Model
from mechanics.options import option
from mechanics.presses import Presses
from mechanics.progress import Progress, silent
from mechanics.recording import Recording
from reconstruct.placing import presses_on


@dataclass(frozen=True)
class DiagnoseOptions:
    """What a diagnosis may be told."""

    fast: bool = option(
        False, "half a minute instead of three: fewer effects, one in an answer, less sampling"
    )
    without: str = option("", "effects to leave out of the library, comma separated (for tests of 'unknown')")
    bootstrap: int = option(400, "resamplings of sites for intervals")
    seed: int = option(0, "seed of flips and resamplings")


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
    rules = attribution or AttributionOptions(most=1 if options.fast else 3)
    seconds: dict[str, float] = {}
    clock = time.perf_counter()

    def lap(name: str) -> None:
        nonlocal clock
        now = time.perf_counter()
        seconds[name] = round(now - clock, 2)
        clock = now

    progress("touches", 0.02)
    presses = presses_on(recording, model)
    given, model = model, with_tip_of(model, presses)
    # a surface of another recording's presses may be passed because the object moved
    own = model.fitted_to(presses)
    met = reached(presses) if own else np.ones(len(presses), dtype=bool)
    touches = touches_of(presses.of(met))
    free = free_air_of(recording, presses)
    lap("touches")
    progress("sites", 0.05)
    forward = build_forward(touches, model)
    lap("sites")
    untold = untold_effects(presses)
    excluded = {n.strip() for n in options.without.split(",") if n.strip()} | untold
    allowed = effects(without=excluded)
    rigid = rigid_of(recording, presses, model.support.normal)
    offsets = find_instrument_offsets(forward, free, rigid, excluded, rules)
    centre = touches.point.mean(axis=0)
    move = move_of(recording, presses, model.support.normal, centre) if own else None
    offsets = with_move(offsets, forward, move, excluded, rules)
    settled = {*offsets.names, *ruled_out(forward, rigid, move, rules)}
    site_sd = site_stiffness_sd(touches, model, nuisance)
    if touches.sites != presses.of(met).sites:
        # repeats of one place share whatever is wrong with it: they differ by what repeats differ by
        site_sd = np.full(len(touches), nuisance.press_stiffness)
    search = Search(
        forward, model.material.young_modulus_pa, nuisance=nuisance, options=rules, site_sd=site_sd,
        finite_strain=next(e for e in effects() if e.role is Role.KNOWN),
    )  # fmt: skip
    left_out = {e.name for e in effects() if e.costly and options.fast}
    hidden = {e.name for e in effects() if e.by_first_touches and own}
    tried = [e for e in allowed if e.role is Role.SEARCHED and e.name not in (left_out | settled | hidden)]
    progress("baseline", 0.12)
    base = search.judge([search.finite_strain])
    misfit = misfit_of(forward, base.found, site_sd)
    search.starts = {e.name: e.seek(forward, misfit) for e in tried if e.seek is not None}
    lap("baseline")
    seen = read_sideways(rigid, rules) & frozenset(e.name for e in tried)
    if rigid is not None and seen:
        offsets = dataclasses.replace(offsets, reasons=(*offsets.reasons, rigid.words))
    if not met.all():
        lost = f"presses not weighed, as the surface passes them by over {1e3 * REACH_M:g} mm: {(~met).sum()}"
        offsets = dataclasses.replace(offsets, reasons=(*offsets.reasons, lost))
    found = attribute(search, tried, seen=seen, progress=lambda s, x: progress(s, 0.15 + 0.7 * x))
    lap("effects")
    evidence = Evidence(
        forward, search, found, free, offsets, site_sd, frozenset(excluded),
        options.bootstrap, options.seed, refit=not options.fast,
    )  # fmt: skip
    result = conclude(evidence, lap)
    progress("done", 1.0)
    return dataclasses.replace(
        result, seconds=seconds, left_out=tuple(sorted(left_out | untold | hidden - settled)),
        recording=recording, model=given,
    )  # fmt: skip


def with_tip_of(model: Model, presses: Presses) -> Model:
    """The model with the tip that the presses were made with: another recording's may be of another size."""
    if model.tool.tip_radius_m == presses.tip_radius_m:
        return model
    tool = dataclasses.replace(model.tool, tip_radius_m=presses.tip_radius_m)
    return model.replaced(tool=tool)


def untold_effects(presses: Presses) -> set[str]:
    """Names of the effects that presses of this kind say nothing of: points have no time, one axis has
    nothing sideways, one place has no other place, and what never leaves the object has no free air."""
    told_nothing: set[Scope] = set()
    if presses.quasi_static:
        told_nothing |= {Scope.TIME, Scope.READING}
    if presses.sites < LEAST_SITES:
        told_nothing |= {Scope.PLACES}
    names = {e.name for e in effects() if e.scope in told_nothing}
    if not presses.local_force[:, 1:].any():
        # a machine of one axis: nothing sideways, and no axis beside another
        names |= {e.name for e in effects() if e.slips or e.common_factor > 0}
    return names - {e.name for e in effects() if e.role is Role.KNOWN}
