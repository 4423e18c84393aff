"""FEM against the 1D models on presses that none has seen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.diagnosis.compare.comparison import Comparison, verdict
from palpate.diagnosis.compare.models import MODELS, RIVALS
from palpate.show.comparison.figures import (
    DEPTH_M,
    across_region,
    by_press,
    called,
    compared,
    draw,
    error_bars,
    scatter,
    still,
    view,
)
from palpate.show.page import Page, file_words
from palpate.show.quantities import ERROR
from palpate.show.scenery import add_dots, add_object

if TYPE_CHECKING:
    from pyvista import Plotter

__all__ = ["as_json", "draw", "lines", "next_steps", "place", "report", "view"]


def lines(result: Comparison) -> list[str]:
    """What `print` says, with units."""
    names = list(result.rmse_n)
    text = [
        lead(result),
        f"  {meaning(result)}",
        "error where no fit has looked, mN (in brackets: by how much the force is too large):",
        f"  {'left out':<16}{'presses':>8}" + "".join(f"{name:>17}" for name in names),
    ]

    def row(label: str, count: int, rmse: dict, bias: dict | None) -> str:
        cells = [
            f"{1e3 * rmse[name]:.0f}" + (f" ({100 * bias[name]:+.0f} %)" if bias else "") for name in names
        ]
        return f"  {label:<16}{count:>8}" + "".join(f"{cell:>17}" for cell in cells)

    text.append(row("single sites", len(result.presses), result.rmse_n, None))
    for r in result.regions:
        text.append(row(r.region.name, int(r.region.members.sum()), r.rmse_n, r.bias))
    return [
        *text,
        f"beside: the sensor's noise {1e3 * result.noise_n:.0f} mN, a constant push instead of a model "
        f"{1e3 * result.constant_n:.0f} mN",
        verdict(result),
    ]


def as_json(result: Comparison) -> dict[str, Any]:
    """The contract's keys, and what stands behind them."""
    return {
        "palpations": len(result.presses),
        "rmse_n": result.rmse_n,
        "relative_rmse": result.relative_rmse,
        "regions": [
            {
                "name": r.region.name,
                "palpations": int(r.region.members.sum()),
                "rmse_n": r.rmse_n,
                "relative_rmse": r.relative_rmse,
                "bias": r.bias,
            }
            for r in result.regions
        ],
        "wins": {name: result.wins(name) for name in ("fem", *RIVALS)},
        "noise_n": result.noise_n,
        "constant_rmse_n": result.constant_n,
        "young_modulus_pa": result.moduli_pa,
        "folds_with_a_field": sum(field is not None for field in result.fields),
    }


def place(result: Comparison, plotter: Plotter) -> None:
    """The object, each press coloured by the FEM's error."""
    add_object(plotter, result.model)
    error = result.press_rmse_n["fem"] * 1e3
    label = "rms error of FEM, press held out [mN]"
    add_dots(plotter, result.presses.point, error, label=label, colour_map=ERROR.colour_map)


def report(result: Comparison, path: Path | str) -> Path:
    """One self-contained page; returns its path."""
    recording = result.recording
    assert recording is not None, "only what `compare` returned knows its recording"
    page = Page(f"Who predicts the next touch: {recording.name}")
    page.lead(lead(result))
    page.paragraph(meaning(result))
    page.next_steps(next_steps(result))
    page.view(
        view(result),
        still(result),
        "Left: FEM's error at each press, held out of every fit. Right: the press that it predicts worst.",
        result.model,
    )
    names = compared(result)
    page.figure(error_bars(result), "Error at places that were held out of every fit, of each model.")
    page.paragraph(
        "Every model is fitted to the same presses and predicts others, at other sites, along the measured "
        "paths. Errors are root mean squares of the force vector; the sensor's noise alone is "
        f"{1e3 * result.noise_n:.0f} mN. The 1D models are fitted press by press and interpolated over the "
        "surface; FEM has one number for the whole object, its Young's modulus, or a smooth field of it "
        "where the presses that it is fitted to ask for one: they did in "
        f"{sum(f is not None for f in result.fields)} of {len(result.fields)} fits."
    )
    for name in (n for n in names if n not in MODELS):
        page.paragraph(
            f"{name} was run along the recorded path; its modulus is fitted to the same presses, as its "
            "force goes with it."
        )
    page.heading("What was left out of the fits")
    rows = [
        [
            "single sites",
            len(result.presses),
            *(f"{1e3 * result.rmse_n[m]:.0f}" for m in names),
            *("–" for _ in names),
        ]
    ]
    for r in result.regions:
        bias = [f"{100 * r.bias[m]:+.0f} %" for m in names]
        rows.append(
            [r.region.name, int(r.region.members.sum()), *(f"{1e3 * r.rmse_n[m]:.0f}" for m in names), *bias]
        )
    off, large = (f"{called(m)} [mN]" for m in names), (f"{called(m)}: force too large by" for m in names)
    page.table(["left out", "presses", *off, *large], rows)
    for r in result.regions:
        page.paragraph(f"{r.region.name}: {r.region.words}.")
    page.figure(by_press(result), "Error of every press, left out of the fits, sorted by FEM's.")
    page.figure(
        scatter(result),
        "Force into the surface, predicted against measured, of presses left out of the fits.",
    )
    for r in result.regions:
        if r.region.name in ("top-centre", "base-band"):
            page.figure(
                across_region(result, r.region.members),
                f"Force at {DEPTH_M * 1e3:g} mm by place with {r.region.name} left out of every fit; "
                "red: the left-out presses as measured.",
            )
    page.heading("What each model is made for")
    page.paragraph(
        "The 1D models need no mesh and no base, and cost nothing to compute; inside a dense cloud of "
        "touches they follow the object. Where nobody touched they repeat what the nearest touches felt, "
        "and they have no tangential force. FEM carries shape and base to untouched places, and is as "
        "good as the shape."
    )
    page.result(result.as_json())
    return page.write(path)


def next_steps(result: Comparison) -> list[str]:
    """What to do with the answer."""
    model = file_words(result.model.path, "MODEL")
    recording = file_words(None if result.recording is None else result.recording.path, "REC")
    return [
        f"feel it: `palpate touch {model} --beside hunt-crossley`",
        f"ask what the FEM still leaves out: `palpate diagnose {recording} --model {model}`",
    ]


def lead(result: Comparison) -> str:
    """Which model predicts the next touch best, and by how much."""
    best = min(RIVALS, key=lambda name: result.rmse_n[name])
    ratio = result.rmse_n[best] / max(result.rmse_n["fem"], 1e-12)
    if ratio >= 1.05:
        return (
            f"The FEM predicts a touch that it has not seen {ratio:.1f} times better than the better of the "
            f"two 1D models ({called(best)})."
        )
    if ratio > 0.95:
        return f"The FEM and the better of the two 1D models ({called(best)}) predict the next touch alike."
    return f"A 1D model ({called(best)}) predicts the next touch {1 / ratio:.1f} times better than the FEM."


def meaning(result: Comparison) -> str:
    """What the errors mean for a hand, in a sentence or two."""
    best = min(RIVALS, key=lambda name: result.rmse_n[name])
    fem, other, noise = (1e3 * v for v in (result.rmse_n["fem"], result.rmse_n[best], result.noise_n))
    words = (
        f"At a place that it has not seen the FEM is {fem:.0f} mN off, {called(best)} {other:.0f} mN, of "
        f"which the sensor's noise is {noise:.0f} mN."
    )
    if result.rmse_n["fem"] < 1.3 * result.noise_n:
        words += " The FEM's share of its error is smaller than what the sensor can tell."
    return words
