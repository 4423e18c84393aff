"""The comparison's page and pictures: errors by press, predicted against measured, stiffness by place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.comparison import HOMOGENEOUS, MODELS, Comparison, stiffness_along, verdict
from palpate.report.page import Page

COLOURS = {"fem": "#1d3557", "kelvin-voigt": "#e08e1b", "hunt-crossley": "#2a9d8f"}
COLOURS |= {HOMOGENEOUS: "#8d99ae", "measured": "#c1121f"}
DEPTH_M = 0.004


def write_report(path: Path | str, result: Comparison, name: str) -> Path:
    """One self-contained page; returns its path."""
    page = Page(f"Who predicts the next touch: {name}")
    words = verdict(result)
    page.lead(words[:1].upper() + words[1:] + ".")
    page.paragraph(
        "Every model is fitted to the same presses and predicts others, at other sites, along the measured "
        f"paths. Errors are rms force vectors in N; the sensor's noise alone is {result.noise_n:.3f} N. The "
        "1D models are fitted press by press and interpolated over the surface; FEM has one number for the "
        f"whole object, its Young's modulus ({HOMOGENEOUS}), or a smooth field of it where the presses that "
        f"it is fitted to ask for one: they did in {sum(f is not None for f in result.fields)} of "
        f"{len(result.fields)} folds."
    )
    page.heading("Held-out palpations and regions")
    rows = [
        ["folds over sites", len(result.presses), *(result.rmse_n[m] for m in MODELS), *("" for _ in MODELS)]
    ]
    for r in result.regions:
        bias = [f"{100 * r.bias[m]:+.0f} %" for m in MODELS]
        rows.append([r.region.name, int(r.region.members.sum()), *(r.rmse_n[m] for m in MODELS), *bias])
    page.table(["held out", "presses", *(f"{m}, N" for m in MODELS), *(f"bias {m}" for m in MODELS)], rows)
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
    page.heading("What it means")
    page.paragraph(
        "The 1D models need no mesh and no base, and cost nothing to compute; inside a dense cloud of "
        "touches they follow the object. Where nobody touched they repeat what the nearest touches felt, "
        "and they have no tangential force. FEM carries shape and base to untouched places, and is as "
        "good as the shape."
    )
    return page.write(path)


def by_press(result: Comparison) -> Figure:
    """Error of each press for each model."""
    figure = Figure(figsize=(8, 3.2))
    draw_by_press(result, figure.subplots())
    return figure


def draw_by_press(result: Comparison, ax: Axes) -> None:
    """The same on axes that are there."""
    order = np.argsort(result.press_rmse_n["fem"])
    for name in MODELS:
        ax.plot(result.press_rmse_n[name][order], "o-", ms=4, lw=1, color=COLOURS[name], label=name)
    ax.axhline(result.noise_n, color="0.5", ls="--", lw=1, label="sensor noise")
    ax.set(xlabel="held-out press", ylabel="rms force error [N]", yscale="log")
    ax.legend(frameon=False, ncol=4, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def scatter(result: Comparison) -> Figure:
    """Predicted against measured normal force."""
    presses = result.presses
    figure = Figure(figsize=(9, 3.2))
    axes = figure.subplots(1, len(MODELS), sharex=True, sharey=True)
    press = presses.press
    normal = presses.normal[press]
    measured = (presses.force * normal).sum(axis=1)
    top = float(measured.max())
    for ax, name in zip(axes, MODELS, strict=True):
        predicted = (result.predicted[name] * normal).sum(axis=1)
        ax.plot(measured[::10], predicted[::10], ".", ms=1.5, color=COLOURS[name], rasterized=True)
        ax.plot([0, top], [0, top], color="0.3", lw=0.8)
        ax.set(title=name, xlabel="measured, N", aspect="equal")
    axes[0].set_ylabel("predicted, N")
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
    for name in MODELS:
        ax.plot(x, forces[name][order], "o-", ms=4, lw=1, color=COLOURS[name], label=name)
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
        xlabel="height above the support, mm" if sideways else "distance from the middle, mm",
        ylabel=f"normal force at {DEPTH_M * 1e3:g} mm, N",
    )
    ax.set_ylim(bottom=0)
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
