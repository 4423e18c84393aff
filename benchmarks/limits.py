"""Is the stated limit of each effect true? Draws at 1, 2 and 4 times it, judged by the whole search.

Residuals are drawn from the covariance of a recording's comparison with its model, an effect's own change of
the force is added at so many times its `detectable_n`, and all effects are fitted and judged anew, as a
diagnosis does it. Counted is the share of the draws that name it; and, without an effect, that name anything.
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
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.search.limits import Patterns, detectable
from palpate.diagnosis.verdict.answer import Findings
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.model.files import read_model
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
    found = diagnose(recording, model, DiagnoseOptions(fast=arguments.fast, bootstrap=100)).findings
    tried = [s.effect for s, _ in found.found.scored.values()]
    limits = detectable(found.search, found.found.base, tried)
    names = arguments.effects or [n for n, limit in limits.items() if np.isfinite(limit)]
    patterns = Patterns(found.search, found.found.base, tried, model.fitted_to(found.forward.touches), 0)
    rng = np.random.default_rng(arguments.seed)
    counted: dict[str, tuple[int, int]] = {}
    for name in names:
        own = np.flatnonzero(patterns.own == next(i for i, e in enumerate(tried) if e.name == name))
        for times in TIMES:
            hits = 0
            for draw in range(arguments.draws):
                column = own[draw % len(own)]
                change = times * limits[name] / patterns.size[column] * patterns.columns[:, :, 1 + column]
                hits += name in _named(found, tried, change, rng)
            counted[f"{name} named at {times:g} times {1e3 * limits[name]:.3g} mN"] = (hits, arguments.draws)
            print(
                f"{name:22s} {times:g} x {1e3 * limits[name]:6.1f} mN: {hits} of {arguments.draws}",
                flush=True,
            )
    nothing = np.zeros_like(patterns.columns[:, :, 0])
    named = [_named(found, tried, nothing, rng) for _ in range(arguments.controls)]
    counted["anything named without an effect"] = (sum(map(bool, named)), len(named))
    print(table(["rate", "hits", "of"], [[what, *pair] for what, pair in counted.items()]))
    return {"limits_n": limits, "figures": rates(counted)}


def _named(found: Findings, tried: list[Any], change: np.ndarray, rng: np.random.Generator) -> set[str]:
    """What the search names of a draw with a change (n, 3) N of the force in it."""
    base, t = found.found.base.found, found.forward.touches
    settings = settings_of(found.forward, base.effects, base.values, base.onset)
    force = found.forward.predict(settings) + change + found.search.whitener.drawn(1, rng)[:, :, 0]
    forward = copy.copy(found.forward)
    forward.touches = dataclasses.replace(t, force=np.einsum("nji,nj->ni", t.frame[t.press], force))
    search = Search(
        forward, base.modulus, nuisance=found.search.nuisance, options=found.search.options,
        site_sd=found.site_sd, finite_strain=effect("finite_strain"),
    )  # fmt: skip
    search.starts = found.search.starts
    return set(attribute(search, tried).chosen)
