"""The pictures of a diagnosis, and its view: where on the object, one press, what each effect takes away."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.model.model import Model
from palpate.render.surface.felt_surface import felt_surface
from palpate.show.bars import draw_errors, height_of
from palpate.show.colours import COLOURS, colour_of
from palpate.show.diagnosis.gaps import (
    beside,
    diagnosed,
    gap_at,
    gap_of,
    press_gaps,
    ranked,
    residual_with,
    shown_entries,
    sideways,
    sites_of,
    worst_press,
)
from palpate.show.model import facing, usual_colourings, view_of_presses
from palpate.show.page import new_figure
from palpate.show.quantities import AS_RECORDED, ERROR, FITTED, MODULUS
from palpate.show.scenery import Colours, draw_object, view_axes
from palpate.show.story import Picture
from palpate.show.view3d import Colouring, Line, View
from palpate.words import spoken

_OVER_NOISE = 3.0
"""Of the noise, to which the colours of a force error go at least: what is noise is no alarm."""


def first_picture(model: Model, result: Diagnosis, simulated: str = "simplest") -> Any:
    """Where on the object, and how it looks in the press that differs most. simulated: whose force is
    diagnosed, by its name in the table of colours."""
    figure = new_figure(10, 3.9, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.1, 1.05])
    _object(left, model, result)
    _press(right, result, worst_press(result), simulated)
    right.set_title("a press there", fontsize=11)
    right.legend(fontsize=8.5, frameon=False)
    return figure


def gains_picture(result: Diagnosis) -> Any:
    """How far the simulation is off, as it is and with what was found."""
    figure = new_figure(5.5, height_of(len(_bars(result))), layout="constrained")
    draw(result, figure.subplots())
    return figure


def view(result: Diagnosis, simulated: str = "simplest") -> View:
    """The object by its gap; each press as measured, simulated, with what was found and with each effect.
    simulated: as of `first_picture`."""
    model = diagnosed(result)[1]
    t, before, after = gap_of(result)
    each = press_gaps(result)

    def line(name: str, residual: np.ndarray, kind: str, shown: bool = True) -> Line:
        return Line(name, t.local_force - residual, kind, shown)

    lines = [line("measured", np.zeros_like(before), "measured"), line("simulated", before, simulated)]
    if result.effects:
        lines.append(line("with what was found", after, "found"))
    lines += [
        line(f"with {beside(result, e.name)}", residual, "effect", False)
        for e in shown_entries(result)
        if list(result.effects) != [e.name] and (residual := residual_with(result, e.name)) is not None
    ]
    error = Colouring(
        ERROR,
        None,
        each,
        "Measured less simulated, root mean square over each press; between presses what is near, "
        "paler where it was not touched.",
        name=FITTED if simulated == "simplest" else AS_RECORDED,
        reach=_OVER_NOISE * result.noise_n,
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
    limits = 0.0, max(float(values.max()), _OVER_NOISE * result.noise_n * ERROR.scale)
    draw_object(ax, model, Colours(values, ERROR, limits), touches=places, azimuth_deg=azimuth)
    seen = view_axes(model.support.normal, 25.0, azimuth)
    x, y, _ = (worst - model.mesh.points.mean(axis=0)) @ seen.T * 1e3
    ax.scatter([x], [y], s=190, facecolors="none", edgecolors=COLOURS["touch"], linewidths=2.2, zorder=4)
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


def _press(ax: Any, result: Diagnosis, press: int, simulated: str) -> None:
    t, before, after = gap_of(result)
    rows = (t.press == press) & t.counted
    clock = t.t[rows] - t.onset_s[press]
    measured = t.local_force[rows]
    along = np.array([1.0, 0.0, 0.0])
    if sideways(result):
        pull = (measured * np.linalg.norm(measured[:, 1:], axis=1)[:, None]).sum(axis=0) * [0.0, 1.0, 1.0]
        along = pull / max(float(np.linalg.norm(pull)), 1e-12)
    ax.plot(clock, measured @ along, color=COLOURS["measured"], lw=1.8, label="measured")
    without, found = (measured - before[rows]) @ along, (measured - after[rows]) @ along
    ax.plot(clock, without, color=colour_of(simulated), lw=1.2, ls="--", label="simulated")
    if result.effects:
        ax.plot(clock, found, color=COLOURS["found"], lw=1.2, label="with what was found")
    ax.set(
        xlabel="time since first touch [s]",
        ylabel=f"force {'sideways' if sideways(result) else 'into the surface'} [N]",
    )
    ax.spines[["top", "right"]].set_visible(False)


def _bars(result: Diagnosis) -> list[tuple[str, float, str]]:
    """(what is simulated, gap N, colour): as it is, with what was found, with each that is not ruled out;
    where nothing was found, with the best that was tried."""
    bars = [("the simplest simulation", result.gap_before_n, COLOURS["simplest"])]
    if result.effects:
        bars.append((f"with {spoken(result.effects)}", result.gap_after_n, COLOURS["found"]))
    rest = [e for e in shown_entries(result) if e.name not in result.effects]
    if not result.effects and not result.candidates:
        rest = sorted(rest, key=lambda e: e.gap_after_n)[:1]
    return bars + [(f"with {beside(result, e.name)}", e.gap_after_n, COLOURS["not-ruled-out"]) for e in rest]


def draw(result: Diagnosis, ax: Any) -> None:
    """How far the simulation is off at places not fitted (mN rms): as it is, with what was found,
    with what is not ruled out; the line is the sensor's noise."""
    draw_errors(ax, _bars(result), result.noise_n, "typical difference from the measured force [mN]")


def curve_pictures(result: Diagnosis) -> list[Picture]:
    """The mean gap along depth and along speed, a picture each."""
    return [
        Picture(partial(_curve, result, "depth (mm)", "depth [mm]"), "Mean difference at each depth."),
        Picture(
            partial(_curve, result, "speed of pressing (mm/s)", "speed of the tip, going in positive [mm/s]"),
            "Mean difference at each speed of the tip.",
        ),
    ]


def _curve(result: Diagnosis, name: str, along: str) -> Any:
    figure = new_figure(5.2, 2.9, layout="constrained")
    ax = figure.subplots()
    x, mean, error = result.where.curves[name]
    ax.errorbar(x, mean * 1e3, error * 1e3, marker="o", ms=4, color=COLOURS["change"])
    ax.axhline(0, color=COLOURS["reference"], lw=0.8)
    ax.set(xlabel=along, ylabel="measured less simulated [mN]")
    ax.spines[["top", "right"]].set_visible(False)
    return figure


def press_pictures(result: Diagnosis, simulated: str = "simplest", count: int = 3) -> list[Picture]:
    """Force against time of the presses with the largest gap, after the first, a picture each."""
    shown = [int(press) for press in ranked(result) if press != worst_press(result)][:count]
    return [Picture(partial(_one_press, result, press, simulated), f"Press {press + 1}.") for press in shown]


def _one_press(result: Diagnosis, press: int, simulated: str) -> Any:
    figure = new_figure(5.2, 2.9, layout="constrained")
    ax = figure.subplots()
    _press(ax, result, press, simulated)
    ax.legend(fontsize=8.5, frameon=False)
    return figure
