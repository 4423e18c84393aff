"""One scripted press on a model, headless: t,x,y,z,depth,fx,fy,fz in s, m and N (force on the tool).

The tip comes straight along --direction with its centre aimed at --at (m, device frame), goes in by --depth
along the surface's normal after first touch, and comes out again. Beside the object it meets the support, as
in 'palpate touch' (--no-support leaves that out). With --expect the curve is compared with a
stored one: exit 1 where the forces differ by more than --tolerance anywhere.
"""

from __future__ import annotations

import argparse

from palpate import api
from palpate.arguments import (
    add_input,
    add_json,
    add_options_of,
    add_output,
    emit_json,
    finite,
    given_for,
    say,
    vector,
)
from palpate.sources import add_mesh_arguments, given_model

SUMMARY = "one scripted press on a model, headless"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """MODEL_OR_SCENE, where and how to press, what to expect."""
    from render.press import CURVE
    from render.registry import names

    add_input(parser, "model", metavar="MODEL_OR_SCENE", help="folder of a model, a scene, a surface file")
    add_mesh_arguments(parser)
    parser.add_argument("--at", type=vector, required=True, metavar="X,Y,Z", help="point aimed at [m]")
    parser.add_argument(
        "--direction", type=vector, required=True, metavar="X,Y,Z", help="of the motion; any length"
    )
    parser.add_argument("--depth", type=finite, required=True, metavar="NUMBER", help="after first touch [m]")
    parser.add_argument(
        "--speed", type=finite, default=0.01, metavar="NUMBER", help="of the tip [m/s] (default: 0.01)"
    )
    parser.add_argument(
        "--hold", type=finite, default=0.0, metavar="NUMBER", help="at depth [s] (default: 0)"
    )
    parser.add_argument(
        "--tip-radius", type=finite, metavar="NUMBER", help="of the tool [m] (default: the model's)"
    )
    parser.add_argument("--renderer", choices=names(), default="fem", help="what answers (default: fem)")
    add_output(parser, "-o", "--output", kind=CURVE, metavar="CURVE.csv", help="write the curve")
    add_input(parser, "--expect", metavar="CURVE.csv", help="a curve to compare with")
    parser.add_argument(
        "--tolerance", type=finite, default=0.02, metavar="NUMBER", help="of --expect [N] (default: 0.02)"
    )
    add_options_of(parser, "press")
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Press, write, compare."""
    from render.press import greatest_difference, read_curve

    expected = read_curve(arguments.expect) if arguments.expect else None
    curve = api.press(
        given_model(arguments, arguments.model) or arguments.model,
        arguments.at,
        arguments.direction,
        arguments.depth,
        arguments.speed,
        hold_s=arguments.hold,
        tip_radius_m=arguments.tip_radius,
        renderer=arguments.renderer,
        **given_for(arguments, "press"),
    )
    if arguments.output:
        curve.save(arguments.output)
    result = curve.as_json()
    say(arguments, *curve.lines())
    code = 0
    if expected is not None:
        worst, when = greatest_difference(curve, expected)
        code = int(not worst <= arguments.tolerance)
        result |= {
            "difference_n": worst,
            "at_s": when,
            "tolerance_n": arguments.tolerance,
            "passed": code == 0,
        }
        say(
            arguments,
            f"{'differs' if code else 'agrees'}: greatest difference {worst:.4g} N at {when:.4g} s, "
            f"allowed {arguments.tolerance:g} N",
        )
    emit_json(result, arguments.json)
    return code
