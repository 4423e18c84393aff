"""The pictures of a diagnosis: where on the object, one press in time, what each effect gains, the curves."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from diagnose.result import Diagnosis
from mechanics.model import Model
from mechanics.presses import Presses
from palpate.report.object3d import draw_object, view_axes
from render.felt import felt_surface

MEASURED, IDEAL, IMPROVED, PALE = "#1d3557", "#e76f51", "#2a9d8f", "#c9c9c9"
SPREAD_M = 0.015


def first_picture(model: Model, result: Diagnosis) -> Any:
    """Where on the object, how it looks in the press that differs most, and what each effect would gain."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 3.9), layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=[1.1, 1.05, 1])
    _object(left, model, result)
    _press(middle, result, int(_ranked(result)[0]))
    middle.set_title("the press that differs most", fontsize=11)
    middle.legend(fontsize=8.5, frameon=False)
    gains(right, result)
    return figure


def _ranked(result: Diagnosis) -> np.ndarray:
    """Presses, the one with the largest gap first."""
    t, before, _ = gap_of(result)
    each = np.bincount(t.press, weights=(before**2).sum(axis=1) * t.counted, minlength=len(t))
    return np.argsort(-each)


def sites_of(result: Diagnosis) -> np.ndarray:
    """(k, 3) m, the places that were touched."""
    return gap_of(result)[0].site_point


def gap_of(result: Diagnosis) -> tuple[Presses, np.ndarray, np.ndarray]:
    """(touches, gap (n, 3) N without any effect, gap with those found), of a diagnosis `diagnose` made."""
    assert result.forward is not None, "only what `diagnose` returned holds its touches"
    assert result.residual_before is not None and result.residual_after is not None
    return result.forward.touches, result.residual_before, result.residual_after


def gap_at(result: Diagnosis, points: np.ndarray) -> np.ndarray:
    """(n,) N, the rms gap at points (n, 3) m: that of the sites, spread over 15 mm."""
    distance = cdist(points, sites_of(result))
    weight = np.exp(-((distance / SPREAD_M) ** 2)) + 1e-9
    return (weight @ result.where.site_rmse) / weight.sum(axis=1)


def _object(ax: Any, model: Model, result: Diagnosis) -> None:
    places = sites_of(result)
    values = gap_at(result, felt_surface(model).points) * 1e3
    draw_object(ax, model, values, label="difference (mN)", colour_map="magma", touches=places)
    view = view_axes(model.support.normal, 25.0, 35.0)
    worst = (np.array(result.where.worst[0][:3]) - model.mesh.points.mean(axis=0)) @ view.T * 1e3
    ax.scatter(
        [worst[0]], [worst[1]], s=190, facecolors="none", edgecolors=IMPROVED, linewidths=2.2, zorder=4
    )
    ax.set_title("on the object (dots: places touched, ring: largest)", fontsize=11)


def modulus_picture(better: Model, result: Diagnosis) -> Any:
    """Young's modulus right under the surface, in the model with what was found."""
    from matplotlib.figure import Figure

    mesh = better.mesh
    modulus = better.material.young_modulus_pa * better.surface_ratio[mesh.touchable_elements]
    centres = mesh.points[mesh.touchable_surface[:, :3]].mean(axis=1)
    near = np.exp(-((cdist(felt_surface(better).points, centres) / better.mesh_size_m) ** 2)) + 1e-12
    figure = Figure(figsize=(6, 3.9), layout="constrained")
    draw_object(
        figure.subplots(), better, near @ modulus / near.sum(axis=1) / 1e3, label="Young's modulus (kPa)",
        colour_map="viridis", touches=sites_of(result),
    )  # fmt: skip
    return figure


def _press(ax: Any, result: Diagnosis, press: int) -> None:
    t, before, after = gap_of(result)
    rows = (t.press == press) & t.counted
    clock = t.t[rows] - t.onset_s[press]
    force = t.local_force[rows, 0]
    ax.plot(clock, force, color=MEASURED, lw=1.8, label="measured")
    ax.plot(clock, force - before[rows, 0], color=IDEAL, lw=1.2, label="simulated")
    if result.effects:
        ax.plot(
            clock, force - after[rows, 0], color=IMPROVED, lw=1.2, ls="--",
            label="simulated with what was found",
        )  # fmt: skip
    ax.set(xlabel="time since first touch (s)", ylabel="force into the surface (N)")
    ax.spines[["top", "right"]].set_visible(False)


def gains(ax: Any, result: Diagnosis) -> None:
    """The share of the gap that each effect alone would close on places not fitted, best first."""
    entries = [e for e in result.entries if e.gap_closed is not None][:7]
    colours = [
        IMPROVED if e.name in result.effects else "#f4a261" if e.name in result.candidates else PALE
        for e in entries
    ]
    values = [float(np.clip(e.gap_closed or 0.0, 0.0, 1.0)) for e in entries]
    ax.barh([e.name.replace("_", " ") for e in entries], values, color=colours)
    for k, value in enumerate(values):
        ax.text(value + 0.015, k, f"{value:.0%}", va="center", fontsize=8.5)
    ax.invert_yaxis()
    ax.set(xlim=(0, 1.12), xlabel="share of the difference that it takes away alone")
    ax.set_xticks([0, 0.5, 1], ["0 %", "50 %", "100 %"])
    ax.set_title("effects tried (green: named, orange: not ruled out)", fontsize=11)
    ax.spines[["top", "right"]].set_visible(False)


def curves_picture(result: Diagnosis) -> Any:
    """The mean gap along depth and along speed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.0), layout="constrained")
    names = ("depth (mm)", "speed of pressing (mm/s)")
    for ax, name, colour in zip(figure.subplots(1, 2, sharey=True), names, (MEASURED, IDEAL), strict=True):
        x, mean, error = result.where.curves[name]
        ax.errorbar(x, mean * 1e3, error * 1e3, marker="o", color=colour)
        ax.axhline(0, color="#999999", lw=0.8)
        ax.set_xlabel(name + (", going in positive" if "speed" in name else ""))
        ax.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("measured - simulated (mN)")
    return figure


def presses_picture(result: Diagnosis, count: int = 4) -> Any:
    """Force against time of the presses with the largest gap, after the first."""
    from matplotlib.figure import Figure

    shown = _ranked(result)[1 : 1 + count]
    figure = Figure(figsize=(13, 3.2), layout="constrained")
    for ax, press in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        _press(ax, result, int(press))
    figure.axes[0].legend(fontsize=8, frameon=False)
    return figure
