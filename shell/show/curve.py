"""A force response: force over depth, the object as it is deformed at the deepest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.render.base import Renderer
from palpate.render.force_error import said
from palpate.render.press import Curve
from palpate.show.page import file_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.render.exact import SolvedPlace


def lines(result: Curve) -> list[str]:
    """What `print` says, with units."""
    depth = float(result.depth.max())
    if result.renderer is None:
        return [f"a curve that was read: {result.peak_force_n:.4g} N at most, {depth * 1e3:.3g} mm deep"]
    force = ", ".join(f"{round(float(f), 3) + 0.0:g}" for f in result.force_at(depth))
    normal = ", ".join(f"{round(float(v), 2) + 0.0:g}" for v in np.asarray(result.normal))
    modulus = result.renderer.model.material.young_modulus_pa / 1e3
    return [
        f"{result.renderer.name}: {result.peak_force_n:.3g} N at most; {depth * 1e3:.3g} mm deep the force "
        f"on the tool is ({force}) N",
        f"  the surface faces ({normal}) there; {len(result.t)} samples in {result.t[-1]:.3g} s; "
        f"the object's Young's modulus is {modulus:.4g} kPa",
        *([f"  {words}"] if (words := said(result.error_figures)) else []),
        *(_solved(result.exact) if result.exact is not None else []),
    ]


def _solved(exact: SolvedPlace) -> list[str]:
    """Law, solution and bound along the depth."""
    rows = zip(1e3 * exact.depth_m, exact.law_n, exact.solved_n, exact.error_n, strict=True)
    return [
        "  solved here, along the normal; the forces above are by it",
        "    depth [mm]   law [N]   solved [N]   the law may be off by [N]",
        *(f"    {d:10.2f}{law:10.3f}{solved:13.3f}{bound:12.3f}" for d, law, solved, bound in rows),
    ]


def next_steps(result: Curve, written: str | None = None) -> list[str]:
    """What to do with a model's curve; nothing with one that was read. written: its file."""
    if result.renderer is None:
        return []
    model = file_words(result.renderer.model.path, "MODEL")
    feel = f"feel it: `palpate touch {model}`"
    if written is None:
        return [feel, "see whether it stays so: press with `-o CURVE.csv`, later with `--expect CURVE.csv`"]
    return [feel, f"see later whether it stays so: the same press with `--expect {written}`"]


def as_json(result: Curve) -> dict[str, Any]:
    """The figures of `palpate press --json`, keys with units."""
    depth = float(result.depth.max())
    return {
        "renderer": _renderer(result).name,
        "normal": result.normal,
        "depth_m": depth,
        "force_at_depth_n": result.force_at(depth),
        "peak_force_n": result.peak_force_n,
        **result.error_figures,
        **({} if result.exact is None else {"exact": result.exact.as_json()}),
    }


def draw(result: Curve, ax: Axes) -> None:
    """Force along the normal, and its length, over depth."""
    touching = result.depth > 0
    depth = result.depth[touching] * 1e3
    ax.plot(depth, result.force[touching] @ result.normal, color="#1d3557", label="along the normal")
    size = np.linalg.norm(result.force[touching], axis=1)
    ax.plot(depth, size, "--", lw=1, color="#e08e1b", label="magnitude")
    if result.exact is not None:
        own = result.exact
        low, high = own.law_n - own.error_n, own.law_n + own.error_n
        ax.fill_between(own.depth_m * 1e3, low, high, color="#a8bccb", alpha=0.5, label="the law's bound")
        ax.plot(own.depth_m * 1e3, own.law_n, ":", color="#457b9d", label="by the law")
        ax.plot(own.depth_m * 1e3, own.solved_n, "o", color="#1d3557", ms=4, label="solved")
    ax.set(xlabel="depth [mm]", ylabel="force on the tool [N]", title=_renderer(result).name)
    ax.set_xlim(left=0)
    ax.set_ylim(bottom=0)
    ax.legend(frameon=False, loc="upper left")


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
        raise OptionError("a curve that was read knows no renderer: press the model to draw it")
    return result.renderer
