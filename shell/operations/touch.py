"""Feel a model or scene at 1 kHz: in a window, or headless.

MODEL_OR_SCENE is a MODEL folder, a scene (demo, silicone-1, silicone-2, silicone-3, bean, nodule,
your-recording, or a scene's .toml), a recording, a phantom, or the file of a surface (STL, OBJ, PLY, glTF,
VTP, VTU, MSH, INP) with --unit and --modulus. In the window the mouse hovers over the object, the left button
presses, the wheel sets the depth, the right button turns the view; buttons do the rest.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from collections.abc import Mapping as Table
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from palpate.devices.channel import PoseChannel
from palpate.devices.mapper import MapperOptions, Mapping
from palpate.devices.registry import DEVICES, DeviceChoice, options_of, spec_of
from palpate.mechanics.disk.writing import PNG
from palpate.mechanics.errors import DeviceError, OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.names import unknown
from palpate.mechanics.progress import Progress
from palpate.operations._call import Call
from palpate.operations._declare import EachOf, Given, argument, operation, option
from palpate.operations._shared import SAMPLES, MeshFileOptions, Seed, given_model, given_scene, with_friction
from palpate.operations.load import load
from palpate.output import Output, progress_bar
from palpate.render.options import RenderOptions
from palpate.render.registry import names
from palpate.scenes.build import model_of
from palpate.scenes.scene import Scene, load_scene, scene_names
from palpate.scenes.virtual_presses import ExplorationOptions, explore
from palpate.servo import ServoOptions, ServoReport
from palpate.servo.started import StartedServo
from palpate.warm_up import OF_A_TOUCH, OF_ITS_SERVO, is_compiled, warming_up
from palpate.window.session import SessionOptions, TouchSession
from palpate.words import typed_word

if TYPE_CHECKING:
    from palpate.operations._shared import ModelLike
    from palpate.window.guide import Guide

POLL_S = 0.1
DEFAULT = "demo"
_ONCE = "new here, so it is prepared once and kept, which takes a minute or more:"
_BRIEF = ("starting", "loading the model", "compiling the loop", "touching")
"""Stages of every touch, of objects that are known here too."""
_NOT_RECORDED = "keep the touch, for reconstruct, compare and diagnose: --record REC.csv.gz"


@dataclass(frozen=True)
class ServoRun:
    """What the servo did. failure: what stopped it, '' where nothing did. table: of the compliance that was
    felt at the end, keys with units; table_words: the same, '' for the whole one. object_words: what was made
    of a file of several bodies, or of an open surface."""

    scene: Scene
    device: str
    renderer: str
    report: ServoReport
    record: str | Path | None
    failure: str
    table: Table[str, Any] = field(default_factory=dict)
    table_words: str = ""
    object_words: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """For a person."""
        recorded = [] if self.record is None else [f"recorded {self.record}"]
        device = spec_of(self.device)
        report = self.report.text(to=device.title if device.has_force else "")
        table = [f"at the end: {self.table_words}; what is solved is kept"] if self.table_words else []
        made_of = [f"  {words}" for words in self.object_words]
        return [f"{self.scene.title}: {self.renderer}, {self.device}", *made_of, report, *table, *recorded]

    def as_json(self) -> dict[str, Any]:
        """What the servo did, keys with units."""
        servo = self.report.as_dict()
        return {"scene": self.scene.name, "device": self.device, "table": dict(self.table), "servo": servo}

    def exit_code(self) -> int:
        """0; raises DeviceError for what stopped it."""
        if self.failure:
            raise DeviceError(self.failure)
        return 0


@operation(common="young_modulus_pa unit friction max_force_n", progress=False)
def touch(
    scene: Annotated[
        ModelLike | None,
        argument(
            "what to touch; None: chosen in the window, headless: demo",
            metavar="MODEL_OR_SCENE",
            count="?",
            reads=True,
        ),
    ] = None,
    *,
    device: Annotated[
        str | None, option(f"one of {', '.join(DEVICES)}; None: mouse; headless: simulated", metavar="NAME")
    ] = None,
    headless: Annotated[bool, option("run without a window, otherwise the same")] = False,
    seconds: Annotated[
        float | None, option("stop after this time; None: when the window closes", unit="s")
    ] = None,
    record: Annotated[
        str | Path | None,
        option("write the session as a recording (NAME.csv.gz)", metavar="REC", writes=SAMPLES),
    ] = None,
    replay: Annotated[
        str | None, option("the recording that the device 'replay' plays", metavar="REC", reads=True)
    ] = None,
    renderer: Annotated[
        str | None, option(f"one of {', '.join(names())}; None: the scene's", metavar="NAME")
    ] = None,
    beside: Annotated[
        str | None,
        option(
            "a second renderer, driven by the same tip, or 'none'; None: the scene's",
            metavar="NAME",
            advanced=True,
        ),
    ] = None,
    screenshot: Annotated[
        str | Path | None, option("save the window at its end", metavar="PNG", writes=PNG)
    ] = None,
    seed: Seed = 0,
    guide: Annotated[
        Callable[[TouchSession], Guide] | None,
        option("makes the guide of an exploration, for the window", only="python"),
    ] = None,
    file: Given[MeshFileOptions],
    mapper: Given[MapperOptions],
    render: RenderOptions,
    servo: ServoOptions,
    devices: Annotated[Table[str, Any], EachOf({name: options_of(name) for name in DEVICES})],
    exploration: ExplorationOptions,
    call: Call,
) -> ServoRun | None:
    """Open a window, touch, close it; None where it was closed before the touch began.

    In a notebook, where no device is named, the page in which the object is pressed is shown instead, and
    None returned. Lengths m, forces N. Raises OptionError for a model that is in no folder where a window or
    a device is to touch it, DeviceError for what the device cannot.
    """
    from palpate.show.notebook import in_notebook

    name = device or ("simulated" if headless else "mouse")
    if name == "mouse" and in_notebook():
        _on_a_page(scene, record, screenshot, file, call)
        return None
    scene = _named(scene)
    _check(name, renderer, beside, seconds, replay, headless)
    if headless and screenshot is not None:
        raise OptionError("--screenshot saves the window, and --headless has none: drop one of the two")
    for word in servo.loosened:
        print(f"palpate touch: {word}", file=sys.stderr)

    def session_of(scene: Scene) -> SessionOptions:
        second = beside or ("" if headless else scene.beside)
        return SessionOptions(
            renderer=renderer or scene.renderer,
            beside="" if second == "none" else second,
            render=with_friction(render, scene),
            servo=servo,
            recording=None if record is None else Path(record),
            pictures=not headless,
        )

    with warming_up(OF_A_TOUCH) as compiling:  # while a person chooses, too
        opening = _Opening(
            device=name,
            scene=partial(given_scene, said=file),
            session_of=session_of,
            choice=partial(device_choice, name, devices[name], exploration, replay, seed),
            mapping=partial(_mapping, mapper, name),
            record=record,
            compiling=compiling,
        )
        if headless:
            touched: ServoRun | None = _without(opening, scene or DEFAULT, seconds, call.out)
        else:
            picture = None if screenshot is None else Path(screenshot)
            touched = _in_window(opening, scene, seconds, guide, picture)
    if touched is not None:
        follows = (
            f"see what it holds: palpate check {typed_word(touched.record)}"
            if touched.record
            else _NOT_RECORDED
        )
        call.following = [f"next: {follows}"]
        call.exit_code = touched.exit_code
    return touched


def _on_a_page(scene: Any, record: Any, screenshot: Any, file: Table[str, Any], call: Call) -> None:
    """The page in which it is pressed, in the cell that runs."""
    from palpate.show.notebook import show_page_to_press

    if record is not None or screenshot is not None:
        raise OptionError(
            "a notebook's page to press records nothing: run `palpate touch ... --record REC.csv.gz` in a "
            'terminal, or name a device (device="simulated", headless=True)'
        )
    model = load(given_model(DEFAULT if scene is None else scene, file, "touch"), progress=call.wanted)
    with call.progress("touch") as show_progress:
        show_page_to_press(model, show_progress)


def _named(scene: Any) -> str | None:
    """What a process of its own opens: a name or path."""
    if scene is None or isinstance(scene, str | Path):
        return None if scene is None else str(scene)
    model = load(scene)
    if model.path is None:
        raise OptionError('this model is in memory alone: made.save("MODEL"), then pp.touch("MODEL")')
    return str(model.path)


def _without(opening: _Opening, name: str, seconds: float | None, out: Output) -> ServoRun:
    """Touch without a window, and say before what takes long: an object that is new here is meshed and
    solved for a minute or more, and a new installation compiles."""
    scene = opening.scene(name)
    with ExitStack() as stack:
        servo = stack.enter_context(StartedServo(OF_ITS_SERVO))
        with progress_bar("touch") as bar:
            session, until = opening.session(stack, servo, scene, None, out.stages(bar, _ONCE, _BRIEF))
        session.enable()
        _wait(session, until if seconds is None else seconds)
        return opening.touched(session, scene)


@dataclass(frozen=True)
class _Opening:
    """What was asked for, of whichever scene. compiling: waits for the loop's kernels."""

    device: str
    scene: Callable[[str], Scene]
    session_of: Callable[[Scene], SessionOptions]
    choice: Callable[[Model, PoseChannel | None], tuple[DeviceChoice, float | None]]
    mapping: Callable[[Scene, Model], Mapping | None]
    record: str | Path | None
    compiling: Callable[[], object]

    def session(
        self,
        stack: ExitStack,
        servo: StartedServo,
        scene: Scene,
        channel: PoseChannel | None,
        show_progress: Progress,
    ) -> tuple[TouchSession, float | None]:
        """A started session, which the stack closes, and when its device will have done (s)."""
        model = model_of(scene, lambda stage, share: show_progress(stage, 0.4 * share))
        if channel is not None:
            channel.write(time.perf_counter(), tuple(_above(model)))
        device, until = self.choice(model, channel)
        options, mapping = self.session_of(scene), self.mapping(scene, model)

        def compiled() -> None:
            if options.renderer == "fem" and not all(map(is_compiled, OF_A_TOUCH)):
                show_progress("compiling, once after an installation", 0.5)
                self.compiling()

        session = TouchSession(
            model, title=scene.title, device=device, mapping=mapping, options=options, started=servo
        )
        opened = stack.enter_context(session)
        opened.start(lambda stage, share: show_progress(stage, 0.5 + 0.5 * share), compiled=compiled)
        return session, until

    def touched(self, session: TouchSession, scene: Scene) -> ServoRun:
        """What was done."""
        from palpate.show.model import mended_words, parts_words

        made_of = tuple(filter(None, (words(session.model) for words in (parts_words, mended_words))))
        report, failure = session.report(), session.servo.failure
        return ServoRun(
            scene, self.device, session.renderer_name, report, self.record, failure, session.table.state,
            session.table.words, made_of,
        )  # fmt: skip


def _in_window(
    opening: _Opening,
    asked: str | None,
    seconds: float | None,
    guided: Callable[[TouchSession], Guide] | None,
    picture: Path | None,
) -> ServoRun | None:
    """A window from the first moment on, where a scene is chosen and which shows how the preparation comes
    along; then the touch, of one scene after the other. None where a person closes it before."""
    # who says how long is not there to choose
    name = asked or (None if seconds is None and guided is None else DEFAULT)
    chosen = None if name is None else opening.scene(name)
    while True:
        with ExitStack() as stack:
            servo = stack.enter_context(StartedServo(OF_ITS_SERVO))
            # what draws is loaded while the servo loads
            from palpate.window.waiting import ClosedError, WaitingWindow
            from palpate.window.window import TouchWindow

            waiting = stack.enter_context(closing(WaitingWindow(_gallery() if chosen is None else ())))
            mouse = opening.device == "mouse"
            channel = stack.enter_context(closing(PoseChannel.create())) if mouse else None
            try:
                scene = chosen or opening.scene(waiting.choose().name)
                prepare = partial(opening.session, stack, servo, scene, channel)
                session, until = waiting.run(scene.title, prepare)
            except ClosedError as error:
                print(f"palpate touch: {error}", file=sys.stderr)
                return None
            session.enable()
            guide = None if guided is None else guided(session)
            window = TouchWindow(session, scene, channel, guide=guide)
            window.run(until if seconds is None else seconds, screenshot=picture, shown=waiting.close)
            if not window.another:
                return opening.touched(session, scene)
        chosen = None


def _gallery() -> list[Scene]:
    """What there is to choose from, the demo's object first; one is there to be copied, not touched."""
    there = [name for name in scene_names() if name not in (DEFAULT, "your-recording")]
    return [load_scene(name) for name in (DEFAULT, *there)]


VIRTUAL_SCREEN = "'xvfb-run -s \"-screen 0 1280x800x24\" palpate ...'"


def _check(
    name: str,
    renderer: str | None,
    beside: str | None,
    seconds: float | None,
    replay: str | None,
    headless: bool,
) -> None:
    from palpate.show.scenery import no_screen

    for value, allowed, what in (
        (name, tuple(DEVICES), "device"),
        (renderer, names(), "renderer"),
        (beside, (*names(), "none"), "renderer"),
    ):
        if value is not None and value not in allowed:
            raise OptionError(unknown(value, what, allowed))
    if seconds is not None and not seconds > 0:
        raise OptionError(f"--seconds is {seconds}; it must be greater than 0")
    if name == "replay" and not replay:
        raise OptionError("the device 'replay' plays a recording: name it with --replay REC")
    if headless:
        if name == "mouse":
            raise DeviceError("the mouse needs the window: drop --headless, or use --device simulated")
    elif why := no_screen():
        raise DeviceError(
            f"{why}: press it in a browser (`palpate export SCENE --to page -o touch.html`), use "
            f"`palpate touch --headless`, or {VIRTUAL_SCREEN}"
        )


def device_choice(
    name: str,
    options: Any,
    exploration: ExplorationOptions,
    replay: str | None,
    seed: int,
    model: Model | None,
    channel: PoseChannel | None,
) -> tuple[DeviceChoice, float | None]:
    """The device for the servo process to make, and when it will have done (s), None for never."""
    if channel is not None:
        return DeviceChoice(name, {"channel": str(channel.path), "options": options}), None
    if name == "replay":
        recording = str(Path(str(replay)).resolve())
        return DeviceChoice(name, {"recording": recording, "options": options}), None
    if name == "simulated":
        assert model is not None
        path, _ = explore(model, exploration, hand_stiffness_n_per_m=options.stiffness_n_per_m, seed=seed)
        keywords = {"options": options, "intention": path, "seed": seed}
        return DeviceChoice(name, keywords), path.duration_s + 2.0
    return DeviceChoice(name, {"options": options}), None


def _mapping(given: Table[str, Any], name: str, scene: Scene, model: Model) -> Mapping | None:
    """None, the identity, for devices that live in the scene's frame already."""
    if name in ("mouse", "simulated", "replay"):
        return None
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
