"""The pictures of a diagnosis, and its view: where on the object, one press, what each effect takes away."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from diagnose.verdict.result import Diagnosis
from mechanics.model import Model
from palpate.show.diagnosis.gaps import (
    beside,
    diagnosed,
    gap_at,
    gap_of,
    known,
    press_gaps,
    ranked,
    residual_with,
    shown_entries,
    sideways,
    sites_of,
    with_strain,
    worst_press,
)
from palpate.show.diagnosis.words import percent
from palpate.show.model_view import facing, usual_colourings, view_of_presses
from palpate.show.object3d import Colours, draw_object, view_axes
from palpate.show.page import new_figure
from palpate.show.quantities import ERROR, MODULUS
from palpate.show.view3d import View
from palpate.show.view3d_parts import Colouring, Line
from render.felt_surface import felt_surface

MEASURED, IDEAL, IMPROVED, PALE = "#1d3557", "#e76f51", "#2a9d8f", "#c9c9c9"


def first_picture(model: Model, result: Diagnosis) -> Any:
    """Where on the object, and how it looks in the press that differs most."""
    figure = new_figure(10, 3.9, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.1, 1.05])
    _object(left, model, result)
    _press(right, result, worst_press(result))
    right.set_title("a press there", fontsize=11)
    right.legend(fontsize=8.5, frameon=False)
    return figure


def gains_picture(result: Diagnosis) -> Any:
    """What each effect takes away."""
    bars = len(shown_entries(result))
    figure = new_figure(9, 1.3 + 0.36 * bars, layout="constrained")
    draw(result, figure.subplots())
    return figure


def view(result: Diagnosis) -> View:
    """The object by its gap; each press as measured, simulated, with what was found and with each effect."""
    model = diagnosed(result)[1]
    t, before, after = gap_of(result)
    each = press_gaps(result)

    def line(name: str, residual: np.ndarray, kind: str, shown: bool = True) -> Line:
        return Line(name, t.local_force - residual, kind, shown)

    lines = [line("measured", np.zeros_like(before), "measured"), line("simulated", before, "rendered")]
    if result.effects:
        lines.append(line("with what was found", after, "found"))
    lines += [
        line(f"with {beside(result, e.name)}", residual, "effect", False)
        for e in shown_entries(result)
        if (residual := residual_with(result, e.name)) is not None
    ]
    error = Colouring(
        ERROR,
        None,
        each,
        "Measured less simulated, root mean square over each press; between presses what is near.",
    )
    force = "sideways" if sideways(result) else "into"
    return view_of_presses(model, t, [error, *usual_colourings(model, t)], lines, worst_press(result), force)


def _object(ax: Any, model: Model, result: Diagnosis) -> None:
    """Seen from where the largest difference is in front: a ring is never drawn through the object."""
    places = sites_of(result)
    values = gap_at(result, felt_surface(model).points) * ERROR.scale
    worst = np.array(result.where.worst[0][:3])
    t = gap_of(result)[0]
    azimuth = facing(model.support.normal, t.normal[int(np.argmin(np.linalg.norm(t.point - worst, axis=1)))])
    draw_object(ax, model, Colours(values, ERROR), touches=places, azimuth_deg=azimuth)
    seen = view_axes(model.support.normal, 25.0, azimuth)
    x, y, _ = (worst - model.mesh.points.mean(axis=0)) @ seen.T * 1e3
    ax.scatter([x], [y], s=190, facecolors="none", edgecolors=IMPROVED, linewidths=2.2, zorder=4)
    ax.set_title("on the object (dots: places touched, ring: largest)", fontsize=11)


def modulus_picture(better: Model, result: Diagnosis) -> Any:
    """Young's modulus right under the surface, in the model with what was found."""
    mesh = better.mesh
    modulus = better.material.young_modulus_pa * better.surface_ratio[mesh.touchable_elements]
    centres = mesh.points[mesh.touchable_surface[:, :3]].mean(axis=1)
    near = np.exp(-((cdist(felt_surface(better).points, centres) / better.mesh_size_m) ** 2)) + 1e-12
    figure = new_figure(6, 3.9, layout="constrained")
    colours = Colours(near @ modulus / near.sum(axis=1) / 1e3, replace(MODULUS, name="Young's modulus"))
    draw_object(figure.subplots(), better, colours, touches=sites_of(result))
    return figure


def _press(ax: Any, result: Diagnosis, press: int) -> None:
    t, before, after = gap_of(result)
    rows = (t.press == press) & t.counted
    clock = t.t[rows] - t.onset_s[press]
    measured = t.local_force[rows]
    along = np.array([1.0, 0.0, 0.0])
    if sideways(result):
        pull = (measured * np.linalg.norm(measured[:, 1:], axis=1)[:, None]).sum(axis=0) * [0.0, 1.0, 1.0]
        along = pull / max(float(np.linalg.norm(pull)), 1e-12)
    ax.plot(clock, measured @ along, color=MEASURED, lw=1.8, label="measured")
    ax.plot(clock, (measured - before[rows]) @ along, color=IDEAL, lw=1.2, label="simulated")
    if result.effects:
        ax.plot(
            clock, (measured - after[rows]) @ along, color=IMPROVED, lw=1.2, ls="--",
            label="simulated with what was found",
        )  # fmt: skip
    ax.set(
        xlabel="time since first touch [s]",
        ylabel=f"force {'sideways' if sideways(result) else 'into the surface'} [N]",
    )
    ax.spines[["top", "right"]].set_visible(False)


def draw(result: Diagnosis, ax: Any) -> None:
    """The share of the gap that each effect closes at places not fitted, best first; hatched: what finite
    strain, which an effect was tried beside, closes by itself."""
    entries = shown_entries(result)
    colours = [
        IMPROVED if e.name in result.effects else "#f4a261" if e.name in result.candidates else PALE
        for e in entries
    ]
    values = [float(np.clip(e.gap_closed or 0.0, 0.0, 1.0)) for e in entries]
    names = [beside(result, e.name) for e in entries]
    ax.barh(names, values, color=colours)
    strain = next((e.gap_closed or 0.0 for e in result.entries if e.name == known()), 0.0)
    both = [
        float(np.clip(strain, 0.0, v)) * with_strain(result, e.name)
        for v, e in zip(values, entries, strict=True)
    ]
    if any(both):
        ax.barh(
            names,
            both,
            color="none",
            edgecolor="#4a5560",
            hatch="////",
            lw=0,
            label=f"by {known().replace('_', ' ')} itself",
        )
        ax.legend(fontsize=8.5, frameon=False, loc="lower right")
    for k, (value, entry) in enumerate(zip(values, entries, strict=True)):
        worse = (entry.gap_closed or 0.0) < 0
        ax.text(value + 0.015, k, "none (worse)" if worse else percent(value), va="center", fontsize=8.5)
    ax.invert_yaxis()
    ax.set(xlim=(0, 1.12), xlabel="share of the difference that it takes away")
    ax.set_xticks([0, 0.5, 1], ["0 %", "50 %", "100 %"])
    ax.set_title("effects tried (green: named, orange: not ruled out)", fontsize=11)
    ax.spines[["top", "right"]].set_visible(False)


def curves_picture(result: Diagnosis) -> Any:
    """The mean gap along depth and along speed."""
    figure = new_figure(11, 3.0, layout="constrained")
    names = ("depth (mm)", "speed of pressing (mm/s)")
    for ax, name, colour in zip(figure.subplots(1, 2, sharey=True), names, (MEASURED, MEASURED), strict=True):
        x, mean, error = result.where.curves[name]
        ax.errorbar(x, mean * 1e3, error * 1e3, marker="o", color=colour)
        ax.axhline(0, color="#999999", lw=0.8)
        ax.set_xlabel(
            name.replace("(", "[").replace(")", "]") + (", going in positive" if "speed" in name else "")
        )
        ax.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("measured less simulated [mN]")
    return figure


def presses_picture(result: Diagnosis, count: int = 4) -> Any:
    """Force against time of the presses with the largest gap, after the first."""
    shown = [press for press in ranked(result) if press != worst_press(result)][:count]
    figure = new_figure(13, 3.2, layout="constrained")
    for ax, press in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        _press(ax, result, int(press))
    figure.axes[0].legend(fontsize=8, frameon=False)
    return figure
