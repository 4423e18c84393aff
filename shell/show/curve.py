"""A force response: force over depth, the object as it is deformed at the deepest."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.frames import tangents
from palpate.render.base import Renderer
from palpate.render.force_error import said
from palpate.render.press import Curve
from palpate.show import story as say
from palpate.show.colours import COLOURS, colour_of
from palpate.show.model import facing, mended_words, parts_words, thing_of, usual_colourings
from palpate.show.page import feel_step
from palpate.show.quantities import DEPTH
from palpate.show.view3d import Colouring, Line, Traces, View
from palpate.words import kpa, mm, part_words, typed_word, unsettled_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.mechanics.shape.tetmesh import TetMesh
    from palpate.render.exact import SolvedPlace


def story(result: Curve, written: str | None = None, touched: str | None = None) -> say.Story:
    """How it answers the press. written: the curve's file; touched: the command that touches it."""
    depth = float(result.depth.max())
    if result.renderer is None:
        yield say.Headline(f"a curve that was read: {result.peak_force_n:.4g} N at most, {mm(depth)} deep")
        return
    there = result.force_at(depth)
    digits = max(3, 2 - int(np.floor(np.log10(np.abs(there).max()))) if there.any() else 3)
    force = ", ".join(f"{round(float(f), digits) + 0.0:g}" for f in there)
    normal = ", ".join(f"{round(float(v), 2) + 0.0:g}" for v in np.asarray(result.normal))
    at = ", ".join(f"{round(float(v), 4) + 0.0:g}" for v in result.touched_at)
    made = result.renderer.model
    if result.on_support:
        yield say.Headline(
            f"this pressed the support, not the object: {result.peak_force_n:.3g} N at most are the support's"
        )
        nearest = _on_object(made.mesh, result.touched_at, np.asarray(result.normal))
        place = ",".join(f"{v:.4g}" for v in nearest)
        yield say.Detail(f"the object is nearest there, in its upper half: `--at={place}`")
        yield say.Next(["press the object through its middle: the same without `--at`"])
        return
    yield say.Headline(
        f"{result.renderer.name}: {result.peak_force_n:.3g} N at most; {mm(depth)} deep the force on the "
        f"tool is ({force}) N"
    )
    yield say.Detail(
        f"pressed at ({at}) m, where the surface faces ({normal}); {len(result.t)} samples in "
        f"{result.t[-1]:.3g} s; the object's Young's modulus{part_words(made)} is "
        f"{kpa(made.material.young_modulus_pa, '.4g')}"
    )
    yield from map(say.Detail, filter(None, (parts_words(made), mended_words(made))))
    if result.unsettled:
        yield say.Sentence(unsettled_words(result.unsettled, len(result.t)))
    if words := said(result.error_figures, from_touch=True):
        yield say.Detail(words)
    if result.exact is not None:
        yield from _solved(result.exact)
    later = "see whether it stays so: press with `-o CURVE.csv`, later with `--expect CURVE.csv`"
    if written is not None:
        later = f"see later whether it stays so: the same press with `--expect {typed_word(written)}`"
    feel = f"feel it: `{touched}`" if touched else None
    yield say.Next([feel or feel_step(made.path, "palpate model FILE -o MODEL"), later])


def _on_object(mesh: TetMesh, at: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(3,) m: of the touchable nodes in the upper half, where no support is met first, that nearest to at."""
    points = mesh.points[mesh.touchable]
    height = points @ up
    points = points[height >= (height.min() + height.max()) / 2]
    nearest: np.ndarray = points[np.argmin(np.linalg.norm(points - at, axis=1))]
    return nearest


def _solved(exact: SolvedPlace) -> say.Story:
    """Law and solution along the depth; what the force may be off by stands above."""
    yield say.Detail(
        f"solved here, elastic and along the normal; the forces above are by it: {exact.solved_n[-1]:.3g} N "
        f"at the deepest, where the law's table alone says {exact.law_n[-1]:.3g} N"
    )
    yield solved_rows("depth [mm]", zip(1e3 * exact.depth_m, exact.law_n, exact.solved_n, strict=True))


def solved_rows(depth: str, rows: Iterable[tuple[float, float, float]]) -> say.Rows:
    """Of solved places: depth (mm; so called), law and solution, N."""
    header = (f"    {depth}", "law [N]", "solved [N]")
    shown = [(f"{d:.2f}", f"{law:.3f}", f"{by:.3f}") for d, law, by in rows]
    return say.Rows(header, shown, (len(header[0]), 10, 13), on=say.TEXT)


KEYS: tuple[say.Key, ...] = (
    "on_support",
    ("renderer", lambda result: _renderer(result).name),
    "normal",
    ("depth_m", lambda result: result.depth.max()),
    ("force_at_depth_n", lambda result: result.force_at(float(result.depth.max()))),
    "peak_force_n",
    lambda result: {"unsettled_samples": result.unsettled} if result.unsettled else {},
    lambda result: result.error_figures,
    lambda result: {} if result.exact is None else {"exact": result.exact},
)


def draw(result: Curve, ax: Axes) -> None:
    """Force along the normal, and its length, over depth."""
    touching = result.depth > 0
    depth = result.depth[touching] * 1e3
    ax.plot(
        depth,
        result.force[touching] @ result.normal,
        color=colour_of(_renderer(result).name),
        label="along the normal",
    )
    size = np.linalg.norm(result.force[touching], axis=1)
    ax.plot(depth, size, "--", lw=1, color=COLOURS["reference"], label="magnitude")
    if result.exact is not None:
        own = result.exact
        low, high = own.law_n - own.error_n, own.law_n + own.error_n
        ax.fill_between(own.depth_m * 1e3, low, high, color=COLOURS["interval"], label="the law's bound")
        ax.plot(own.depth_m * 1e3, own.law_n, ":", color=COLOURS["simplest"], label="by the law")
        ax.plot(own.depth_m * 1e3, own.solved_n, "o", color=COLOURS["found"], ms=4, label="solved")
    ax.set(xlabel="depth [mm]", ylabel="force on the tool [N]", title=_renderer(result).name)
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    ax.legend(frameon=False, loc="upper left")


def view(result: Curve) -> View | None:
    """The object, and the curve at the place that was pressed; None of what was read or met no object."""
    if result.renderer is None or result.on_support or result.normal is None or not (result.depth > 0).any():
        return None
    model, n = result.renderer.model, np.asarray(result.normal)
    first = int(np.argmax(result.depth > 0))
    at = result.position[first] - float(result.tip_radius_m or model.tool.tip_radius_m) * n
    axes = np.stack([n, *tangents(n)])
    kind = result.renderer.name if result.renderer.name in COLOURS else "fem"
    line = Line(result.renderer.name, result.force @ axes.T, kind)
    traces = Traces(np.array([0, len(result.t)]), result.depth, result.t - result.t[first], [line])
    deepest = Colouring(DEPTH, None, np.array([result.depth.max()]), "Where it was pressed, and how deep.")
    own = [each for each in usual_colourings(model) if each.presses is None]
    return View(thing_of(model), at[None], [deepest, *own], traces, 0, facing(model.support.normal, n))


def place(result: Curve, plotter: Plotter) -> None:
    """The object as it is deformed at the deepest, with tip and force."""
    from palpate.show.scenery import add_deformed, add_force, add_path, add_tip

    renderer, radius, last = _renderer(result), result.tip_radius_m, result.deepest + 1
    assert radius is not None
    state = renderer.start([radius])
    steps = np.diff(result.t[:last], prepend=result.t[0] - (result.t[1] - result.t[0]))
    renderer.follow(state, np.ascontiguousarray(result.position[:last, None]), steps)
    add_deformed(plotter, renderer, renderer.displacement(state))
    add_path(plotter, result.position[:last])
    centre, force = result.position[result.deepest], result.force[result.deepest]
    add_tip(plotter, centre, radius)
    add_force(plotter, centre + radius * np.asarray(result.normal), force)


def _renderer(result: Curve) -> Renderer:
    if result.renderer is None:
        raise OptionError("a curve read from a file has no renderer: press the model to draw it")
    return result.renderer
