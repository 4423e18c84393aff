"""The comparison's page."""

from __future__ import annotations

from pathlib import Path

from diagnose.compare.comparison import Comparison
from diagnose.compare.models import MODELS, RIVALS
from palpate.show.comparison.figures import (
    DEPTH_M,
    across_region,
    by_press,
    called,
    compared,
    error_bars,
    scatter,
    still,
    view,
)
from palpate.show.page import Page, file_words


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
