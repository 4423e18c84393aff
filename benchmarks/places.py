"""How far places of sound objects are from the law, over what its bound and the surface's error say.

Of a work folder of `palpate bench diagnose`: every control that is prepared there. The likelihood of its
presses by the covariance that a diagnosis weighs with, the modulus fitted, over both factors on a place's own
width (mechanics.law_errors.Stiffness): the likeliest pair, and its spread over resampled objects.
"""

from __future__ import annotations

import argparse
import copy
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from palpate.diagnosis.pipeline import measure, search_of
from palpate.diagnosis.search.descent import Descent
from palpate.diagnosis.search.site_stiffness import site_stiffness_sd
from palpate.mechanics.errors import OptionError, PalpateError
from palpate.mechanics.law_errors import Stiffness
from palpate.mechanics.model.files import read_model
from palpate.mechanics.progress import Clock, silent
from palpate.mechanics.recording.recording import read_recording

BOUND = (0.0, 0.35, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
SURFACE = (0.0, 0.2, 0.4, 0.75, 1.2, 2.5)
"""Factors that are tried."""
RESAMPLES = 400


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the prepared cases are."""
    parser.add_argument("--work", type=Path, default=Path("bench-diagnose"), help="folder of prepared cases")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Weigh every control, print the sum over all."""
    models = (arguments.work / "models").glob("*-none-*")
    found = []
    for path in sorted(path for path in models if path.is_dir()):
        try:
            found.append(log_likelihood(arguments.work, path.name))
        except PalpateError as error:
            print(f"{path.name}: left out ({error})")
    if not found:
        raise OptionError(f"{arguments.work}: no control is prepared there")
    each = np.array(found)
    total = each.sum(axis=0)
    print(table(["bound \\ surface", *(f"{b:g}" for b in SURFACE)], [
        [f"{a:g}", *(f"{x:.0f}" for x in row)] for a, row in zip(BOUND, total - total.max(), strict=True)
    ]))  # fmt: skip
    rng = np.random.default_rng(0)
    drawn = [likeliest(each[rng.integers(0, len(each), len(each))].sum(axis=0)) for _ in range(RESAMPLES)]
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    of = (("law's bound", Stiffness.bound.value), ("surface's error", Stiffness.surface.value))
    figures = [
        Figure(f"likeliest factor on the {what}, in use {used:g}", value, (a, b))
        for (what, used), value, a, b in zip(of, likeliest(total), low, high, strict=True)
    ]
    for figure, a, b in zip(figures, low, high, strict=True):
        print(f"{figure.what}: {figure.value:g} (95 %: {a:g} to {b:g})")
    return {"objects": len(each), "figures": figures}


def likeliest(total: np.ndarray) -> tuple[float, float]:
    """The factors of the greatest log likelihood (BOUND, SURFACE)."""
    i, j = np.unravel_index(np.argmax(total), total.shape)
    return BOUND[i], SURFACE[j]


def log_likelihood(work: Path, name: str) -> np.ndarray:
    """(BOUND, SURFACE) of an object's presses. Raises PalpateError where they cannot be weighed."""
    recording, model = read_recording(work / f"{name}.toml"), read_model(work / "models" / name)
    rules = AttributionOptions()
    corrected = measure(recording, model, DiagnoseOptions(), rules, silent, Clock())
    search = search_of(corrected, NuisanceOptions(), rules)
    forward, found = search.forward, search.judge([]).found
    left = Descent(forward, search.whitener, (), None).residual(found.values, found.onset)
    made = np.empty((len(BOUND), len(SURFACE)))
    for i, bound in enumerate(BOUND):
        for j, surface in enumerate(SURFACE):
            widths = NuisanceOptions(law_bound=bound, surface=surface)
            other = copy.copy(search)
            other.nuisance, other.site_sd = widths, site_stiffness_sd(forward, widths)
            other.renew(found)
            whitener = other.whitener
            shown = Descent(forward, whitener, (), None).effective(left, found.onset)
            gram = whitener.gram(np.stack([shown, found.jacobian[:, :, 0]], axis=2)).sum(axis=0)
            squares = gram[0, 0] - gram[0, 1] ** 2 / gram[1, 1]
            made[i, j] = -0.5 * squares - whitener.volume.sum()
    return made
