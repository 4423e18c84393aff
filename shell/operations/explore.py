"""Guided exploration: where to touch next and why, what is known so far, and when to stop.

In the virtual laboratory (--phantom NAME) a simulated robot follows the suggestions with errors of place,
way and depth. In the touch window (--device NAME, --scene) a ghost tip shows where and how to press. A robot
of your own talks over standard input and output (--robot): one line of JSON for each suggestion and each
segment, see docs/howto/robot.md. The recording is written after every touch: an interrupted exploration is a
valid recording, and --continue goes on with it. At the end `palpate reconstruct` makes a MODEL from it as
from any other.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any
from warnings import warn

import numpy as np

from palpate.diagnosis.explore.candidates import ReachOptions
from palpate.diagnosis.explore.explorer import ExplorationState, Explorer, Suggestion
from palpate.diagnosis.explore.goals import GoalOptions, check_goals
from palpate.diagnosis.explore.segments import Instrument
from palpate.diagnosis.explore.suggestion import Explored
from palpate.mechanics.disk.writing import written_at
from palpate.mechanics.errors import DeviceError, OptionError, PalpateWarning
from palpate.mechanics.options import check_ranges, flag_of
from palpate.mechanics.plausible import POISSON_RATIO, USUAL_POISSON_RATIO, USUAL_TIP_RADIUS_M
from palpate.mechanics.recording.files import SAMPLES, recording_files
from palpate.mechanics.recording.recording import read_recording
from palpate.operations._call import Call
from palpate.operations._declare import Given, operation, option
from palpate.operations._shared import PhantomFileOptions, Seed, output_option, report_option
from palpate.operations._written import typed
from palpate.operations.simulate import effects_from
from palpate.robot import LaboratoryRobot, RobotOptions, serve
from palpate.scenes.laboratory.session import SimulateOptions
from palpate.scenes.phantoms import phantom as named
from palpate.show import next_lines
from palpate.words import kpa, mm

if TYPE_CHECKING:
    from palpate.window.guide import Guide
    from palpate.window.session import TouchSession


@operation(common="complete most modulus_within surface_within_m cause_at", progress=False)
def explore(
    *,
    phantom: Annotated[
        str | None, option("explore this phantom of the laboratory, or a surface file", metavar="NAME")
    ] = None,
    robot: Annotated[bool, option("talk with a robot: lines of JSON, in and out")] = False,
    device: Annotated[
        str | None, option("explore in the touch window: mouse, or another", metavar="NAME")
    ] = None,
    scene: Annotated[
        str | None, option("with --device: what is felt; None: nodule", metavar="MODEL_OR_SCENE")
    ] = None,
    screenshot: Annotated[
        str | None, option("with --device: save the window at its end", metavar="PNG", advanced=True)
    ] = None,
    seconds: Annotated[
        float | None, option("with --device: stop after this time", unit="s", advanced=True)
    ] = None,
    going_on: Annotated[
        str | None,
        option(
            "go on with what was explored so far; REC may be --output too", flag="--continue", metavar="REC"
        ),
    ] = None,
    report: Annotated[
        str | None, report_option("write the page of what was touched, what is known, and why")
    ] = None,
    output: Annotated[
        str, output_option("recording to write (.csv.gz, .csv), after every touch", "REC", SAMPLES)
    ],
    effects: Annotated[
        Mapping[str, float] | None,
        option(
            "with --phantom: an effect (repeatable)",
            flag="--effect",
            metavar="NAME=STRENGTH",
            count="repeat",
            advanced=True,
        ),
    ] = None,
    tip_radius_m: Annotated[
        float | None,
        option(
            "with --robot or --phantom: radius of the spherical tip; None: 0.005", unit="m", advanced=True
        ),
    ] = None,
    rate_hz: Annotated[
        float | None, option("with --robot: samples a second; None: 1000", unit="Hz", advanced=True)
    ] = None,
    poisson_ratio: Annotated[
        float | None, option("with --robot: Poisson's ratio of the object; None: 0.49", advanced=True)
    ] = None,
    young_modulus_pa: Annotated[
        float | None,
        option(
            "with --phantom: its Young's modulus; None: its own",
            unit="Pa",
            flag="--modulus",
            parse=float,
            advanced=True,
        ),
    ] = None,
    seed: Seed = 0,
    file: Given[PhantomFileOptions],
    goals: GoalOptions,
    reach: ReachOptions,
    errors: Given[RobotOptions],
    call: Call,
) -> Explored:
    """Explore until a goal, the limit or the robot ends it; what was known after each touch."""
    if (phantom is not None) + robot + (device is not None) != 1:
        raise OptionError("give who touches: one of --phantom NAME, --robot and --device NAME")
    check_goals(goals)
    _give_way(going_on, output, call)
    begun = partial(_explorer, going_on, goals, reach, seed)
    said = {
        "scene": scene, "screenshot": screenshot, "seconds": seconds, "effects": effects,
        "tip_radius_m": tip_radius_m, "rate_hz": rate_hz, "poisson_ratio": poisson_ratio,
        "young_modulus_pa": young_modulus_pa, **file, **errors,
    }  # fmt: skip
    _refuse_idle("--robot" if robot else "--device" if device else "--phantom", said)
    tip_radius_m = USUAL_TIP_RADIUS_M if tip_radius_m is None else tip_radius_m
    if robot:
        result = _by_robot(begun, output, rate_hz, tip_radius_m, poisson_ratio)
    elif device:
        given = {"device": device, "seed": seed, "seconds": seconds, "screenshot": screenshot, **file}
        result = _in_window(begun, output, scene or "nodule", given, call)
    else:
        thing = named(str(phantom), **file)
        options = SimulateOptions(young_modulus_pa=young_modulus_pa, tip_radius_m=tip_radius_m)
        check_ranges(options)
        acting = effects_from(effects) or {}
        errs = RobotOptions(**errors)
        explored = LaboratoryRobot(thing, acting, seed=seed, options=options, robot=errs)
        result = _on_phantom(begun, output, explored, goals.most, call)
    result = replace(result, said=call.given)
    call.said = True
    if robot:  # whose lines are all JSON
        if report is not None:
            result.report(report)
        call.following = []
    else:
        call.then_report(result, report)
    return result


_OF_A_FILE = frozenset(each.name for each in fields(PhantomFileOptions))
_TAKES = {
    "--phantom": {"effects", "young_modulus_pa", "tip_radius_m", *_OF_A_FILE}
    | {each.name for each in fields(RobotOptions)},
    "--device": {"scene", "screenshot", "seconds", *_OF_A_FILE},
    "--robot": {"tip_radius_m", "rate_hz", "poisson_ratio"},
}
"""Who touches: what is said of that kind of exploration alone."""


def _refuse_idle(who: str, said: Mapping[str, Any]) -> None:
    """Raise OptionError for what would be said in vain: another kind of exploration takes it."""
    for name in (name for name, value in said.items() if value is not None and name not in _TAKES[who]):
        flag = flag_of(explore.operation.fields[name])  # type: ignore[attr-defined]
        others = " or ".join(each for each, names in _TAKES.items() if name in names)
        raise OptionError(f"{flag} goes with {others}, not with {who}")


def _give_way(going_on: str | None, output: str, call: Call) -> None:
    """Say that a recording which is there is replaced. What is gone on with may be: it is read first, and
    every file that is written holds all of it. Raises OptionError where no exploration wrote that."""
    file, _ = written_at(output, SAMPLES)[0]
    if not file.exists():
        return
    if going_on is None or not any(file.samefile(each) for each in recording_files(Path(going_on))):
        warn(
            f"{file} is there, and is replaced after the first touch; to go on with it: "
            f"`{typed('explore', {**call.given, 'going_on': file})}`",
            PalpateWarning, stacklevel=2,
        )  # fmt: skip
    elif not read_recording(going_on).segments:
        raise OptionError(
            f"--output would replace {going_on}, which is no exploration's: name another output"
        )


@contextmanager
def _kept(explorers: list[Explorer], output: str, call: Call) -> Iterator[None]:
    """Where it is interrupted, what was kept and how to go on. explorers: none before one has begun."""
    try:
        yield
    except KeyboardInterrupt:
        for explorer in (each for each in explorers if each.segments):
            result = replace(explorer.explored(output), said=call.given)
            call.out.say(f"interrupted; kept in {output}", *result.lines(), *next_lines(result))
        raise


Begun = Callable[[Instrument, float], Explorer]
"""(instrument, Poisson's ratio) -> an explorer that has just begun, or that goes on."""


def _explorer(
    going_on: str | None,
    goals: GoalOptions,
    reach: ReachOptions,
    seed: int,
    instrument: Instrument,
    nu: float,
) -> Explorer:
    """A new one, or one that goes on with what --continue names."""
    if going_on is None:
        return Explorer(instrument, goals, reach, poisson_ratio=nu, seed=seed)
    made = Explorer.going_on(read_recording(going_on), goals, reach, poisson_ratio=nu, seed=seed)
    if not np.isclose(made.instrument.tip_radius_m, instrument.tip_radius_m, rtol=0.01):
        raise OptionError(
            f"{going_on} was explored with a tip of {mm(made.instrument.tip_radius_m, '.2f')}, "
            f"this one has {mm(instrument.tip_radius_m, '.2f')}: go on with the same tip"
        )
    return made


def _in_window(begun: Begun, output: str, scene: str, given: Mapping[str, Any], call: Call) -> Explored:
    from palpate.operations.touch import VIRTUAL_SCREEN, touch
    from palpate.show.scenery import no_screen
    from palpate.window.guide import Guide

    kept: list[Explorer] = []
    guides: list[Guide] = []

    def guided(session: TouchSession) -> Guide:
        servo, nu = session.servo, session.model.material.poisson_ratio
        about = {"object_name": session.title, "poisson_ratio": nu}
        kept.append(begun(Instrument(servo.tip_radius_m, servo.options.rate_hz, about), nu))
        guides.append(Guide(kept[-1], servo, session.model, session.worker, output))
        return guides[-1]

    said = {name: value for name, value in given.items() if value is not None}
    if why := no_screen():
        raise DeviceError(
            f"{why}: watch a simulated robot explore (`palpate explore --phantom dome -o REC`), or use "
            f"{VIRTUAL_SCREEN}"
        )
    with _kept(kept, output, call):
        try:
            touched = touch(scene, guide=guided, **said)
        finally:
            for guide in guides:
                guide.keep_tracing()
    if touched is not None:
        call.out.say(*touched.lines())
    call.out.say(_line(kept[-1].suggest(), kept[-1].state))
    return kept[-1].explored(output if kept[-1].segments else "")


def _by_robot(
    begun: Begun, output: str, rate_hz: float | None, tip_radius_m: float, poisson_ratio: float | None
) -> Explored:
    rate_hz = 1000.0 if rate_hz is None else rate_hz
    nu = USUAL_POISSON_RATIO if poisson_ratio is None else poisson_ratio
    if not (rate_hz > 0 and tip_radius_m > 0):
        raise OptionError("--rate and --tip-radius must be greater than 0")
    if not POISSON_RATIO.takes(nu):
        raise OptionError(f"--poisson-ratio is {nu}; it must be {POISSON_RATIO.words}")
    explorer = begun(Instrument(tip_radius_m, rate_hz, {"poisson_ratio": nu}), nu)

    def send(line: str) -> None:
        print(line, flush=True)

    serve(explorer, sys.stdin, send, lambda e: e.save(output))
    return explorer.explored(output)


def _on_phantom(begun: Begun, output: str, robot: LaboratoryRobot, most: int, call: Call) -> Explored:
    explorer = begun(robot.instrument, robot.phantom.poisson_ratio)
    robot.made = sum(s.kind == "press" for s in explorer.segments)
    before: ExplorationState | None = None
    with _kept([explorer], output, call), call.progress("explore") as show_progress:
        while True:
            made = explorer.state.made
            show_progress(f"touch {made + 1} of at most {most}", min(made / most, 1.0))
            suggestion = explorer.suggest()
            call.out.say(_line(suggestion, explorer.state, before))
            before = explorer.state
            if suggestion.kind == "stop":
                break
            explorer.add(robot.carry_out(suggestion))
            explorer.save(output)
    call.out.say(f"written to {output}")
    return explorer.explored(output, None if robot.last is None else robot.last.truth)


def _line(suggestion: Suggestion, state: ExplorationState, before: ExplorationState | None = None) -> str:
    """One touch a line: what is known, whether less surely than before, what comes next, why."""
    known = "nothing is known yet"
    if state.presses and state.surface:
        known = (
            f"{state.made} presses, {state.seconds:.0f} s: {kpa(state.modulus_pa, '.1f')} "
            f"({state.modulus_ci95_pa[0] / 1e3:.1f} to {state.modulus_ci95_pa[1] / 1e3:.1f}), "
            f"surface within {mm(state.surface_error_m, '.1f')}"
        )
        if before is not None and before.surface and state.surface_error_m > before.surface_error_m + 5e-5:
            known += " (less sure than before: the last press did not fit the shape as it was known)"
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
