"""Feel a model or scene at 1 kHz: in a window, or headless.

MODEL_OR_SCENE is a MODEL folder, a scene (demo, silicone-1, silicone-2, silicone-3, bean, nodule,
your-recording, or a scene's .toml), a recording, a phantom, or the file of a surface (STL, OBJ, PLY, glTF,
VTP, VTU, MSH, INP) with --unit and --modulus. In the window the mouse hovers over the
object, the left button presses, the wheel sets the depth, the right button turns the view; H lists the keys.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from devices.channel import PoseChannel
from devices.intention import Intention
from devices.mapper import MapperOptions, Mapping
from devices.registry import DEVICES, DeviceChoice, options_of, spec_of
from mechanics.errors import DeviceError, OptionError
from mechanics.files import PNG
from mechanics.model import Model
from mechanics.progress import Progress
from mechanics.recording import SAMPLES
from palpate.arguments import (
    add_input,
    add_json,
    add_options,
    add_output,
    add_seed,
    emit_json,
    finite,
    options_from,
    progress_bar,
    say,
)
from palpate.servo import SafetyOptions, ServoOptions
from palpate.sources import add_mesh_arguments, given_scene, with_friction
from palpate.window.session import TouchSession
from render.options import RenderOptions
from render.registry import names
from render.support import SupportOptions
from scenes.build import model_of
from scenes.exploration import ExplorationOptions, explore
from scenes.scene import Scene

if TYPE_CHECKING:
    from palpate.window.guide import Guide

SUMMARY = "feel a model or scene at 1 kHz"
DEFAULT_SCENE = "demo"
POLL_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The scene, the device, the window, and every option of the parts."""
    add_input(
        parser,
        "scene",
        nargs="?",
        default=DEFAULT_SCENE,
        metavar="MODEL_OR_SCENE",
        help=f"what to touch (default: {DEFAULT_SCENE})",
    )
    add_mesh_arguments(parser)
    parser.add_argument(
        "--device",
        metavar="NAME",
        help=f"one of {', '.join(DEVICES)} (default: mouse; headless: simulated)",
    )
    parser.add_argument("--headless", action="store_true", help="no window: all else is the same")
    parser.add_argument(
        "--seconds",
        type=finite,
        metavar="NUMBER",
        help="stop after this time [s] (default: when the window closes)",
    )
    add_output(
        parser, "--record", kind=SAMPLES, metavar="REC", type=Path,
        help="write the session as a recording (NAME.csv.gz)",
    )  # fmt: skip
    add_input(parser, "--replay", metavar="REC", help="the recording that the device 'replay' plays")
    parser.add_argument(
        "--renderer", metavar="NAME", help=f"one of {', '.join(names())} (default: the scene's)"
    )
    parser.add_argument("--beside", metavar="NAME", help="a second renderer, driven by the same tip; 'none'")
    add_output(
        parser,
        "--screenshot",
        kind=PNG,
        metavar="PNG",
        type=Path,
        help="save the window at its end",
    )
    add_options(parser, MapperOptions)
    add_options(parser, RenderOptions)
    add_options(parser, ServoOptions, skip=("safety", "passivity", "support_plane", "tip_offsets_m"))
    add_options(parser, SupportOptions)
    add_options(parser, SafetyOptions)
    for name in DEVICES:
        add_options(parser, options_of(name))
    add_options(parser, ExplorationOptions)
    add_seed(parser)
    add_json(parser)


def run(arguments: argparse.Namespace, guided: Callable[[TouchSession], Guide] | None = None) -> int:
    """Open, touch, close; prints what the servo did. guided: makes an exploration's guide, for the window."""
    scene = given_scene(arguments, arguments.scene)
    name = arguments.device or ("simulated" if arguments.headless else "mouse")
    _check(arguments, name)
    servo_options = options_from(
        arguments,
        ServoOptions,
        safety=options_from(arguments, SafetyOptions),
        support_plane=options_from(arguments, SupportOptions),
    )
    for word in servo_options.loosened:
        print(f"palpate touch: {word}", file=sys.stderr)
    with ExitStack() as stack:
        channel = stack.enter_context(closing(PoseChannel.create())) if name == "mouse" else None

        def prepare(tell: Progress) -> tuple[TouchSession, float | None]:
            model = model_of(scene, lambda stage, share: tell(stage, 0.5 * share))
            if channel is not None:
                channel.write(time.perf_counter(), tuple(_above(model)))
            device, until = device_choice(arguments, name, model, channel)
            session = stack.enter_context(
                TouchSession(
                    model,
                    title=scene.title,
                    device=device,
                    renderer=arguments.renderer or scene.renderer,
                    beside=_beside(arguments, scene),
                    render_options=with_friction(options_from(arguments, RenderOptions), scene),
                    mapping=_mapping(arguments, name, scene, model),
                    options=servo_options,
                    recording=arguments.record,
                    pictures=not arguments.headless,
                )
            )
            session.start(lambda stage, share: tell(stage, 0.5 + 0.5 * share))
            return session, until

        if arguments.headless:
            with progress_bar("touch") as bar:
                session, until = prepare(bar)
            session.enable()
            _wait(session, until if arguments.seconds is None else arguments.seconds)
        else:
            shown = _in_window(prepare, scene, channel, arguments, guided)
            if shown is None:
                return 0
            session = shown
        report = session.report()
    say(arguments, f"{scene.title}: {session.renderer_name}, {name}", str(report))
    if arguments.record is not None:
        say(arguments, f"recorded {arguments.record}")
    emit_json({"scene": scene.name, "device": name, "servo": report.as_dict()}, arguments.json)
    if session.servo.failure:
        raise DeviceError(session.servo.failure)
    return 0


def _in_window(
    prepare: Callable[[Progress], tuple[TouchSession, float | None]],
    scene: Scene,
    channel: PoseChannel | None,
    arguments: argparse.Namespace,
    guided: Callable[[TouchSession], Guide] | None,
) -> TouchSession | None:
    """A window from the first moment on, which shows how the preparation comes along; then the touch. None
    where a person closes it before."""
    from palpate.window.waiting import ClosedError, WaitingWindow
    from palpate.window.window import SIZE, TouchWindow

    waiting = WaitingWindow(f"Palpate: {scene.title}", SIZE)
    try:
        session, until = waiting.run(prepare)
        session.enable()
        guide = None if guided is None else guided(session)
        window = TouchWindow(session, scene, channel, guide=guide)
        seconds = until if arguments.seconds is None else arguments.seconds
        window.run(seconds, screenshot=arguments.screenshot, shown=waiting.close)
    except ClosedError as error:
        print(f"palpate touch: {error}", file=sys.stderr)
        return None
    finally:
        waiting.close()
    return session


def _check(arguments: argparse.Namespace, name: str) -> None:
    for value, allowed, what in (
        (name, tuple(DEVICES), "device"),
        (arguments.renderer, names(), "renderer"),
        (arguments.beside, (*names(), "none"), "renderer"),
    ):
        if value is not None and value not in allowed:
            raise OptionError(f"'{value}' is no {what}; allowed are {', '.join(allowed)}")
    if arguments.seconds is not None and not arguments.seconds > 0:
        raise OptionError(f"--seconds is {arguments.seconds}; it must be greater than 0")
    if name == "replay" and not arguments.replay:
        raise OptionError("the device 'replay' plays a recording: name it with --replay REC")
    if arguments.headless:
        if name == "mouse":
            raise DeviceError("the mouse needs the window: drop --headless, or use --device simulated")
    elif sys.platform.startswith("linux") and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise DeviceError(
            "there is no screen (neither DISPLAY nor WAYLAND_DISPLAY is set): use --headless, a desktop, or "
            "'xvfb-run -s \"-screen 0 1280x800x24\" palpate touch ...'"
        )


def device_choice(
    arguments: argparse.Namespace, name: str, model: Model, channel: PoseChannel | None
) -> tuple[DeviceChoice, float | None]:
    """The device for the servo process to make, and when it will have done (s), None for never."""
    options: Any = options_from(arguments, options_of(name))
    if channel is not None:
        return DeviceChoice(name, {"channel": str(channel.path), "options": options}), None
    if name == "replay":
        recording = str(Path(arguments.replay).resolve())
        return DeviceChoice(name, {"recording": recording, "options": options}), None
    if name == "simulated":
        path, _ = explore(
            model,
            options_from(arguments, ExplorationOptions),
            hand_stiffness_n_per_m=options.stiffness_n_per_m,
            seed=arguments.seed,
        )
        intention: Intention = path
        keywords = {"options": options, "intention": intention, "seed": arguments.seed}
        return DeviceChoice(name, keywords), path.duration_s + 2.0
    return DeviceChoice(name, {"options": options}), None


def _beside(arguments: argparse.Namespace, scene: Scene) -> str:
    if arguments.beside is not None:
        return "" if arguments.beside == "none" else arguments.beside
    return "" if arguments.headless else scene.beside


def _mapping(arguments: argparse.Namespace, name: str, scene: Scene, model: Model) -> Mapping | None:
    """None, the identity, for devices that live in the scene's frame already."""
    if name in ("mouse", "simulated", "replay"):
        return None
    given = {f: getattr(arguments, f) for f in MapperOptions.__dataclass_fields__ if hasattr(arguments, f)}
    options = MapperOptions(**{**vars(scene.mapper), **given})
    return Mapping.from_options(options, centre_m=_above(model), rate=spec_of(name).control == "rate")


def _above(model: Model) -> np.ndarray:
    """(3,) m, two finger's widths over the middle of the object: where a device's middle lies."""
    top = model.support.height(model.mesh.points).max()
    return model.mesh.points[model.mesh.fixed].mean(axis=0) + (top + 0.03) * model.support.normal


def _wait(session: TouchSession, seconds: float | None) -> None:
    """Collect frames until the time is up; without a time, until Ctrl-C."""
    start = time.perf_counter()
    with progress_bar("touching") as bar:
        while session.servo.alive:
            elapsed = time.perf_counter() - start
            if seconds is not None:
                if elapsed >= seconds:
                    return
                bar(f"{elapsed:.0f} of {seconds:.0f} s", elapsed / seconds)
            session.frame()
            time.sleep(POLL_S)
