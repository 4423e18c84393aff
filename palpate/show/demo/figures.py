"""The demo's pictures and view: what was touched, measured against rendered force."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.demo import DemoResult
from palpate.show.model_view import local, rms_by_press, usual_colourings, view_of_presses
from palpate.show.object3d import Colours, draw_object, draw_touched
from palpate.show.page import subplots
from palpate.show.quantities import ERROR, UNCERTAINTY
from palpate.show.reconstruction.exploration import force_over_time
from palpate.show.view3d import View
from palpate.show.view3d_parts import Colouring, Line
from reconstruct.steps.s6_one_d.one_d import low_passed
from render.surface.felt_surface import felt_surface

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN_PRESSES = 3
_STEP_S = 0.05
"""Between samples of one press of a diagnosis; what is longer lies between presses."""


def press_figures(result: DemoResult) -> dict[str, Figure]:
    """Force along the normal over depth, measured and rendered, of presses spread over the peak force."""
    presses = result.model.presses
    shown = low_passed(presses)
    push = [shown.push[shown.rows([i])].max() for i in range(len(presses))]
    chosen = np.argsort(push)[np.linspace(0, len(push) - 1, SHOWN_PRESSES).round().astype(int)]
    curves, smooth = presses.window(0.03, 0.03), shown.window(0.03, 0.03)
    made = {}
    for i in chosen:
        made[f"press-{i + 1}"], ax = subplots(1, 1, figsize=(4.4, 3))
        own = curves.rows([i])
        depth, at = smooth.depth[own] * 1e3, np.searchsorted(result.recording.t, curves.t[own])
        rendered = result.rendered_n[at] @ presses.normal[i]
        ax.plot(depth, curves.push[own], ".", ms=1, color="#a8bccb", label="measured")
        ax.plot(depth, rendered, lw=1.5, color="#c1121f", label="rendered")
        ax.set(title=f"press {i + 1}", xlabel="depth [mm]", ylabel="force along the normal [N]")
        ax.set_ylim(top=1.05 * max(push))
        ax.legend(loc="upper left", frameon=False, markerscale=8)
    return made


def view(result: DemoResult) -> View:
    """The object; each press as measured, as rendered, and as the diagnosis's ideal simulation."""
    model, recording = result.model, result.recording
    shown = low_passed(model.presses).window(0.03, 0.03)
    at = np.searchsorted(recording.t, shown.t).clip(0, len(recording.t) - 1)
    off = result.rendered_n[at] - shown.force
    each = rms_by_press(shown, off)
    lines = [
        Line("measured", local(shown, shown.force), "measured"),
        Line("rendered", local(shown, result.rendered_n[at]), "rendered"),
        *_simulated(result, shown.t),
    ]
    error = Colouring(
        ERROR,
        None,
        each,
        "Rendered less measured, root mean square over each press; between presses what is near, "
        "paler where nobody touched.",
    )
    first, *others = usual_colourings(model)
    return view_of_presses(model, shown, [first, error, *others], lines, int(np.argmax(each)))


def _simulated(result: DemoResult, t: np.ndarray) -> list[Line]:
    """The diagnosis's own simulations at times t (n,) s: the ideal one, and with what was found."""
    found = result.diagnosis
    if (
        found is None
        or found.forward is None
        or found.residual_before is None
        or found.residual_after is None
    ):
        return []
    touches = found.forward.touches
    following = np.searchsorted(touches.t, t).clip(1, len(touches.t) - 1)
    between = touches.t[following] - touches.t[following - 1] > _STEP_S
    lines = []
    for name, residual, kind in (
        ("ideal simulation (linear, small strain)", found.residual_before, "effect"),
        ("simulation with what was found", found.residual_after, "found"),
    ):
        force = touches.local_force - residual
        seen = np.stack([np.interp(t, touches.t, axis, np.nan, np.nan) for axis in force.T], axis=1)
        lines.append(Line(name, np.where(between[:, None], np.nan, seen), kind, False))
    return lines if found.effects else lines[:1]


def figures(result: DemoResult) -> dict[str, Figure]:
    """The report's pictures by name."""
    force, ax = subplots(1, 1, figsize=(9, 3))
    force_over_time(ax, result.reconstruction.exploration)
    thing, axes = subplots(1, 2, figsize=(10, 4.2))
    draw_touched(axes[0], result.model)
    doubt = felt_surface(result.model).uncertainty_m
    draw_object(axes[1], result.model, Colours(doubt * UNCERTAINTY.scale, UNCERTAINTY))
    return {"force": force, "object": thing, **press_figures(result)}
