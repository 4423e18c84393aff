"""The servo process: makes renderer and device, warms up, ticks until told to stop.

Started by palpate.servo.client as `python -m palpate.servo BLOCK PARENT` with a pickled `Job` on standard
input, further pickled commands after it, and one JSON line a message on standard output. Threads: this one
waits for the loop's end, one for commands, one for the parent's end (`end_with_parent`), the loop ticks,
the device thread talks to the device.
"""

from __future__ import annotations

import json
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from palpate.devices.mapper import MapperOptions, Mapping
from palpate.devices.registry import DeviceChoice
from palpate.devices.safety import LATCHING, safety_parameters
from palpate.mechanics.errors import DeviceError, OptionError, PalpateError
from palpate.mechanics.model.model import Model
from palpate.render.coupling import series_compliance_m_per_n, stable_stiffness_n_per_m, stiffest_n_per_m
from palpate.render.passivity import passivity_parameters
from palpate.render.scene import TouchScene, in_the_air, scene_of
from palpate.servo.clock import lock_memory, quiet_interpreter, real_time_thread
from palpate.servo.device_thread import DeviceThread
from palpate.servo.layout import ENABLE, MOST_TIPS, ROW, STOP, TICKS, SharedArrays, SharedBlock
from palpate.servo.loop import Program, ServoLoop, make_program
from palpate.servo.options import ServoOptions
from palpate.servo.source import RendererSource
from palpate.servo.tick import TickParameters, tick_arrays
from palpate.warm_up import warm_up

GO = "go"
"""What follows a job once all is compiled that another process compiles for it."""
STEPS_IN = 30
"""Ticks in which a press that is under way is made again by another renderer."""
LOOK_S = 0.1
_BLENDED_S, _LOOK_BLEND_S, _LOOK_FIRST_S = 2.0, 5e-3, 1e-3
"""How long one table is left for the next at most, and how often that is looked at."""
GRACE_S = 0.7


@dataclass(frozen=True)
class Job:
    """What the servo is to run; everything in it can be pickled."""

    source: RendererSource
    device: DeviceChoice
    options: ServoOptions = field(default_factory=ServoOptions)
    mapping: Mapping | None = None


class ServoProcess:
    """The process's state; `run` is its whole life."""

    def __init__(self, block: SharedBlock, job: Job, tell: Any) -> None:
        self.job = job
        self.block = block
        self._tell = tell
        self._device = job.device.make()
        self._mapping = job.mapping or Mapping.from_options(
            MapperOptions(), rate=self._device.spec.control == "rate"
        )
        offsets = np.array(job.options.tip_offsets_m, dtype=float)
        if len(offsets) > MOST_TIPS:
            raise OptionError(f"{len(offsets)} tips were requested; allowed are up to {MOST_TIPS}")
        self._arrays = tick_arrays(block.arrays, offsets, np.zeros(3))
        self._source = job.source
        self._loop: ServoLoop | None = None

    def _progress(self, stage: str, fraction: float) -> None:
        self._tell({"stage": stage, "fraction": fraction})

    def _device_delay_ticks(self) -> float:
        """What a device slower than the loop adds; a prompt one's latency is in its maker's limits."""
        return max(0.0, self.job.options.rate_hz / self._device.spec.rate_hz - 1.0)

    def _delay_ticks(self) -> float:
        """From reading a pose to its force acting: read ahead of the tick, answered after it."""
        options = self.job.options
        return options.read_ahead_s * options.rate_hz + 0.15 + self._device_delay_ticks()

    def _coupled(self, renderer: Any) -> Any:
        """The renderer behind the virtual coupling that this device demands."""
        renderer = renderer.with_series_compliance(0.0)
        options, spec = self.job.options, self._device.spec
        if not (options.coupling and spec.has_force and len(renderer.surface[1])):
            return renderer
        limit = stable_stiffness_n_per_m(
            spec.max_stiffness_n_per_m, options.rate_hz, self._device_delay_ticks()
        )
        limit /= max(self._mapping.force_scale * self._mapping.scale, 1e-12)
        limit /= len(self._arrays.offsets)  # the tool's tips may all touch: their stiffnesses add up
        stiffest = stiffest_n_per_m(renderer, spec.max_force_n)
        compliance = series_compliance_m_per_n(stiffest, limit)
        if compliance > 0:
            self._tell(
                {
                    "word": f"virtual coupling: {1 / compliance:.0f} N/m in series (stiffest place "
                    f"{stiffest:.0f} N/m, device limit {limit:.0f} N/m)",
                    "about": "virtual coupling",
                }
            )
        return renderer.with_series_compliance(compliance)

    def _scene(self, renderer: Any, model: Model | None) -> TouchScene:
        """The renderer on its support, as far as the device can render both."""
        scene, spec = in_the_air(self._coupled(renderer)), self._device.spec
        if model is not None:
            scene = scene_of(scene.renderer, self.job.options.support_plane)
        return scene.no_stiffer_than(spec.max_stiffness_n_per_m) if spec.has_force else scene

    def _parameters(self) -> TickParameters:
        options, spec = self.job.options, self._device.spec
        return TickParameters(
            options.period_ns,
            round(options.late_s * 1e9),
            safety_parameters(options.safety, spec),
            passivity_parameters(
                options.passivity,
                max_damping_n_s_per_m=spec.max_damping_n_s_per_m,
                delay_ticks=self._delay_ticks(),
                rate_hz=options.rate_hz,
            ),
            # with on_orphan 'continue' the hand may go on feeling without a window
            float(options.silence_s) if options.on_orphan == "stop" else 0.0,
        )

    def run(self, commands: BinaryIO) -> None:
        """Warm up, tick, follow commands, and end in zero force."""
        quiet_interpreter()
        for word in self.job.options.loosened:
            self._tell({"word": word})
        self._progress("loading the model", 0.0)
        renderer, model = self._source.make(self._progress)
        kind = self._device.spec
        if kind.simulated and self.job.mapping is None and model is not None:
            # a hand in this program moves in the model's frame, wherever the object lies in it
            points = model.mesh.points
            self._arrays.safety.workspace_centre[:] = 0.5 * (points.min(axis=0) + points.max(axis=0))
        scene = self._scene(renderer, model)
        self._progress("compiling the loop", 0.95)
        pickle.load(commands)  # GO
        program = make_program(scene, self._arrays, self._parameters())
        locked = lock_memory()
        if locked:
            self._tell({"word": locked})
        self._device.open()
        for condition in self._device.spec.conditions:
            self._tell({"word": f"{self._device.spec.title}: {condition}"})
        if self._device.spec != kind:
            # the device that is there may be able to do less than its kind
            program = program._replace(scene=self._scene(renderer, model), parameters=self._parameters())
        priority = self.job.options.priority

        def begin_loop() -> None:
            word = real_time_thread(priority)
            if word:
                self._tell({"word": word})

        self._loop = ServoLoop(program, self._arrays, on_start=begin_loop)
        pump = DeviceThread(
            self._device,
            self._mapping,
            self._loop,
            read_ahead_s=self.job.options.read_ahead_s,
            delay_s=self._device_delay_ticks() / self.job.options.rate_hz,
            on_start=lambda: real_time_thread(max(priority - 5, 0)),
        )
        self._pump = pump
        pump.prepare()
        self._loop.start()
        while not self._arrays.shared.counts[TICKS] and not self._loop.join(_LOOK_FIRST_S):
            pass  # a hand that moved before the loop felt it would begin inside the object
        pump.start()
        self._tell({"ready": True, "tip_radius_m": float(program.state.radii_m[0])})
        try:
            threading.Thread(target=self._follow, args=(commands,), daemon=True).start()
            while not self._loop.join(0.1):
                pass
        finally:
            self._arrays.shared.control[STOP] = 1
            pump.join(3.0)
            for word in pump.words:
                self._tell({"word": word})
        if pump.failure:
            raise DeviceError(pump.failure)

    def _follow(self, commands: BinaryIO) -> None:
        """Take commands until the input ends, which is the parent's end."""
        while True:
            try:
                name, value = pickle.load(commands)
            except (EOFError, OSError, pickle.UnpicklingError):
                break
            try:
                self._obey(name, value)
                self._tell({"done": name})
            except Exception as error:  # a command that fails must not end the loop that holds the device
                self._tell({"failed": name, "why": str(error)})
        if self.job.options.on_orphan == "stop":
            self._arrays.shared.control[ENABLE] = 0
            self._arrays.shared.control[STOP] = 1

    def _obey(self, name: str, value: Any) -> None:
        assert self._loop is not None
        now = self._loop.program
        if name == "modulus":
            self._put(self._coupled(now.scene.renderer.with_modulus(value)))
        elif name == "change":
            self._until_blended()
            self._put(self._coupled(value.changed(now.scene.renderer)))
        elif name == "friction":
            self._put(now.scene.renderer.with_friction(value))
        elif name == "source":
            scene = self._scene(*value.make(self._progress))
            program = make_program(scene, self._arrays, self._parameters())
            press_again(program, self._loop.program.state, self._arrays.tips)
            self._swap(program)
            self._source = value
        elif name == "mapping":
            self._mapping = value
            self._pump.set_mapping(value)
        else:
            raise OptionError(f"'{name}' is no command of the servo")

    def _until_blended(self) -> None:
        """Wait for what runs to have left the table before it: the next takes its place in full."""
        assert self._loop is not None
        end = time.perf_counter() + _BLENDED_S
        while np.any(getattr(self._loop.program.state, "before", 0.0)) and time.perf_counter() < end:
            time.sleep(_LOOK_BLEND_S)

    def _put(self, renderer: Any) -> None:
        """The renderer that runs, retuned: its state and its support stay."""
        assert self._loop is not None
        now = self._loop.program
        self._swap(now._replace(scene=now.scene.with_renderer(renderer)))

    def _swap(self, program: Program) -> None:
        assert self._loop is not None
        if not self._loop.swap(program):
            raise PalpateError("the loop did not answer: stop the servo and start it again")


def press_again(program: Program, before: Any, tips: np.ndarray) -> None:
    """Bring a fresh program's tips from the air to where they are held now, as the state `before` has it: a
    tip that is inside an object from the start is not held by it, and the hand would feel nothing.

    tips: (m, 3) m, centres now.
    """
    renderer, now = program.scene.renderer, tips.copy()
    away = np.where(before.touching != 0, before.depths + before.radii_m, 0.0)[:, None] * before.normals
    for share in np.linspace(1.0, 0.0, STEPS_IN):
        renderer.kernel(renderer.parameters, program.state, now + share * away)


def main(argv: list[str]) -> int:
    """Run a servo process; 0 after an ordinary end, 2 after an error that was told to the parent."""
    # libraries may print: keep the parent's line for messages alone
    line = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)

    def tell(message: dict[str, Any]) -> None:
        try:
            line.write(json.dumps(message) + "\n")
        except (OSError, ValueError):
            pass  # the parent is gone; the loop is told by the end of its input

    block = SharedBlock(argv[1])
    control = block.arrays.control
    jobs: list[Job] = []
    end_with_parent(
        int(argv[2]), block.arrays, lambda: bool(jobs) and jobs[0].options.on_orphan == "continue"
    )

    def end(number: int, frame: Any) -> None:
        control[ENABLE] = 0
        control[STOP] = 1

    signal.signal(signal.SIGTERM, end)
    signal.signal(signal.SIGINT, end)
    commands = sys.stdin.buffer
    if argv[3:]:
        warm_up(argv[3:])
    try:
        jobs.append(pickle.load(commands))
        ServoProcess(block, jobs[0], tell).run(commands)
    except PalpateError as error:
        tell({"error": str(error), "kind": type(error).__name__})
        return 2
    except Exception as error:
        tell({"error": f"{type(error).__name__}: {error}", "trace": traceback.format_exc()})
        return 2
    tell({"ended": True})
    return 0


def end_with_parent(parent: int, arrays: SharedArrays, goes_on: Callable[[], bool]) -> None:
    """Watch in a thread of its own: zero and an ordinary end at once, a hard one after GRACE_S.

    The end of the input is no proof of the parent's: a process that it forked holds the other end open.

    goes_on: whether this servo is to outlive its parent; it does for as long as it has a force to give, since
    nobody is left who could enable it. Systems without a parent that changes tell by the input's end alone.
    """
    if os.name != "posix":
        return

    def watch() -> None:
        while os.getppid() == parent or (goes_on() and _gives_force(arrays)):
            time.sleep(LOOK_S)
        arrays.control[ENABLE] = 0
        arrays.control[STOP] = 1
        time.sleep(GRACE_S)
        # still loading, compiling, or in a driver that hangs: what the device does then is its own rule
        os._exit(1)

    threading.Thread(target=watch, name="servo's parent", daemon=True).start()


def _gives_force(arrays: SharedArrays) -> bool:
    """Whether force is enabled and no fault has latched."""
    last = arrays.ring[int(arrays.ring_head[0] - 1) % len(arrays.ring)].view(ROW)[0]
    return bool(arrays.control[ENABLE]) and not int(last["reasons"]) & LATCHING
