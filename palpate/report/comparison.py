"""The comparison's page and pictures: errors by press, predicted against measured, stiffness by place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from diagnose.compare.comparison import Comparison, verdict
from diagnose.compare.models import HOMOGENEOUS, MODELS, RIVALS, stiffness_along
from mechanics.recording import Recording
from palpate.report.object3d import draw_object, spread_over
from palpate.report.page import Page
from palpate.report.quantities import ERROR
from palpate.report.view3d import (
    Colouring,
    Line,
    View,
    facing,
    local,
    thing_of,
    traces_of,
    usual_colourings,
)
from render.felt import felt_surface

COLOURS = {"fem": "#1d3557", "kelvin-voigt": "#e08e1b", "hunt-crossley": "#2a9d8f"}
COLOURS |= {HOMOGENEOUS: "#8d99ae", "measured": "#c1121f"}
_MARKS = ("o", "^", "s", "x")
DEPTH_M = 0.004


def write_report(path: Path | str, result: Comparison, recording: Recording) -> Path:
    """One self-contained page; returns its path."""
    page = Page(f"Who predicts the next touch: {recording.name}")
    words = verdict(result)
    page.lead(words[:1].upper() + words[1:] + ".")
    page.paragraph(meaning(result))
    model = result.model.path or "MODEL"
    page.next_step(
        f"What to do next: feel it: `palpate touch {model} --beside hunt-crossley`; ask what the FEM still "
        f"leaves out: `palpate diagnose {recording.path or 'REC'} --model {model}`."
    )
    page.view(
        view_of(result),
        still(result),
        "Left: FEM's error at each press, held out of every fit. Right: the press that it predicts worst.",
    )
    page.paragraph(
        "Every model is fitted to the same presses and predicts others, at other sites, along the measured "
        f"paths. Errors are root mean squares of the force vector; the sensor's noise alone is "
        f"{1e3 * result.noise_n:.0f} mN. The "
        "1D models are fitted press by press and interpolated over the surface; FEM has one number for the "
        f"whole object, its Young's modulus ({HOMOGENEOUS}), or a smooth field of it where the presses that "
        f"it is fitted to ask for one: they did in {sum(f is not None for f in result.fields)} of "
        f"{len(result.fields)} folds."
    )
    page.heading("Held-out palpations and regions")
    names = compared(result)
    rows = [
        [
            "folds over sites",
            len(result.presses),
            *(1e3 * result.rmse_n[m] for m in names),
            *("–" for _ in names),
        ]
    ]
    for r in result.regions:
        bias = [f"{100 * r.bias[m]:+.0f} %" for m in names]
        rows.append([r.region.name, int(r.region.members.sum()), *(1e3 * r.rmse_n[m] for m in names), *bias])
    page.table(["held out", "presses", *(f"{m} [mN]" for m in names), *(f"bias {m}" for m in names)], rows)
    for r in result.regions:
        page.paragraph(f"{r.region.name}: {r.region.words}.")
    page.figure(by_press(result), "Held-out error of every press (folds over sites), sorted by FEM's.")
    page.figure(scatter(result), "Normal force, predicted against measured, every held-out contact sample.")
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
    return page.write(path)


def compared(result: Comparison) -> tuple[str, ...]:
    """The models that are shown: the FEM of one modulus only where some fold asked for a field."""
    return (
        MODELS if any(f is not None for f in result.fields) else tuple(m for m in MODELS if m != HOMOGENEOUS)
    )


def meaning(result: Comparison) -> str:
    """What the errors mean for a hand, in a sentence or two."""
    best = min(RIVALS, key=lambda name: result.rmse_n[name])
    fem, other, noise = (1e3 * v for v in (result.rmse_n["fem"], result.rmse_n[best], result.noise_n))
    words = (
        f"At a place that it has not seen the FEM is {fem:.0f} mN off, {best} {other:.0f} mN, of which the "
        f"sensor's noise is {noise:.0f} mN."
    )
    if result.rmse_n["fem"] < 1.3 * result.noise_n:
        words += " The FEM's share of its error is smaller than what the sensor can tell."
    return words


def view_of(result: Comparison) -> View:
    """The object by the error of each model; each press as measured and as predicted while held out."""
    presses, names = result.presses, compared(result)
    lines = [Line("measured", local(presses, presses.force), "measured")]
    for name in names:
        kind = "rendered" if name == "fem" else "effect"
        lines.append(Line(name, local(presses, result.predicted[name]), kind, name in ("fem", *RIVALS)))
    words = "Root mean square of predicted less measured force over each press, held out of every fit."
    colourings = [
        Colouring(ERROR, None, result.press_rmse_n[name], words, name=f"error of {name}") for name in names
    ]
    worst = _worst(result)
    return View(
        thing_of(result.model),
        presses.point,
        [*colourings, *usual_colourings(result.model, presses)],
        traces_of(presses, lines),
        worst,
        facing(result.model.support.normal, presses.normal[worst]),
    )


def still(result: Comparison) -> Figure:
    """The same as a picture: the object by FEM's error, and the press that it predicts worst."""
    presses, model, worst = result.presses, result.model, _worst(result)
    figure = Figure(figsize=(10, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.1, 1.05])
    each = result.press_rmse_n["fem"] * ERROR.scale
    values = spread_over(felt_surface(model).points, presses.point, each)[0]
    azimuth = facing(model.support.normal, presses.normal[worst])
    draw_object(
        left, model, values, label=ERROR.label, colour_map=ERROR.colour_map, touches=presses.point,
        azimuth_deg=azimuth,
    )  # fmt: skip
    rows = presses.parts[worst]
    depth, normal = presses.depth[rows] * 1e3, presses.normal[worst]
    right.plot(depth, presses.push[rows], color=COLOURS["measured"], lw=1.8, label="measured")
    for name in ("fem", *RIVALS):
        right.plot(depth, result.predicted[name][rows] @ normal, color=COLOURS[name], lw=1.2, label=name)
    right.set(xlabel="depth [mm]", ylabel="force into the surface [N]", title=f"press {worst + 1}")
    right.legend(frameon=False, fontsize=8.5)
    right.spines[["top", "right"]].set_visible(False)
    return figure


def _worst(result: Comparison) -> int:
    return int(np.argmax(result.press_rmse_n["fem"]))


def by_press(result: Comparison) -> Figure:
    """Error of each press for each model."""
    figure = Figure(figsize=(8, 3.2))
    draw_by_press(result, figure.subplots())
    return figure


def draw_by_press(result: Comparison, ax: Axes) -> None:
    """The same on axes that are there."""
    order = np.argsort(result.press_rmse_n["fem"])
    place = np.arange(len(order))
    for k, name in enumerate(compared(result)):
        ax.plot(
            place, 1e3 * result.press_rmse_n[name][order], _MARKS[k], ms=4.5, color=COLOURS[name], label=name
        )
    ax.axhline(1e3 * result.noise_n, color="0.5", ls="--", lw=1, label="sensor noise")
    step = -(-len(order) // 20)
    ax.set_xticks(place[::step], [str(i + 1) for i in order[::step]], fontsize=8)
    ax.set(xlabel="number of the held-out press", ylabel="rms force error [mN]", yscale="log")
    for axis in (ax.yaxis.set_major_formatter, ax.yaxis.set_minor_formatter):
        axis(LogFormatter(labelOnlyBase=False, minor_thresholds=(2, 0.5)))
    ax.grid(axis="x", color="0.92", lw=0.6)
    ax.legend(frameon=False, ncol=5, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def scatter(result: Comparison) -> Figure:
    """Predicted against measured normal force."""
    presses = result.presses
    figure = Figure(figsize=(9, 3.2))
    axes = figure.subplots(1, len(compared(result)), sharex=True, sharey=True)
    press = presses.press
    normal = presses.normal[press]
    measured = (presses.force * normal).sum(axis=1)
    top = float(measured.max())
    for ax, name in zip(axes, compared(result), strict=True):
        predicted = (result.predicted[name] * normal).sum(axis=1)
        ax.plot(measured[::10], predicted[::10], ".", ms=1.5, color=COLOURS[name], rasterized=True)
        ax.plot([0, top], [0, top], color="0.3", lw=0.8)
        ax.set(title=name, xlabel="measured [N]", aspect="equal")
    axes[0].set_ylabel("predicted [N]")
    return figure


def across_region(result: Comparison, members: np.ndarray) -> Figure:
    """Force at one depth along the object where `members` were left out: top by radius, side by height."""
    presses, model = result.presses, result.model
    up = model.support.normal
    sideways = abs(float(np.mean(presses.normal[members] @ up))) < 0.5
    middle = model.mesh.points[np.unique(model.mesh.surface[:, :3])].mean(axis=0)
    offset = presses.point - middle
    flat = offset - (offset @ up)[:, None] * up
    coordinate = (presses.point - model.support.point) @ up if sideways else np.linalg.norm(flat, axis=1)
    faces_up = presses.normal @ up > 0.7
    family = ~faces_up if sideways else faces_up
    places = presses.point[family]
    order = np.argsort(coordinate[family])
    forces = stiffness_along(
        result.prepared, np.flatnonzero(~members), places, presses.normal[family], model, DEPTH_M
    )
    figure = Figure(figsize=(7, 3.4))
    ax = figure.subplots()
    x = coordinate[family][order] * 1e3
    for name in compared(result):
        ax.plot(x, forces[name][order], "o", ms=4, color=COLOURS[name], label=name)
    measured = _at_depth(result)
    for inside, face, label in ((False, "none", "measured, seen"), (True, None, "measured, left out")):
        chosen = family & (members == inside) & np.isfinite(measured)
        ax.plot(
            coordinate[chosen] * 1e3,
            measured[chosen],
            "s",
            ms=6,
            color=COLOURS["measured"],
            mfc=face,
            label=label,
        )
    ax.set(
        xlabel="height above the support [mm]" if sideways else "distance from the middle [mm]",
        ylabel=f"normal force at {DEPTH_M * 1e3:g} mm [N]",
    )
    ax.margins(y=0.15)
    ax.legend(frameon=False, fontsize=8, ncol=2)
    return figure


def _at_depth(result: Comparison) -> np.ndarray:
    """(p,) N, measured normal force on the way in at DEPTH_M; NaN where a press was shallower."""
    presses = result.presses
    values = np.full(len(presses), np.nan)
    for i in range(len(presses)):
        rows = slice(presses.starts[i], presses.starts[i + 1])
        depth = presses.depth[rows]
        peak = int(depth.argmax()) + 1
        if depth[peak - 1] >= DEPTH_M:
            near = np.abs(depth[:peak] - DEPTH_M) < 2e-4
            if near.any():
                values[i] = float((presses.force[rows][:peak][near] @ presses.normal[i]).mean())
    return values
