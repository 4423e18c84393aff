"""An exploration: what became known from touch to touch, where each was and why, and why it ended."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.diagnosis.explore.suggestion import Explored, Step
from palpate.operations._written import typed
from palpate.reconstruction.steps.s3_contacts.first_touch import GOES_ON
from palpate.show import story as say
from palpate.show.colours import COLOURS
from palpate.show.page import drawn, file_words
from palpate.show.quantities import ORDER, UNCERTAINTY, softness
from palpate.show.view3d import Colouring, Thing, View
from palpate.words import mm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

_REACHED = {True: "yes", False: "not yet"}
_NAMES = {"modulus": "Young's modulus", "surface": "surface", "cause": "one cause alone"}


def story(result: Explored) -> say.Story:
    """What became known, where, and why it ended."""
    name = Path(result.path).name.split(".")[0] or "an object"
    yield say.Title(f"Exploration of {name}", suffixed=True)
    state, recording = result.state, file_words(result.path, "REC")
    how = f"{'ended' if result.last.kind == 'stop' else 'has not ended, next'}: {result.last.why}"
    made = f"{state.made} press{'es' * (state.made != 1)} in {state.seconds:.0f} s"
    yield say.Headline(f"{made}: {state.words or 'nothing is known yet'}", on=say.TEXT)
    yield say.Headline(f"{made}: {state.reached or 'nothing is known yet'}", on=say.PAGE)
    yield say.Detail(how, on=say.TEXT)
    soft = np.isfinite(state.modulus_pa)
    soft_words = f"About as soft as {softness(state.modulus_pa)}. " if soft else ""
    why = how.removesuffix(state.words).rstrip(":; ")  # what is known stands above
    yield say.Sentence(f"{soft_words}The exploration {why}", on=say.PAGE)
    if state.trouble:
        yield say.Sentence(f"The last touch could not be used: {state.trouble}", on=say.PAGE)
    same = {"output": result.path, "going_on": result.path}
    more = {"most": 2 * state.made} if result.last.kind == "stop" else {}
    go_on = f"go on: `{typed('explore', {**(result.said or {'device': 'mouse'}), **same, **more})}`"
    if not result.said:
        go_on += f" ({GOES_ON})"
    if not result.path:
        go_on = "begin anew: nothing was taken in, and nothing written"
    model = f"make a model of it: `palpate reconstruct {recording} -o MODEL`"
    yield say.Next([*([model] if soft else []), *([] if state.done else [go_on])])
    yield say.Rows(
        ["goal", "now", "wanted", "reached"],
        [[_NAMES[g.name], _goal(g.name, g.now), _goal(g.name, g.goal), _REACHED[g.met]] for g in state.goals],
    )
    if result.estimate.surface is not None:
        flat = say.Picture(
            lambda: drawn(_draw_places, result, 5, 4),
            "The places touched from above, in order; the line is the outline there.",
        )
        yield say.Turned(lambda: view(result), flat)
    yield say.Section("How did it become known?", [
        say.Pictures([
            say.Picture(lambda: drawn(draw, result, 5, 3.4), "The modulus, press by press."),
            say.Picture(lambda: drawn(_draw_surface, result, 5, 3.4), "The surface."),
        ])
    ])  # fmt: skip
    yield say.Section("Why was each touch made there?", [
        say.Rows(["touch", "suggested because", "known after it"], _rows(result))
    ])  # fmt: skip


def _known(steps: tuple[Step, ...]) -> list[Step]:
    return [s for s in steps if np.isfinite(s.state.modulus_pa)]


def draw(result: Explored, ax: Axes) -> None:
    """Young's modulus (kPa) with its 95 % interval over the presses made."""
    known = _known(result.steps)
    made = [s.state.made for s in known]
    low, high = (np.array([s.state.modulus_ci95_pa[k] for s in known]) / 1e3 for k in (0, 1))
    ax.fill_between(made, low, high, color=COLOURS["modulus"], alpha=0.18, lw=0, label="95 % sure")
    modulus = [s.state.modulus_pa / 1e3 for s in known]
    ax.plot(made, modulus, "o-", ms=4, color=COLOURS["modulus"], label="estimate")
    _over_presses(ax, "Young's modulus [kPa]")
    if known:
        last = modulus[-1]
        ax.set_ylim(max(0.0, 0.4 * last), 1.6 * last)
        ax.legend(frameon=False, loc="upper right")


def _over_presses(ax: Axes, what: str) -> None:
    ax.set(xlabel="presses made", ylabel=what)
    ax.locator_params(axis="x", integer=True)


def _draw_surface(result: Explored, ax: Axes) -> None:
    """mm within which 95 % of the surface lies, over the presses made, with the goal."""
    known = [s for s in result.steps if np.isfinite(s.state.surface_error_m)]
    error = [1e3 * s.state.surface_error_m for s in known]
    ax.plot([s.state.made for s in known], error, "o-", ms=4, color=COLOURS["surface"], label="estimate")
    if result.goals.surface_within_m is not None:
        goal = 1e3 * result.goals.surface_within_m
        ax.axhline(goal, ls="--", lw=1, color=COLOURS["goal"], label="goal")
    _over_presses(ax, "95 % of the surface within [mm]")
    ax.set_ylim(0, 1.15 * ax.get_ylim()[1])
    if known:
        ax.legend(frameon=False, loc="upper right")


def place(result: Explored, plotter: Plotter) -> None:
    """The surface so far, its touches numbered by colour."""
    import pyvista

    from palpate.show.scenery import add_dots

    surface, touched = result.estimate.surface, _touched(result)
    if surface is not None:
        faces = pyvista.PolyData.from_regular_faces(surface.vertices, surface.triangles)
        plotter.add_mesh(faces, color=COLOURS["object"], smooth_shading=True)
    add_dots(plotter, touched, np.arange(1.0, len(touched) + 1), label=ORDER.label)


def _touched(result: Explored) -> np.ndarray:
    """(p, 3) m, where the surface was met."""
    found = result.estimate.exploration
    return np.zeros((0, 3)) if found is None else found.presses.point


def view(result: Explored) -> View | None:
    """The surface so far, to be turned; None where there are too few touches for one."""
    surface, touched = result.estimate.surface, _touched(result)
    if surface is None:
        return None
    up = surface.support_normal
    free = (surface.vertices - surface.support_point) @ up > 1e-6
    thing = Thing(surface.vertices, surface.triangles, free, surface.support_point, up)
    unsure = np.where(free, surface.uncertainty_m, np.nan)
    words = "Standard deviation of the surface along its normal: the next touch goes where it informs most."
    order = np.arange(1.0, len(touched) + 1)
    return View(
        thing,
        touched,
        [
            Colouring(UNCERTAINTY, unsure, None, words),
            Colouring(ORDER, None, order, "Each dot is where a press met the surface, in order of time."),
        ],
    )


def _goal(name: str, value: float) -> str:
    if not np.isfinite(value):
        return "unknown"
    if name == "surface":
        return f"{mm(value, '.2f')}"
    return f"{100 * value:.1f} %" if name == "modulus" else f"{100 * (1 - value):.1f} % sure"


def _rows(result: Explored) -> list[list[object]]:
    return [
        [k, "made before" if s.asked is None else s.asked.why, s.state.trouble or s.state.reached or "-"]
        for k, s in enumerate(result.steps, 1)
    ]


def _draw_places(result: Explored, ax: Axes) -> None:
    """The touches from above the support, mm, numbered."""
    from palpate.show.scenery import level_axes

    surface = result.estimate.surface
    assert surface is not None
    across = level_axes(surface.support_normal)
    places = 1e3 * (_touched(result) - surface.support_point) @ across.T
    edge = 1e3 * (surface.vertices - surface.support_point) @ across.T
    ax.triplot(edge[:, 0], edge[:, 1], surface.triangles, lw=0.15, color=COLOURS["mesh"])
    ax.plot(places[:, 0], places[:, 1], "o", ms=5, color=COLOURS["touch"])
    for k, (x, y) in enumerate(places, 1):
        ax.annotate(str(k), (x, y), xytext=(3, 3), textcoords="offset points", fontsize=8)
    ax.set_aspect("equal")
    ax.set(xlabel="x' [mm]", ylabel="y' [mm]")
