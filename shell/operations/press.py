"""One scripted press on a model, headless: t,x,y,z,depth,fx,fy,fz in s, m and N (force on the tool).

The tip comes straight along --direction with its centre aimed at --at (m, device frame), goes in by --depth
along the surface's normal after first touch, and comes out again. Beside the object it meets the support, as
in 'palpate touch' (--no-support leaves that out). With --expect the curve is compared with a
stored one: exit 1 where the forces differ by more than --tolerance anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.mechanics.disk.surface_files import is_surface_file
from palpate.mechanics.options import EXACT
from palpate.operations._declare import REQUIRED, Call, operand, operation
from palpate.operations._run import say_next
from palpate.operations._shared import (
    MeshFileOptions,
    given_model,
    model_operand,
    output_operand,
    renderer_operand,
    tip_radius_operand,
)
from palpate.operations._to_argparse import vector
from palpate.operations.renderer import touched_scene
from palpate.output import Output
from palpate.render.options import RenderOptions
from palpate.render.support import SupportOptions

if TYPE_CHECKING:
    from palpate.operations._shared import ModelLike
    from palpate.render.base import Renderer
    from palpate.render.press import Curve


@dataclass(frozen=True)
class PressOperands:
    """Where and how to press, and what to expect."""

    model: ModelLike | Renderer = model_operand()
    at: Sequence[float] = operand(
        REQUIRED, "point that the tip's centre is aimed at, (3,)", unit="m", metavar="X,Y,Z", parse=vector
    )
    direction: Sequence[float] | None = operand(
        None,
        "of the motion, (3,), any length; None: straight onto the support",
        metavar="X,Y,Z",
        parse=vector,
    )
    depth_m: float = operand(0.004, "along the surface's normal after first touch", unit="m")
    speed_m_per_s: float = operand(0.01, "of the tip", unit="m/s", flag="--speed")
    _: KW_ONLY
    hold_s: float = operand(0.0, "at depth", unit="s", rare=True)
    approach_m: float = operand(2e-3, "of free air before", unit="m", rare=True)
    rate_hz: float = operand(1000.0, "samples a second", unit="Hz", rare=True)
    tip_radius_m: float | None = tip_radius_operand("of the tool; None: the model's")
    renderer: str = renderer_operand()
    exact: bool = operand(False, EXACT)
    output: str | None = output_operand("write the curve", "CURVE.csv", "palpate.render.press:CURVE")
    expect: str | None = operand(
        None, "a curve to compare with", metavar="CURVE.csv", reads=True, only="command"
    )
    tolerance: float = operand(0.02, "of --expect", unit="N", only="command")


def _answer(curve: Curve, asked: PressOperands, out: Output) -> int:
    """Write, compare with what is expected: 1 where the forces differ."""
    from palpate.render.press import greatest_difference, read_curve
    from palpate.scenes.phantoms import DEFAULT_MODULUS_PA

    expected = read_curve(asked.expect) if asked.expect else None
    if asked.output:
        curve.save(asked.output)
    out.say(*curve.lines())
    if is_surface_file(Path(str(asked.model))):
        out.say(f"  (the file says none: {DEFAULT_MODULUS_PA:g} Pa, unless --modulus states another)")
    if asked.output:
        out.say(f"written: {asked.output}")
    figures, code = curve.as_json(), 0
    if expected is not None:
        worst, when = greatest_difference(curve, expected)
        code = int(not worst <= asked.tolerance)
        figures |= {
            "difference_n": worst,
            "at_s": when,
            "tolerance_n": asked.tolerance,
            "passed": code == 0,
        }
        out.say(
            f"{'differs' if code else 'agrees'}: greatest difference {worst:.4g} N at {when:.4g} s, "
            f"allowed {asked.tolerance:g} N"
        )
    say_next(curve, out, written=asked.output)
    out.json(figures)
    return code


@operation(
    PressOperands,
    MeshFileOptions,
    RenderOptions,
    SupportOptions,
    often="friction young_modulus_pa",
    answer=_answer,
)
def press(asked: PressOperands, call: Call) -> Curve:
    """One scripted press: the force response of a model at one place.

    A renderer that is there already saves seconds where many presses follow. Device frame; forces N on the
    tool. Raises OptionError where the line misses object and support, or grazes them.
    """
    import numpy as np

    from palpate.mechanics.press_solver.solved_places import said_beforehand
    from palpate.render.exact import ExactPlaces, check_renderer
    from palpate.render.press import Stroke, read_curve, solved
    from palpate.render.press import press as pressed

    if asked.expect:
        read_curve(asked.expect)  # before the work
    if asked.exact:
        check_renderer(asked.renderer)
    make = touched_scene(given_model(asked.model, call, "a"), asked.renderer, call)
    with call.progress("press") as tell:
        scene = make(tell)
    places = None
    if asked.exact:
        places = ExactPlaces(scene.renderer, asked.tip_radius_m)
        call.out.say(f"--exact: {said_beforehand(1)}")
    straight = asked.direction is None
    radius = scene.model.tool.tip_radius_m if asked.tip_radius_m is None else float(asked.tip_radius_m)
    curve = pressed(
        scene,
        np.asarray(asked.at, dtype=float),
        -scene.model.support.normal if straight else np.asarray(asked.direction, dtype=float),
        Stroke(asked.depth_m, asked.speed_m_per_s, asked.hold_s, asked.approach_m, asked.rate_hz),
        radius,
    )
    if places is None:
        return curve
    with call.progress("solving the place"):
        return solved(curve, places)
