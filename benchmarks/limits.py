"""Is the stated limit of each effect true? Draws at 1, 2 and 4 times it, judged by the whole search.

The presses of a recording are made anew by the mechanics: first touches, stiffnesses of places and all other
nuisances drawn from their widths, an effect at so many times its `detectable_n`, noise. All effects are
fitted and judged anew, as a diagnosis does it. Counted is the share of the draws that name the effect, or
another law of its phenomenon; and, without one, that name anything.
"""

from __future__ import annotations

import argparse
import copy
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.evidence import rates
from benchmarks.timing import table
from palpate.diagnosis.options import DiagnoseOptions
from palpate.diagnosis.pipeline import diagnose
from palpate.diagnosis.search.attribution import attribute
from palpate.diagnosis.search.descent import misfit_of
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.search.gaps import beside_modulus_n
from palpate.diagnosis.search.limits import detectable, forms_of
from palpate.diagnosis.search.rivals import of_one_phenomenon
from palpate.diagnosis.search.whiten import Whitener, nuisance_columns
from palpate.diagnosis.verdict.answer import Findings
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.model.files import read_model
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import read_recording
from palpate.reconstruction.pipeline import reconstruct_fully
from palpate.scenes.embedded import embedded_recording

TIMES = (1.0, 2.0, 4.0)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which recording, which effects, how many draws."""
    parser.add_argument("--recording", type=Path, help="default: the embedded one")
    parser.add_argument("--model", type=Path, help="MODEL folder (default: reconstruct the recording)")
    parser.add_argument("--effects", nargs="+", metavar="NAME", help="default: all that have a limit")
    parser.add_argument("--draws", type=int, default=10, help="of each effect and size")
    parser.add_argument("--controls", type=int, default=20, help="draws without an effect")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--fast", action="store_true", help="leave out what a quick diagnosis leaves out")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Draw, judge, count."""
    recording = read_recording(arguments.recording or embedded_recording())
    model = read_model(arguments.model) if arguments.model else reconstruct_fully(recording).model
    options = DiagnoseOptions(fast=arguments.fast, bootstrap=100)
    found: Findings = diagnose(recording, model, options).findings
    tried = [s.effect for s in found.found.scored.values()]
    limits = detectable(found.search, found.found.base, tried)
    names = arguments.effects or [n for n, limit in limits.items() if np.isfinite(limit)]
    rng = np.random.default_rng(arguments.seed)
    counted: dict[str, tuple[int, int]] = {}
    for name in names:
        own = effect(name)
        forms = forms_of(found.search, own)
        for times in TIMES:
            hits = made = 0
            for draw in range(arguments.draws):
                values = _of_size(found, own, forms[draw % len(forms)], times * limits[name])
                if values is None:
                    continue  # no such effect is as large
                named = [effect(n) for n in _named(found, tried, own, values, rng)]
                hits += own in named or of_one_phenomenon(own, named)
                made += 1
            counted[f"{name} named at {times:g} times {1e3 * limits[name]:.3g} mN"] = (hits, made)
            print(f"{name:22s} {times:g} x {1e3 * limits[name]:6.1f} mN: {hits} of {made}", flush=True)
    false = sum(bool(_named(found, tried, None, None, rng)) for _ in range(arguments.controls))
    counted["anything named without an effect"] = (false, arguments.controls)
    print(table(["rate", "hits", "of"], [[what, *pair] for what, pair in counted.items()]))
    return {"limits_n": limits, "figures": rates(counted)}


def _of_size(found: Findings, own: Effect, form: np.ndarray, size_n: float) -> np.ndarray | None:
    """Values (k,) between none of an effect and its bounds, towards a form, whose change of the force is of
    that rms, N; None where none is."""
    base, forward = found.found.base.found, found.forward
    counted = forward.touches.counted
    before = forward.predict(settings_of(forward, base.effects, base.values, base.onset))

    def size(share: float) -> float:
        settings = settings_of(forward, base.effects, base.values, base.onset)
        own.act(settings, np.clip(own.ideal + share * (form - own.ideal), *own.bounds), forward)
        change = np.nan_to_num(forward.predict(settings)) - before
        return beside_modulus_n(change[counted], before[counted])

    low, high = 0.0, 1.0
    while size(high) < size_n:
        low, high = high, 2 * high
        if high > 64:
            return None
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if size(middle) < size_n else (low, middle)
    return np.clip(own.ideal + high * (form - own.ideal), *own.bounds)


def _named(
    found: Findings, tried: list[Effect], own: Effect | None, values: Any, rng: np.random.Generator
) -> tuple[str, ...]:
    """What the search names of one draw with an effect of these values (k,) in it."""
    base, t, whitener = found.found.base.found, found.forward.touches, found.search.whitener
    onset = base.onset + whitener.onset_sd * rng.normal(size=len(t))
    settings = settings_of(found.forward, base.effects, base.values, onset)
    if own is not None:
        own.act(settings, values, found.forward)
    force = np.nan_to_num(found.forward.predict(settings))
    columns = nuisance_columns(
        found.forward, settings, force.copy(), found.search.nuisance, found.site_sd, whitener.onset_sd
    )
    scatter = np.sqrt(found.found.base.over)  # of places, as this recording's do
    for level, column in columns[1:]:  # the first is the first touch's
        drawn = rng.normal(size=len(t))[t.press if level == "press" else t.site[t.press]]
        drawn = drawn if level == "press" else scatter * drawn
        force += drawn[:, None] * column
    force += _noise(t, whitener, rng)
    forward = copy.copy(found.forward)
    forward.touches = dataclasses.replace(t, force=np.einsum("nji,nj->ni", t.frame[t.press], force))
    search = Search(
        forward, base.modulus, nuisance=found.search.nuisance, options=found.search.options,
        site_sd=found.site_sd, finite_strain=effect("finite_strain"),
    )  # fmt: skip
    fitted = search.judge([search.finite_strain])
    misfit = misfit_of(forward, fitted.found, found.site_sd)
    search.starts = {e.name: e.hints.seek(forward, misfit) for e in tried if e.hints.seek is not None}
    return attribute(search, tried).chosen


def _noise(t: Presses, whitener: Whitener, rng: np.random.Generator) -> np.ndarray:
    """(n, 3) N: of each sample's variance, and held for as many samples as it adds up over along a press."""
    drawn = np.zeros((len(t.t), 3))
    for part in t.parts:
        own = whitener.sample_variance[part]
        adds_up = whitener.variance * whitener.louder[part] ** 2
        held = max(1, round(float((adds_up / own).mean())))
        steps = rng.normal(size=(len(own) // held + 1, 3))
        drawn[part] = np.sqrt(own)[:, None] * np.repeat(steps, held, axis=0)[: len(own)]
    return drawn
