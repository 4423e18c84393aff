"""The comparison's pictures: errors by press, predicted against measured, stiffness by place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.diagnosis.compare.comparison import Comparison
from palpate.diagnosis.compare.models import HOMOGENEOUS, RIVALS, stiffness_along
from palpate.render.surface.felt_surface import felt_surface
from palpate.show.bars import draw_errors, height_of
from palpate.show.colours import COLOURS, colour_of
from palpate.show.model import facing, local, usual_colourings, view_of_presses
from palpate.show.page import new_figure
from palpate.show.quantities import ERROR
from palpate.show.scenery import Colours, draw_object, spread_over
from palpate.show.view3d import Colouring, Line, View
from palpate.words import mm, renderer_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MARKS = ("o", "^", "s", "x", "d")
DEPTH_M = 0.004


def compared(result: Comparison) -> tuple[str, ...]:
    """What is shown: the FEM of one modulus only where some fold asked for a field."""
    homogeneous = any(f is not None for f in result.fields)
    return tuple(m for m in result.rmse_n if homogeneous or m != HOMOGENEOUS)


def view(result: Comparison) -> View:
    """The object by the error of each model; each press as measured and as predicted while held out."""
    presses, names = result.presses, compared(result)
    lines = [Line("measured", local(presses, presses.force), "measured")]
    for name in names:
        shown = name in ("fem", *RIVALS)
        lines.append(Line(called(name), local(presses, result.predicted[name]), name, shown))
    words = (
        "Root mean square of predicted less measured force over each press, held out of every fit. "
        "The colours of all models have one scale, so that they can be compared."
    )
    colourings = [
        Colouring(ERROR, None, result.press_rmse_n[name], words, f"error of {called(name)}") for name in names
    ]
    colourings += usual_colourings(result.model, presses)
    return view_of_presses(result.model, presses, colourings, lines, _worst(result))


def called(model: str) -> str:
    """A model's name as people write it."""
    return {"fem": "FEM", HOMOGENEOUS: "FEM, one modulus"}.get(model) or renderer_words(model)


def still(result: Comparison) -> Figure:
    """The same as a picture: the object by FEM's error, and the press that it predicts worst."""
    presses, model, worst = result.presses, result.model, _worst(result)
    figure = new_figure(10, 3.9, layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.1, 1.05])
    each = result.press_rmse_n["fem"] * ERROR.scale
    values = spread_over(felt_surface(model).points, presses.point, each)[0]
    azimuth = facing(model.support.normal, presses.normal[worst])
    draw_object(left, model, Colours(values, ERROR), touches=presses.point, azimuth_deg=azimuth)
    press_curves(right, result, worst)
    return figure


def press_curves(ax: Axes, result: Comparison, press: int) -> None:
    """Force over depth, into the surface and along it: an error is of the whole vector."""
    presses, rows = result.presses, result.presses.parts[press]
    depth, measured = presses.depth[rows] * 1e3, local(presses, presses.force)[rows]
    pull = (measured * np.linalg.norm(measured[:, 1:], axis=1)[:, None]).sum(axis=0) * [0.0, 1.0, 1.0]
    along = pull / max(float(np.linalg.norm(pull)), 1e-12)
    forces = {"measured": presses.force, **{name: result.predicted[name] for name in ("fem", *RIVALS)}}
    for name, force in forces.items():
        here = local(presses, force)[rows]
        colour, width = colour_of(name), 1.8 if name == "measured" else 1.2
        ax.plot(depth, here[:, 0], label=called(name), color=colour, lw=width)
        ax.plot(depth, here @ along, ls="--", color=colour, lw=width)
    ax.plot([], [], color=COLOURS["reference"], ls="--", lw=1.2, label="dashed: sideways")
    ax.set(xlabel="depth [mm]", ylabel="force, into the surface and sideways [N]", title=f"press {press + 1}")
    ax.legend(frameon=False, fontsize=8.5)
    ax.spines[["top", "right"]].set_visible(False)


def _worst(result: Comparison) -> int:
    return int(np.argmax(result.press_rmse_n["fem"]))


def error_bars(result: Comparison) -> Figure:
    """Error of each model over all held-out presses."""
    bars = [(called(name), result.rmse_n[name], colour_of(name)) for name in compared(result)]
    figure = new_figure(5.5, height_of(len(bars)), layout="constrained")
    draw_errors(figure.subplots(), bars, result.noise_n, "typical error of a held-out press [mN]")
    return figure


def draw(result: Comparison, ax: Axes) -> None:
    """Error of each press for each model."""
    from matplotlib.ticker import LogFormatter

    order = np.argsort(result.press_rmse_n["fem"])
    place = np.arange(len(order))
    for k, name in enumerate(compared(result)):
        ax.plot(
            place,
            1e3 * result.press_rmse_n[name][order],
            _MARKS[k],
            ms=4.5,
            color=colour_of(name),
            label=called(name),
        )
    ax.axhline(1e3 * result.noise_n, color=COLOURS["noise"], ls="--", lw=1, label="sensor's noise")
    numbered = place[:: -max(1, -(-len(order) // 50))]  # from the worst on, which has its number
    ax.set_xticks(numbered, [str(order[i] + 1) for i in numbered], fontsize=7, rotation=90)
    ax.set(xlabel="number of the held-out press", ylabel="typical error [mN]", yscale="log")
    for axis in (ax.yaxis.set_major_formatter, ax.yaxis.set_minor_formatter):
        axis(LogFormatter(labelOnlyBase=False, minor_thresholds=(2, 0.5)))
    ax.grid(axis="x", color="0.92", lw=0.6)
    ax.legend(frameon=False, ncol=5, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def scatter(result: Comparison) -> Figure:
    """Predicted against measured normal force."""
    presses = result.presses
    figure = new_figure(9, 3.2)
    axes = figure.subplots(1, len(compared(result)), sharex=True, sharey=True)
    press = presses.press
    normal = presses.normal[press]
    measured = (presses.force * normal).sum(axis=1)
    top = float(measured.max())
    for ax, name in zip(axes, compared(result), strict=True):
        predicted = (result.predicted[name] * normal).sum(axis=1)
        ax.plot(measured[::10], predicted[::10], ".", ms=1.5, color=colour_of(name), rasterized=True)
        ax.plot([0, top], [0, top], color=COLOURS["reference"], lw=0.8)
        ax.set(title=called(name), xlabel="measured [N]", aspect="equal")
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
    figure = new_figure(7, 3.4)
    ax = figure.subplots()
    x = coordinate[family][order] * 1e3
    for name in (n for n in compared(result) if n in forces):  # a simulator was run along the path alone
        ax.plot(x, forces[name][order], "o", ms=4, color=colour_of(name), label=called(name))
    measured = _at_depth(result)
    for inside, face, label in ((False, "none", "measured, fitted"), (True, None, "measured, left out")):
        chosen = family & (members == inside) & np.isfinite(measured)
        if not chosen.any():
            continue
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
        ylabel=f"normal force at {mm(DEPTH_M, 'g')} [N]",
    )
    ax.margins(y=0.15)
    ax.legend(frameon=False, fontsize=8, ncol=5, loc="lower center", bbox_to_anchor=(0.5, 1.0))
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
