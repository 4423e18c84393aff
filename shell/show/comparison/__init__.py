"""FEM against the 1D models on presses that none has seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.diagnosis.compare.comparison import Comparison, RegionResult, verdict
from palpate.diagnosis.compare.models import MODELS, RIVALS
from palpate.show import story as say
from palpate.show.comparison.figures import (
    DEPTH_M,
    across_region,
    called,
    compared,
    draw,
    error_bars,
    scatter,
    still,
    view,
)
from palpate.show.page import drawn, feel_step, file_words
from palpate.show.quantities import ERROR
from palpate.show.scenery import add_dots, add_object
from palpate.words import listed, mm, mn

if TYPE_CHECKING:
    from pyvista import Plotter

__all__ = ["KEYS", "draw", "place", "story", "view"]


def story(result: Comparison) -> say.Story:
    """Which model predicts the next touch best, then the errors and where they are."""
    yield say.Title(f"Which model predicts the next touch: {getattr(result.recording, 'name', '')}")
    yield say.Headline(lead(result))
    yield say.Detail(meaning(result))
    yield say.Next(_next_steps(result))
    yield say.TextLine("error at held-out places, mN (in brackets: by how much the force is too large):")
    names = list(compared(result))
    yield say.Rows(
        ["  left out", "presses", *names],
        _left_out(result, names, lambda error, bias: f"{error} ({bias})" if bias else error, indent="  "),
        (-18, 8, *(17 for _ in names)),
        on=say.TEXT,
    )
    yield say.TextLine(
        f"for comparison: the sensor's noise {mn(result.noise_n)}, a constant force instead of a model "
        f"{mn(result.constant_n)}"
    )
    factors = next(iter(result.prepared.sites.values())).factors
    if factors is not None:
        yield say.TextLine(f"FEM: presses solved at {factors.solved.sum()} of {len(factors.solved)} places")
    yield say.TextLine(verdict(result))
    yield say.Turned(
        lambda: view(result),
        say.Picture(
            lambda: still(result),
            "Left: FEM's error at each press, held out of every fit. Right: the press that it predicts "
            "worst.",
        ),
        result.model,
    )
    if untouched := _shown_region(result):
        yield say.Section("What happens where nobody touched?", _argument(result, untouched), unfolded=True)
    yield say.Section("How large are the errors?", _how(result))
    yield say.Section("Where are they, and what was left out of the fits?", _evidence(result))
    yield say.Section("What is each model made for?", [
        say.Sentence(
            "The 1D models need no mesh and no base, and cost nothing to compute; inside a dense cloud of "
            "touches they follow the object. At untouched places they repeat the nearest touches, "
            "and they have no tangential force. FEM carries shape and base to untouched places, and is as "
            "good as the shape."
        )
    ])  # fmt: skip


def _shown_region(result: Comparison) -> RegionResult | None:
    """The one that shows what shape and base tell: the lowest of the side, else the first."""
    return next((r for r in result.regions if r.region.name == "base-band"), next(iter(result.regions), None))


def _argument(result: Comparison, untouched: RegionResult) -> say.Story:
    """One region without touches: what each model makes of it."""
    region = untouched.region
    off = listed(f"{called(m)} {_excess(untouched.bias[m])}" for m in ("fem", *RIVALS))
    yield say.Sentence(
        f"Left out of every fit: the {region.name} ({region.words}). A 1D model repeats the nearest "
        f"presses there; the FEM knows shape and base. Their mean error of force: {off}"
    )
    yield _across(result, untouched)


def _excess(bias: float) -> str:
    """By how much a force is too large."""
    return f"{round(100 * bias):+d} %"


def _across(result: Comparison, left_out: RegionResult) -> say.Picture:
    region = left_out.region
    return say.Picture(
        lambda: across_region(result, region.members),
        f"Force at {mm(DEPTH_M, 'g')} by place with {region.name} left out of every fit; filled squares: the "
        "left-out presses as measured.",
    )


def _how(result: Comparison) -> say.Story:
    yield say.Picture(
        lambda: error_bars(result), "Error at places that were held out of every fit, of each model."
    )
    yield say.Sentence(
        "Every model is fitted to the same presses and predicts others, at other sites, along the measured "
        "paths, each from its own measured first touch, so that the shape's error is left out (a replay has "
        "it in it). Errors are root mean squares of the force vector; the sensor's noise alone is "
        f"{mn(result.noise_n)}. Along the normal alone they are {_along(result)}. The 1D models are fitted "
        "press by press and interpolated over the surface; FEM has one number for the whole object, its "
        "Young's modulus, or a smooth field of it where the presses that it is fitted to show one: they did "
        "in "
        f"{sum(f is not None for f in result.fields)} of {len(result.fields)} fits."
    )
    for name in (n for n in compared(result) if n not in MODELS):
        yield say.Detail(
            f"{name} was run along the recorded path; its modulus is fitted to the same presses, as its "
            "force goes with it."
        )


def _along(result: Comparison) -> str:
    """Each model's error along the normal alone, and the noise of that one component."""
    errors = (f"{called(m)} {mn(off)}" for m, off in result.normal_rmse_n.items())
    return listed([*errors, f"noise {mn(result.noise_n / np.sqrt(3.0))}"])


def _evidence(result: Comparison) -> say.Story:
    names = compared(result)
    off, large = (f"{called(m)} [mN]" for m in names), (f"{called(m)}: force too large by" for m in names)
    errors = _left_out(result, names, lambda error, bias: (error, bias or "–"))
    rows = [
        [what, presses, *(e for e, _ in cells), *(b for _, b in cells)] for what, presses, *cells in errors
    ]
    yield say.Rows(["left out", "presses", *off, *large], rows)
    for r in result.regions:
        yield say.Detail(f"{r.region.name}: {r.region.words}.")
    yield say.Picture(
        lambda: drawn(draw, result, 8, 3.2, layout=None),
        "Error of every press, left out of the fits, sorted by FEM's.",
    )
    yield say.Picture(
        lambda: scatter(result),
        "Force into the surface, predicted against measured, of presses left out of the fits.",
    )
    shown = _shown_region(result)
    for r in result.regions:
        if r is not shown and r.region.name in ("top-centre", "base-band"):
            yield _across(result, r)


def _left_out(
    result: Comparison, names: Sequence[str], cell: Callable[[str, str], Any], indent: str = ""
) -> list[list[Any]]:
    """What was left out, how many presses, and a cell of (error mN, bias) for each model."""
    rows: list[list[Any]] = [
        [
            f"{indent}single sites",
            len(result.presses),
            *(cell(f"{1e3 * result.rmse_n[m]:.0f}", "") for m in names),
        ]
    ]
    for r in result.regions:
        cells = (cell(f"{1e3 * r.rmse_n[m]:.0f}", _excess(r.bias[m])) for m in names)
        rows.append([f"{indent}{r.region.name}", int(r.region.members.sum()), *cells])
    return rows


_REGION: tuple[say.Key, ...] = (
    "name=region.name",
    ("palpations", lambda r: int(r.region.members.sum())),
    "rmse_n",
    "relative_rmse",
    "bias",
)
KEYS: tuple[say.Key, ...] = (
    ("palpations", lambda result: len(result.presses)),
    "rmse_n",
    "relative_rmse",
    "normal_rmse_n",
    ("regions", lambda result: [say.figures_of(r, _REGION) for r in result.regions]),
    ("wins", lambda result: {name: result.wins(name) for name in ("fem", *RIVALS)}),
    "noise_n",
    "constant_rmse_n=constant_n",
    "young_modulus_pa=moduli_pa",
    ("folds_with_a_field", lambda result: sum(field is not None for field in result.fields)),
)


def place(result: Comparison, plotter: Plotter) -> None:
    """The object, each press coloured by the FEM's error."""
    add_object(plotter, result.model)
    error = result.press_rmse_n["fem"] * 1e3
    label = "rms error of FEM, press held out [mN]"
    add_dots(plotter, result.presses.point, error, label=label, colour_map=ERROR.colour_map)


def _next_steps(result: Comparison) -> list[str]:
    model = file_words(result.model.path, "MODEL")
    recording = file_words(None if result.recording is None else result.recording.path, "REC")
    if result.model.path is None:
        return [
            feel_step(None, f"palpate reconstruct {recording} -o MODEL"),
            f"find what the FEM still leaves out: `palpate diagnose {recording}`",
        ]
    return [
        f"feel it: `palpate touch {model} --beside hunt-crossley`",
        f"find what the FEM still leaves out: `palpate diagnose {recording} --model {model}`",
    ]


def lead(result: Comparison) -> str:
    """Which model predicts the next touch best, and by how much."""
    best = min(RIVALS, key=lambda name: result.rmse_n[name])
    ratio = result.rmse_n[best] / max(result.rmse_n["fem"], 1e-12)
    if ratio >= 1.05:
        return (
            f"The FEM predicts a held-out touch {ratio:.1f} times better than the better of the "
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
        f"At a held-out place the FEM is {fem:.0f} mN off, {called(best)} {other:.0f} mN; the sensor's "
        f"noise, which is in both, is {noise:.0f} mN."
    )
    along = result.normal_rmse_n
    times = min(along[name] for name in RIVALS) / max(along["fem"], 1e-12)
    words += (
        " A 1D model has no sideways force by definition; along the normal alone the better one is "
        f"{times:.1f} times as far off as the FEM."
    )
    wins = result.wins("fem")
    words += f" Of {len(result.presses)} presses, each left out of the fits, the FEM predicts {wins} best."
    if result.rmse_n["fem"] < 1.3 * result.noise_n:
        words += " More than half of the FEM's mean squared error is the sensor's noise."
    return words
