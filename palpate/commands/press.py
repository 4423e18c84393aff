"""One scripted press on a model, headless: t,x,y,z,depth,fx,fy,fz in s, m and N (force on the tool).

The tip comes straight along --direction with its centre aimed at --at (m, device frame), goes in by --depth
along the surface's normal after first touch, and comes out again. Beside the object it meets the support, as
in 'palpate touch' (--no-support leaves that out). With --expect the curve is compared with a
stored one: exit 1 where the forces differ by more than --tolerance anywhere.
"""

from __future__ import annotations

import argparse

from palpate.arguments import (
    add_json,
    add_options,
    emit_json,
    finite,
    options_from,
    progress_bar,
    say,
    vector,
)

SUMMARY = "one scripted press on a model, headless"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """MODEL_OR_SCENE, where and how to press, what to expect."""
    from render.options import RenderOptions
    from render.registry import names
    from render.support import SupportOptions

    parser.add_argument("model", metavar="MODEL_OR_SCENE", help="folder of a model, or a scene")
    parser.add_argument("--at", type=vector, required=True, metavar="X,Y,Z", help="point aimed at [m]")
    parser.add_argument(
        "--direction", type=vector, required=True, metavar="X,Y,Z", help="of the motion; any length"
    )
    parser.add_argument("--depth", type=finite, required=True, metavar="M", help="after first touch [m]")
    parser.add_argument("--speed", type=finite, default=0.01, metavar="M_PER_S", help="(default: 0.01) [m/s]")
    parser.add_argument("--hold", type=finite, default=0.0, metavar="S", help="at depth (default: 0) [s]")
    parser.add_argument("--tip-radius", type=finite, metavar="M", help="(default: the model's) [m]")
    parser.add_argument("--renderer", choices=names(), default="fem", help="(default: fem)")
    parser.add_argument("-o", "--output", metavar="CURVE.csv", help="write the curve")
    parser.add_argument("--expect", metavar="CURVE.csv", help="a curve to compare with")
    parser.add_argument(
        "--tolerance", type=finite, default=0.02, metavar="N", help="of --expect (default: 0.02) [N]"
    )
    add_options(parser, RenderOptions)
    add_options(parser, SupportOptions)
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Press, write, compare."""
    from palpate.sources import open_scene
    from render.options import RenderOptions
    from render.press import greatest_difference, press, read_curve, write_curve
    from render.support import SupportOptions

    expected = read_curve(arguments.expect) if arguments.expect else None
    with progress_bar("press") as progress:
        scene = open_scene(
            arguments.model,
            arguments.renderer,
            options_from(arguments, RenderOptions),
            options_from(arguments, SupportOptions),
            progress,
        )
    curve = press(
        scene,
        arguments.at,
        arguments.direction,
        arguments.depth,
        arguments.speed,
        hold_s=arguments.hold,
        tip_radius_m=arguments.tip_radius,
    )
    if arguments.output:
        write_curve(arguments.output, curve)
    deepest = curve.force_at(curve.depth.max())
    result = {
        "renderer": arguments.renderer,
        "normal": curve.normal,
        "depth_m": curve.depth.max(),
        "force_at_depth_n": deepest,
        "peak_force_n": curve.peak_force_n,
    }
    say(
        arguments,
        f"{arguments.renderer}: {curve.peak_force_n:.4g} N at most; at {curve.depth.max() * 1e3:.3g} mm the "
        f"force on the tool is {', '.join(f'{f:.4g}' for f in deepest)} N",
    )
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
