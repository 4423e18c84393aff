"""One scripted press on a model, headless: t,x,y,z,depth,fx,fy,fz in s, m and N (force on the tool).

The tip comes straight along --direction with its centre aimed at --at (m, device frame; left out: the
object's centre of volume), goes in by --depth along the surface's normal after first touch, and comes out
again. Next to the object it meets the support, as in 'palpate touch' (--no-support leaves it out): that is
said, and on a model or a surface's file the exit code is 1. With --expect the curve is compared with a stored
one: exit code 1 if it was pressed otherwise, or the forces differ by more than --tolerance anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from palpate.mechanics.disk.surface_files import is_surface_file
from palpate.mechanics.options import EXACT
from palpate.operations._call import Call
from palpate.operations._declare import Given, operation, option
from palpate.operations._shared import (
    MeshFileOptions,
    Renders,
    given_model,
    model_argument,
    names_scene,
    output_option,
)
from palpate.operations._to_argparse import vector
from palpate.operations.renderer import touched_scene
from palpate.render.options import RenderOptions
from palpate.render.support import SupportOptions

if TYPE_CHECKING:
    from palpate.operations._shared import ModelLike
    from palpate.render.base import Renderer
    from palpate.render.press import Curve


@operation(common="friction young_modulus_pa")
def press(
    model: Annotated[ModelLike | Renderer, model_argument()],
    at: Annotated[
        Sequence[float] | None,
        option(
            "point that the tip's centre is aimed at, (3,); None: the object's centre of volume",
            unit="m",
            metavar="X,Y,Z",
            parse=vector,
        ),
    ] = None,
    direction: Annotated[
        Sequence[float] | None,
        option(
            "direction of the motion, (3,), any length; None: straight onto the support",
            metavar="X,Y,Z",
            parse=vector,
        ),
    ] = None,
    depth_m: Annotated[float, option("depth along the surface's normal after first touch", unit="m")] = 0.004,
    speed_m_per_s: Annotated[float, option("speed of the tip", unit="m/s", flag="--speed")] = 0.01,
    *,
    hold_s: Annotated[float, option("time at depth", unit="s", advanced=True)] = 0.0,
    approach_m: Annotated[
        float, option("way through free air before the touch", unit="m", advanced=True)
    ] = 2e-3,
    rate_hz: Annotated[float, option("samples a second", unit="Hz", advanced=True)] = 1000.0,
    tip_radius_m: Annotated[float | None, option("radius of the tip; None: the model's", unit="m")] = None,
    renderer: Renders = "fem",
    exact: Annotated[bool, option(EXACT)] = False,
    output: Annotated[
        str | None, output_option("write the curve", "CURVE.csv", "palpate.render.press:CURVE")
    ] = None,
    expect: Annotated[
        str | None, option("a curve to compare with", metavar="CURVE.csv", reads=True, only="command")
    ] = None,
    tolerance: Annotated[
        float | None,
        option(
            "greatest difference from --expect; default: 2 % of its greatest force", unit="N", only="command"
        ),
    ] = None,
    file: Given[MeshFileOptions],
    render: Given[RenderOptions],
    support: SupportOptions,
    call: Call,
) -> Curve:
    """One scripted press: the force response of a model at one place.

    A renderer that is there already saves seconds where many presses follow. Device frame; forces N on the
    tool; `on_support` where the first contact is not the object. Raises OptionError where the line misses
    object and support, or grazes them.
    """
    import numpy as np

    from palpate.mechanics.press_solver.solved_places import said_beforehand
    from palpate.render.exact import ExactPlaces, check_renderer
    from palpate.render.press import Stroke, read_curve, solved
    from palpate.render.press import press as pressed
    from palpate.scenes.phantoms import DEFAULT_MODULUS_PA
    from palpate.show import next_lines

    expected = read_curve(expect) if expect else None
    if exact:
        check_renderer(renderer)
    make = touched_scene(given_model(model, file, "a"), renderer, render, support)
    with call.progress("press") as show_progress:
        scene = make(show_progress)
    places = None
    if exact:
        places = ExactPlaces(scene.renderer, tip_radius_m)
        call.out.say(f"--exact: {said_beforehand(1)}")
    straight = direction is None
    radius = scene.model.tool.tip_radius_m if tip_radius_m is None else float(tip_radius_m)
    curve = pressed(
        scene,
        None if at is None else np.asarray(at, dtype=float),
        -scene.model.support.normal if straight else np.asarray(direction, dtype=float),
        Stroke(depth_m, speed_m_per_s, hold_s, approach_m, rate_hz),
        radius,
    )
    if places is not None:
        with call.progress("press") as show_progress:
            curve = solved(curve, places, show_progress)
    if is_surface_file(Path(str(model))) and file.get("young_modulus_pa") is None:
        call.then(f"  (the file says none: {DEFAULT_MODULUS_PA:g} Pa, unless --modulus states another)")
    call.then_save(curve, output)
    call.exit_code = int(curve.on_support and not names_scene(model))
    if expected is not None:
        call.then(partial(_compared, curve, expected, tolerance, call))
    touched = None
    if isinstance(model, str | Path):
        from palpate.operations._written import typed

        touched = typed("touch", {"scene": model, **file})
    call.following = [partial(next_lines, curve, written=output, touched=touched)]
    return curve


def _compared(curve: Curve, expected: Curve, stated: float | None, call: Call) -> list[str]:
    """Whether press and forces agree, in a line; the command's exit code is 1 where they differ."""
    from palpate.render.expected import SHARE, greatest_difference, path_differences
    from palpate.render.press import WRITTEN_DIGITS
    from palpate.words import listed, percent

    worst, when = greatest_difference(curve, expected)
    peak = expected.peak_force_n
    allowed = SHARE * peak if stated is None else stated
    otherwise = path_differences(curve, expected)
    passed = worst <= allowed and not otherwise
    call.exit_code = call.exit_code or int(not passed)
    call.figures = {
        "difference_n": worst,
        "at_s": when,
        "tolerance_n": allowed,
        "same_path": not otherwise,
        "passed": passed,
    }
    of_peak = f", {percent(worst / peak, '.2g')} of its greatest force" if peak > 0 else ""
    forces = f"greatest difference {worst:.4g} N at {when:.4g} s{of_peak}, allowed {allowed:.3g} N"
    if otherwise:
        return [
            f"differs: the stored curve is of another press: {listed(otherwise)}; {forces}",
        ]
    if worst <= 10.0 ** -(WRITTEN_DIGITS - 1) * peak:  # a file holds no more of a force
        return [f"agrees: the same to the file's {WRITTEN_DIGITS} digits, allowed {allowed:.3g} N"]
    return [f"{'agrees' if passed else 'differs'}: {forces}"]
