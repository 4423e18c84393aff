"""The pictures of a diagnosis, and its view: where on the object, one press, what each effect takes away."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

from diagnose.verdict.result import Diagnosis
from mechanics.effects.base import Role
from mechanics.effects.registry import effects
from mechanics.model import Model
from mechanics.presses import Presses
from palpate.report.diagnosis_words import percent
from palpate.report.object3d import draw_object, spread_over, view_axes
from palpate.report.quantities import ERROR, MODULUS
from palpate.report.view3d import (
    Colouring,
    Line,
    View,
    facing,
    thing_of,
    traces_of,
    usual_colourings,
)
from render.felt import felt_surface

MEASURED, IDEAL, IMPROVED, PALE = "#1d3557", "#e76f51", "#2a9d8f", "#c9c9c9"
MOST_EFFECTS = 8


def first_picture(model: Model, result: Diagnosis) -> Any:
    """Where on the object, and how it looks in the press that differs most."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.1, 1.05])
    _object(left, model, result)
    _press(right, result, _worst_press(result))
    right.set_title("a press there", fontsize=11)
    right.legend(fontsize=8.5, frameon=False)
    return figure


def gains_picture(result: Diagnosis) -> Any:
    """What each effect takes away."""
    from matplotlib.figure import Figure

    bars = len(_shown_entries(result))
    figure = Figure(figsize=(9, 1.3 + 0.36 * bars), layout="constrained")
    gains(figure.subplots(), result)
    return figure


def view_of(model: Model, result: Diagnosis) -> View:
    """The object by its gap; each press as measured, simulated, with what was found and with each effect."""
    t, before, after = gap_of(result)
    each = press_gaps(result)

    def line(name: str, residual: np.ndarray, kind: str, shown: bool = True) -> Line:
        return Line(name, t.local_force - residual, kind, shown)

    lines = [line("measured", np.zeros_like(before), "measured"), line("simulated", before, "rendered")]
    if result.effects:
        lines.append(line("with what was found", after, "found"))
    lines += [
        line(f"with {beside(result, e.name)}", residual, "effect", False)
        for e in _shown_entries(result)
        if (residual := residual_with(result, e.name)) is not None
    ]
    error = Colouring(
        ERROR,
        None,
        each,
        "Measured less simulated, root mean square over each press; between presses what is near.",
    )
    first = _worst_press(result)
    return View(
        thing_of(model),
        t.point,
        [error, *usual_colourings(model, t)],
        traces_of(t, lines),
        first,
        facing(model.support.normal, t.normal[first]),
        force="sideways" if sideways(result) else "into",
    )


def sideways(result: Diagnosis) -> bool:
    """Whether the gap is in the force along the surface more than in that into it."""
    return result.where.leading.axis == "direction"


@cache
def known() -> str:
    """The effect that every solid has, which others are tried beside: finite strain."""
    return next(e.name for e in effects() if e.role is Role.KNOWN)


def residual_with(result: Diagnosis, name: str) -> np.ndarray | None:
    """(n, 3) N, measured less simulated with one effect (beside finite strain where that is part of it);
    None where it was not simulated."""
    found = result.attribution
    if found is None:
        return None
    if name == known():
        return found.deep.residual
    return found.scores[name].candidate.residual if name in found.scores else None


def with_strain(result: Diagnosis, name: str) -> bool:
    """Whether an effect was tried beside finite strain."""
    found = result.attribution
    return bool(
        found
        and name != known()
        and name in found.scores
        and known() in found.scores[name].candidate.found.names
    )


def beside(result: Diagnosis, name: str) -> str:
    """An effect's name, and finite strain where it was tried beside it."""
    return name.replace("_", " ") + (f" and {known().replace('_', ' ')}" if with_strain(result, name) else "")


def _shown_entries(result: Diagnosis) -> list[Any]:
    return [e for e in result.entries if e.gap_closed is not None][:MOST_EFFECTS]


def _ranked(result: Diagnosis) -> np.ndarray:
    """Presses, the one with the largest gap first."""
    return np.argsort(-press_gaps(result))


def press_gaps(result: Diagnosis) -> np.ndarray:
    """(p,) N, the rms gap of each press."""
    t, before, _ = gap_of(result)
    square = np.bincount(t.press, weights=(before**2).sum(axis=1) * t.counted, minlength=len(t))
    return np.sqrt(square / np.maximum(np.bincount(t.press, weights=t.counted, minlength=len(t)), 1))


def _worst_press(result: Diagnosis) -> int:
    """The one with the largest gap at the place with the largest: the place that words and ring name."""
    there = np.flatnonzero(gap_of(result)[0].site == np.argmax(result.where.site_rmse))
    return int(there[np.argmax(press_gaps(result)[there])])


def sites_of(result: Diagnosis) -> np.ndarray:
    """(k, 3) m, the places that were touched."""
    return gap_of(result)[0].site_point


def gap_of(result: Diagnosis) -> tuple[Presses, np.ndarray, np.ndarray]:
    """(touches, gap (n, 3) N without any effect, gap with those found), of a diagnosis `diagnose` made."""
    assert result.forward is not None, "only what `diagnose` returned holds its touches"
    assert result.residual_before is not None and result.residual_after is not None
    return result.forward.touches, result.residual_before, result.residual_after


def gap_at(result: Diagnosis, points: np.ndarray) -> np.ndarray:
    """(n,) N, the rms gap at points (n, 3) m: that of the sites, spread over what is near."""
    return spread_over(points, sites_of(result), result.where.site_rmse)[0]


def _object(ax: Any, model: Model, result: Diagnosis) -> None:
    """Seen from where the largest difference is in front: a ring is never drawn through the object."""
    places = sites_of(result)
    values = gap_at(result, felt_surface(model).points) * ERROR.scale
    worst = np.array(result.where.worst[0][:3])
    t = gap_of(result)[0]
    azimuth = facing(model.support.normal, t.normal[int(np.argmin(np.linalg.norm(t.point - worst, axis=1)))])
    draw_object(
        ax, model, values, label=ERROR.label, colour_map=ERROR.colour_map, touches=places, azimuth_deg=azimuth
    )
    view = view_axes(model.support.normal, 25.0, azimuth)
    x, y, _ = (worst - model.mesh.points.mean(axis=0)) @ view.T * 1e3
    ax.scatter([x], [y], s=190, facecolors="none", edgecolors=IMPROVED, linewidths=2.2, zorder=4)
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
        figure.subplots(), better, near @ modulus / near.sum(axis=1) / 1e3, label="Young's modulus [kPa]",
        colour_map=MODULUS.colour_map, touches=sites_of(result),
    )  # fmt: skip
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


def gains(ax: Any, result: Diagnosis) -> None:
    """The share of the gap that each effect closes at places not fitted, best first; hatched: what finite
    strain, which an effect was tried beside, closes by itself."""
    entries = _shown_entries(result)
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
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.0), layout="constrained")
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
    from matplotlib.figure import Figure

    shown = [press for press in _ranked(result) if press != _worst_press(result)][:count]
    figure = Figure(figsize=(13, 3.2), layout="constrained")
    for ax, press in zip(figure.subplots(1, len(shown), squeeze=False)[0], shown, strict=True):
        _press(ax, result, int(press))
    figure.axes[0].legend(fontsize=8, frameon=False)
    return figure
