"""Guided exploration: where to touch next and why, what is known so far, and when to stop.

In the virtual laboratory (--phantom NAME) a simulated robot follows the suggestions with errors of place,
way and depth. In the touch window (--device NAME, --scene) a ghost tip shows where and how to press. A robot
of your own talks over standard input and output (--robot): one line of JSON a suggestion and a segment, as
docs/howto/robot.md tells. The recording so far is written after every touch, so an exploration that was
interrupted is whole, and --continue goes on with it. At the end `palpate reconstruct` makes a MODEL of it
like any other.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING

import numpy as np

from palpate.diagnosis.explore.candidates import ReachOptions
from palpate.diagnosis.explore.explorer import ExplorationState, Explorer, Suggestion
from palpate.diagnosis.explore.goals import GoalOptions, check_goals
from palpate.diagnosis.explore.segments import Instrument
from palpate.diagnosis.explore.suggestion import Explored
from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import check_ranges
from palpate.mechanics.plausible import POISSON_RATIO
from palpate.mechanics.recording.recording import read_recording
from palpate.operations._declare import REQUIRED, Call, operand, operation
from palpate.operations._run import say_next
from palpate.operations._shared import (
    SAMPLES,
    output_operand,
    poisson_operand,
    report_operand,
    seed_operand,
    tip_radius_operand,
)
from palpate.operations.simulate import effects_from
from palpate.output import Output
from palpate.robot import RobotOptions
from palpate.words import kpa, mm

if TYPE_CHECKING:
    from palpate.window.guide import Guide
    from palpate.window.session import TouchSession


@dataclass(frozen=True)
class ExploreOperands:
    """Who touches, what is asked for, where it goes."""

    _: KW_ONLY
    phantom: str | None = operand(
        None, "explore this phantom of the laboratory, or a surface file", metavar="NAME"
    )
    robot: bool = operand(False, "talk with a robot: lines of JSON, in and out")
    device: str | None = operand(None, "explore in the touch window: mouse, or another", metavar="NAME")
    scene: str = operand("nodule", "with --device: what is felt", metavar="MODEL_OR_SCENE", rare=True)
    screenshot: str | None = operand(
        None, "with --device: save the window at its end", metavar="PNG", rare=True
    )
    seconds: float | None = operand(None, "with --device: stop after this time", unit="s", rare=True)
    going_on: str | None = operand(
        None, "go on with what was explored so far", flag="--continue", metavar="REC", reads=True
    )
    report: str | None = report_operand("write the page of what was touched, what is known, and why")
    output: str = output_operand(
        "recording to write (.csv.gz, .csv), after every touch", "REC", SAMPLES, REQUIRED
    )
    effects: Mapping[str, float] | None = operand(
        None,
        "with --phantom: an effect (repeatable)",
        flag="--effect",
        metavar="NAME=STRENGTH",
        count="repeat",
        rare=True,
    )
    tip_radius_m: float = tip_radius_operand("of the spherical tip", 0.005)
    rate_hz: float = operand(1000.0, "with --robot: samples a second", unit="Hz", rare=True)
    poisson_ratio: float = poisson_operand("of the object", 0.49)
    young_modulus_pa: float | None = operand(
        None,
        "with --phantom: its Young's modulus; None: its own",
        unit="Pa",
        flag="--modulus",
        parse=float,
    )
    seed: int = seed_operand()


def _answer(result: Explored, asked: ExploreOperands, out: Output) -> int:
    page = None if asked.report is None else result.report(asked.report)
    if not asked.robot:  # whose lines are all JSON
        if page is not None:
            out.say(f"report: {page}")
        say_next(result, out)
    out.json(result.as_json())
    return 0


@operation(
    ExploreOperands,
    GoalOptions,
    ReachOptions,
    RobotOptions,
    often="complete most",
    answer=_answer,
    progress=False,
)
def explore(asked: ExploreOperands, call: Call) -> Explored:
    """Explore until a goal, the limit or the robot ends it; what was known after each touch."""
    if (asked.phantom is not None) + asked.robot + (asked.device is not None) != 1:
        raise OptionError("say who touches: one of --phantom NAME, --robot and --device NAME")
    goals, reach = call.of(GoalOptions), call.of(ReachOptions)
    check_goals(goals)
    if not POISSON_RATIO.takes(asked.poisson_ratio):
        raise OptionError(f"--poisson-ratio is {asked.poisson_ratio}; it must be {POISSON_RATIO.words}")
    by = _by_robot if asked.robot else _in_window if asked.device else _on_phantom
    return by(asked, call, goals, reach)


def _explorer(
    asked: ExploreOperands, goals: GoalOptions, reach: ReachOptions, instrument: Instrument, nu: float
) -> Explorer:
    """A new one, or one that goes on with what --continue names."""
    if asked.going_on is None:
        return Explorer(instrument, goals, reach, poisson_ratio=nu, seed=asked.seed)
    recording = read_recording(asked.going_on)
    made = Explorer.going_on(recording, goals, reach, poisson_ratio=nu, seed=asked.seed)
    if not np.isclose(made.instrument.tip_radius_m, instrument.tip_radius_m, rtol=0.01):
        raise OptionError(
            f"{asked.going_on} was explored with a tip of {mm(made.instrument.tip_radius_m, '.2f')}, "
            f"this one has {mm(instrument.tip_radius_m, '.2f')}: go on with the same tip"
        )
    return made


def _in_window(asked: ExploreOperands, call: Call, goals: GoalOptions, reach: ReachOptions) -> Explored:
    from palpate.operations.touch import touch
    from palpate.window.guide import Guide

    kept: list[Explorer] = []

    def guided(session: TouchSession) -> Guide:
        servo, nu = session.servo, session.model.material.poisson_ratio
        instrument = Instrument(
            servo.tip_radius_m, servo.options.rate_hz, {"object_name": session.title, "poisson_ratio": nu}
        )
        kept.append(_explorer(asked, goals, reach, instrument, nu))
        return Guide(kept[-1], servo, session.model, session.worker, asked.output)

    given = {"seconds": asked.seconds, "screenshot": asked.screenshot}
    touched = touch(
        asked.scene,
        device=asked.device,
        seed=asked.seed,
        guide=guided,
        **{name: value for name, value in given.items() if value is not None},
    )
    if touched is not None:
        call.out.say(*touched.lines())
    call.out.say(_line(kept[-1].suggest(), kept[-1].state))
    return kept[-1].explored(asked.output)


def _by_robot(asked: ExploreOperands, call: Call, goals: GoalOptions, reach: ReachOptions) -> Explored:
    from palpate.robot import serve

    if not (asked.rate_hz > 0 and asked.tip_radius_m > 0):
        raise OptionError("--rate and --tip-radius must be greater than 0")
    about = {"poisson_ratio": asked.poisson_ratio}
    instrument = Instrument(asked.tip_radius_m, asked.rate_hz, about)
    explorer = _explorer(asked, goals, reach, instrument, asked.poisson_ratio)

    def tell(line: str) -> None:
        print(line, flush=True)

    serve(explorer, sys.stdin, tell, lambda e: e.save(asked.output))
    return explorer.explored(asked.output)


def _on_phantom(asked: ExploreOperands, call: Call, goals: GoalOptions, reach: ReachOptions) -> Explored:
    from palpate.robot import LaboratoryRobot
    from palpate.scenes.laboratory.session import SimulateOptions
    from palpate.scenes.phantoms import phantom

    thing = phantom(str(asked.phantom))
    options = SimulateOptions(young_modulus_pa=asked.young_modulus_pa, tip_radius_m=asked.tip_radius_m)
    check_ranges(options)
    robot = LaboratoryRobot(
        thing,
        effects_from(asked.effects) or {},
        seed=asked.seed,
        options=options,
        robot=call.of(RobotOptions),
    )
    explorer = _explorer(asked, goals, reach, robot.instrument, thing.poisson_ratio)
    robot.made = sum(s.kind == "press" for s in explorer.segments)
    with call.progress("explore") as tell:
        while True:
            made = explorer.state.made
            tell(f"touch {made + 1} of at most {goals.most}", min(made / goals.most, 1.0))
            suggestion = explorer.suggest()
            call.out.say(_line(suggestion, explorer.state))
            if suggestion.kind == "stop":
                break
            explorer.add(robot.carry_out(suggestion))
            explorer.save(asked.output)
    call.out.say(f"written to {asked.output}")
    return explorer.explored(asked.output, None if robot.last is None else robot.last.truth)


def _line(suggestion: Suggestion, state: ExplorationState) -> str:
    """One touch a line: what is known, what comes next, why."""
    known = "nothing is known yet"
    if state.presses and state.surface:
        known = (
            f"{state.made} presses, {state.seconds:.0f} s: {kpa(state.modulus_pa, '.1f')} "
            f"({state.modulus_ci95_pa[0] / 1e3:.1f} to {state.modulus_ci95_pa[1] / 1e3:.1f}), "
            f"surface within {mm(state.surface_error_m, '.1f')}"
        )
    if state.causes is not None:
        likeliest, *others = state.causes.not_ruled_out(state.cause_at)
        known += f", cause: {likeliest}" + (f" or {len(others)} others" if others else "")
    if suggestion.point is None:
        return f"{known}; {suggestion.kind}: {suggestion.why}"
    x, y, z = (1e3 * float(v) for v in suggestion.point)
    return (
        f"{known}; press at ({x:.0f}, {y:.0f}, {z:.0f}) mm, {mm(suggestion.depth_m, '.1f')} deep: "
        f"{suggestion.why}"
    )
