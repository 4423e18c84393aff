"""How far places of sound objects are from the law, over what its bound and the surface's error say.

Of a work folder of `palpate bench diagnose`: every control that is prepared there. Each place's stiffness
over that of all, with its standard error by noise and repeats; the two factors that make these likeliest
(mechanics.law_errors.Stiffness), the modulus of each object free.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize

from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions, NuisanceOptions
from palpate.diagnosis.pipeline import measure, search_of
from palpate.diagnosis.search.site_stiffness import bound_sd, site_factors, surface_error
from palpate.mechanics.errors import OptionError, PalpateError
from palpate.mechanics.law_errors import Stiffness
from palpate.mechanics.model.files import read_model
from palpate.mechanics.progress import Clock, silent
from palpate.mechanics.recording.recording import read_recording

MOST_ERROR = 0.05
"""Standard error of a place's stiffness beyond which it says nothing."""
LEAST_PLACES = 6
RESAMPLES = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where the prepared cases are."""
    parser.add_argument("--work", type=Path, default=Path("bench-diagnose"), help="folder of prepared cases")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure every control, fit, print a row an object."""
    prepared = sorted(path.name for path in (arguments.work / "models").glob("*-none-*"))
    found = places_of(prepared, arguments.work)
    if not found:
        raise OptionError(f"{arguments.work}: no prepared control there with {LEAST_PLACES} places that tell")
    rows = []
    for name, x in found.items():
        shares = (x[:, 0].std(), *np.sqrt((x[:, 1:] ** 2).mean(axis=0)))
        rows.append([name, str(len(x)), *(f"{100 * share:.1f} %" for share in shares)])
    print(table(["object", "places", "rms off", "of it noise", "bound", "surface"], rows))
    each = list(found.values())
    factors, rng = likeliest(each), np.random.default_rng(0)
    drawn = [likeliest([each[i] for i in rng.integers(0, len(each), len(each))]) for _ in range(RESAMPLES)]
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    used = (Stiffness.bound.value, Stiffness.surface.value)
    figures = [
        Figure(f"factor on the {what}, in use {now:g}", float(f), (float(a), float(b)), "1")
        for what, now, f, a, b in zip(
            ("law's bound", "surface's error"), used, factors, low, high, strict=True
        )
    ]
    for figure, a, b in zip(figures, low, high, strict=True):
        print(f"{figure.what}: {figure.value:.2f} ({a:.2f} to {b:.2f})")
    return {"objects": len(each), "places": sum(map(len, each)), "figures": figures}


def places_of(names: list[str], work: Path) -> dict[str, np.ndarray]:
    """{recording: (s, 4) a place: stiffness over the law's, its standard error, one standard deviation of the
    law's bound, the surface's error over the height}; of those that tell."""
    found = {}
    for name in names:
        recording = read_recording(work / f"{name}.toml")
        options, rules = DiagnoseOptions(), AttributionOptions()
        try:
            corrected = measure(
                recording, read_model(work / "models" / name), options, rules, silent, Clock()
            )
        except PalpateError:
            continue
        forward = corrected.forward
        search = search_of(corrected, NuisanceOptions(), rules)
        t = forward.touches
        factor, error = site_factors(search.judge([]).found, t)
        first = np.array([np.flatnonzero(t.site == s)[0] for s in range(t.sites)])
        rows = np.column_stack([factor, error, bound_sd(forward)[first], surface_error(forward)[first]])
        rows = rows[error < MOST_ERROR]
        if len(rows) >= LEAST_PLACES:
            found[name] = rows
    return found


def likeliest(objects: list[np.ndarray]) -> np.ndarray:
    """(2,) factors on the bound and on the surface's error."""

    def missed(logs: np.ndarray) -> float:
        a, b = np.exp(logs)
        total = 0.0
        for factor, error, bound, surface in (x.T for x in objects):
            variance = error**2 + (a * bound) ** 2 + (b * surface) ** 2
            level = np.average(factor, weights=1 / variance)
            total += ((factor - level) ** 2 / variance + np.log(variance)).sum() + np.log(
                (1 / variance).sum()
            )
        return 0.5 * total

    return np.exp(minimize(missed, np.log([1.0, 0.5]), method="Nelder-Mead").x)
