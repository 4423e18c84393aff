"""Guided exploration: where to touch next and why, what is known so far, and when to stop.

In the virtual laboratory (--phantom NAME) a simulated robot follows the suggestions with errors of place,
way and depth. In the touch window (--device NAME, --scene) a ghost tip shows where and how to press. A robot
of your own talks over standard input and output (--robot): one line of JSON a suggestion and a segment, as
docs/exploring.md tells. The recording so far is written after every touch, so an exploration that was
interrupted is whole, and --continue goes on with it. At the end `palpate reconstruct` makes a MODEL of it
like any other.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from diagnose.explore.candidates import ReachOptions
from diagnose.explore.explorer import Explorer, State, Suggestion
from diagnose.explore.goals import GoalOptions, check_goals
from diagnose.explore.segments import Instrument
from mechanics.errors import OptionError
from mechanics.options import check_ranges
from mechanics.quantities import POISSON_RATIO
from mechanics.recording import SAMPLES, read_recording
from palpate.arguments import (
    add_input,
    add_json,
    add_options,
    add_output,
    add_seed,
    emit_json,
    options_from,
    say,
)
from palpate.commands.simulate import effects_from
from palpate.robot.laboratory import RobotOptions

SUMMARY = "where to touch next, and when to stop"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Who touches, what is asked for, where it goes."""
    who = parser.add_mutually_exclusive_group(required=True)
    who.add_argument(
        "--phantom", metavar="NAME", help="explore this phantom of the laboratory, or a surface file"
    )
    who.add_argument("--robot", action="store_true", help="talk with a robot: lines of JSON, in and out")
    who.add_argument("--device", metavar="NAME", help="explore in the touch window: mouse, or another")
    parser.add_argument(
        "--scene",
        default="nodule",
        metavar="MODEL_OR_SCENE",
        help="with --device: what is felt (default: nodule)",
    )
    parser.add_argument("--screenshot", metavar="PNG", help="with --device: save the window at its end")
    parser.add_argument(
        "--seconds", type=float, metavar="NUMBER", help="with --device: stop after this time [s]"
    )
    add_input(
        parser,
        "--continue",
        dest="going_on",
        metavar="REC",
        help="go on with what was explored so far",
    )
    add_output(
        parser, "-o", "--output", kind=SAMPLES, required=True, metavar="REC",
        help="recording to write (.csv.gz, .csv), after every touch",
    )  # fmt: skip
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME=STRENGTH",
        help="with --phantom: an effect (repeatable)",
    )
    parser.add_argument(
        "--tip-radius",
        type=float,
        default=0.005,
        metavar="M",
        help="of the spherical tip [m] (default: 0.005)",
    )
    parser.add_argument(
        "--rate",
        type=float,
        default=1000.0,
        metavar="HZ",
        help="with --robot: samples a second [Hz] (default: 1000)",
    )
    parser.add_argument(
        "--poisson-ratio", type=float, default=0.49, metavar="NU", help="of the object (default: 0.49)"
    )
    parser.add_argument(
        "--modulus",
        type=float,
        metavar="PA",
        help="with --phantom: its Young's modulus [Pa] (default: its own)",
    )
    for kind in (GoalOptions, ReachOptions, RobotOptions):
        add_options(parser, kind)
    add_seed(parser)
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Explore until a goal, the limit or the robot ends it."""
    goals = options_from(arguments, GoalOptions)
    check_goals(goals)
    reach = options_from(arguments, ReachOptions)
    if not POISSON_RATIO.takes(arguments.poisson_ratio):
        raise OptionError(f"--poisson-ratio is {arguments.poisson_ratio}; it must be {POISSON_RATIO.words}")
    if arguments.robot:
        return _robot(arguments, goals, reach)
    if arguments.device:
        return _window(arguments, goals, reach)
    return _phantom(arguments, goals, reach)


def _explorer(
    arguments: argparse.Namespace, goals: GoalOptions, reach: ReachOptions, instrument: Instrument, nu: float
) -> Explorer:
    """A new one, or one that goes on with what --continue names."""
    if arguments.going_on is None:
        return Explorer(instrument, goals, reach, poisson_ratio=nu, seed=arguments.seed)
    recording = read_recording(arguments.going_on)
    made = Explorer.going_on(recording, goals, reach, poisson_ratio=nu, seed=arguments.seed)
    if not np.isclose(made.instrument.tip_radius_m, instrument.tip_radius_m, rtol=0.01):
        raise OptionError(
            f"{arguments.going_on} was explored with a tip of {1e3 * made.instrument.tip_radius_m:.2f} mm, "
            f"this one has {1e3 * instrument.tip_radius_m:.2f} mm: go on with the same tip"
        )
    return made


def _window(arguments: argparse.Namespace, goals: GoalOptions, reach: ReachOptions) -> int:
    from palpate.commands import touch
    from palpate.window.guide import Guide
    from palpate.window.session import TouchSession

    parser = argparse.ArgumentParser()
    touch.add_arguments(parser)
    words = [arguments.scene, "--device", arguments.device, "--seed", str(arguments.seed)]
    for name in ("screenshot", "seconds"):
        if getattr(arguments, name) is not None:
            words += [f"--{name}", str(getattr(arguments, name))]
    kept: list[Explorer] = []

    def guided(session: TouchSession) -> Guide:
        servo, nu = session.servo, session.model.material.poisson_ratio
        instrument = Instrument(
            servo.tip_radius_m, servo.options.rate_hz, {"object_name": session.title, "poisson_ratio": nu}
        )
        kept.append(_explorer(arguments, goals, reach, instrument, nu))
        return Guide(kept[-1], servo, session.model, session.worker, arguments.output)

    touch.run(parser.parse_args(words), guided)
    state = kept[-1].state
    say(arguments, _line(kept[-1].suggest(), state))
    emit_json({"recording": arguments.output, **state.table()}, arguments.json)
    return 0


def _robot(arguments: argparse.Namespace, goals: GoalOptions, reach: ReachOptions) -> int:
    from palpate.robot.protocol import serve

    if not (arguments.rate > 0 and arguments.tip_radius > 0):
        raise OptionError("--rate and --tip-radius must be greater than 0")
    about = {"poisson_ratio": arguments.poisson_ratio}
    instrument = Instrument(arguments.tip_radius, arguments.rate, about)
    explorer = _explorer(arguments, goals, reach, instrument, arguments.poisson_ratio)

    def tell(line: str) -> None:
        print(line, flush=True)

    serve(explorer, sys.stdin, tell, lambda e: e.save(arguments.output))
    emit_json({"recording": arguments.output, **explorer.state.table()}, arguments.json)
    return 0


def _phantom(arguments: argparse.Namespace, goals: GoalOptions, reach: ReachOptions) -> int:
    from palpate.robot.laboratory import LaboratoryRobot
    from scenes.laboratory.session import SimulateOptions
    from scenes.phantoms import phantom

    thing = phantom(arguments.phantom)
    options = SimulateOptions(young_modulus_pa=arguments.modulus, tip_radius_m=arguments.tip_radius)
    check_ranges(options)
    robot = LaboratoryRobot(
        thing,
        effects_from(arguments.effect),
        seed=arguments.seed,
        options=options,
        robot=options_from(arguments, RobotOptions),
    )
    explorer = _explorer(arguments, goals, reach, robot.instrument, thing.poisson_ratio)
    robot.made = sum(s.kind == "press" for s in explorer.segments)
    steps: list[dict] = []
    while True:
        suggestion = explorer.suggest()
        say(arguments, _line(suggestion, explorer.state))
        if suggestion.kind == "stop":
            break
        state = explorer.add(robot.carry_out(suggestion))
        explorer.save(arguments.output)
        steps.append({"suggest": suggestion.table(), "state": state.table()})
    state = explorer.state
    say(
        arguments,
        f"written to {arguments.output}: palpate reconstruct {arguments.output} -o MODEL makes the model",
    )
    summary = {"recording": arguments.output, "steps": steps, **state.table()}
    if robot.last is not None:
        summary["truth"] = dict(robot.last.truth)
    emit_json(summary, arguments.json)
    return 0


def _line(suggestion: Suggestion, state: State) -> str:
    """One touch a line: what is known, what comes next, why."""
    known = "nothing is known yet"
    if state.presses and state.surface:
        known = (
            f"{state.made} presses, {state.seconds:.0f} s: {state.modulus_pa / 1e3:.1f} kPa "
            f"({state.modulus_ci95_pa[0] / 1e3:.1f} to {state.modulus_ci95_pa[1] / 1e3:.1f}), "
            f"surface within {1e3 * state.surface_error_m:.1f} mm"
        )
    if state.causes is not None:
        likeliest, *others = state.causes.not_ruled_out(state.cause_at)
        known += f", cause: {likeliest}" + (f" or {len(others)} others" if others else "")
    if suggestion.point is None:
        return f"{known}; {suggestion.kind}: {suggestion.why}"
    x, y, z = (1e3 * float(v) for v in suggestion.point)
    return (
        f"{known}; press at ({x:.0f}, {y:.0f}, {z:.0f}) mm, {1e3 * suggestion.depth_m:.1f} mm deep: "
        f"{suggestion.why}"
    )
