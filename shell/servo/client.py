"""The parent's side: starts a servo process, tells it what to do, reads what it does; never in its way."""

from __future__ import annotations

import json
import pickle
import queue
import subprocess
import threading
import time
from collections.abc import Callable
from collections.abc import Mapping as MappingType
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Self

import numpy as np

from palpate.devices.mapper import Mapping
from palpate.devices.registry import DeviceChoice
from palpate.mechanics.errors import DeviceError, PalpateError
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.servo.layout import BEAT, ENABLE, STOP, SharedArrays, SharedBlock
from palpate.servo.options import ServoOptions
from palpate.servo.process import GO, Job
from palpate.servo.report import ServoReport, ServoSnapshot, report, ring_rows, snapshot
from palpate.servo.source import ModelFolder, ModelSource, RendererChange, RendererSource
from palpate.servo.started import StartedServo

START_TIMEOUT_S = 600.0
STOP_TIMEOUT_S = 5.0
BEAT_S = 0.1


class Servo(AbstractContextManager["Servo"]):
    """A servo process as an object; use it in a `with` statement.

    model: a Model, a MODEL folder, or a RendererSource. device: a name or a DeviceChoice, made in the servo
    process, which owns it. coarse: take what is kept of the model's compliance (palpate.servo.source).
    mapping: device to scene (devices.mapper), the identity by default. started: a process that waits for its
    job; None: `start` makes one.

    Force lasts only while this side shows that it lives: every call here is a heartbeat, and so is each turn
    of `wait`. After `options.silence_s` without one the force goes off, and ramps in again at the next.
    """

    def __init__(
        self,
        model: Model | Path | str | RendererSource,
        *,
        renderer: str = "fem",
        device: str | DeviceChoice = "simulated",
        options: ServoOptions | None = None,
        mapping: Mapping | None = None,
        render_options: Any = None,
        coarse: bool = False,
        started: StartedServo | None = None,
    ) -> None:
        self.options = options or ServoOptions()
        self._folder: ModelFolder | None = None
        if isinstance(model, Model | Path | str):
            self._folder = ModelFolder(model)
            self._source: RendererSource = ModelSource(self._folder.path, renderer, render_options, coarse)
        else:
            self._source = model
        choice = DeviceChoice(device) if isinstance(device, str) else device
        self._job = Job(self._source, choice, self.options, mapping)
        self._started = started
        self._block = SharedBlock() if started is None else started.block
        self._process: subprocess.Popen[bytes] | None = None
        self._answers: queue.Queue[dict[str, Any]] = queue.Queue()
        self._words: dict[str, str] = {}
        self._error = ""
        self._listener: threading.Thread | None = None
        self._tip_radius_m: float | None = None
        self._enablings = 0
        self._cpu_start_s = 0.0
        self._started_s = 0.0

    @property
    def arrays(self) -> SharedArrays:
        """The shared block's arrays (palpate.servo.layout)."""
        return self._block.arrays

    @property
    def alive(self) -> bool:
        """Whether the servo process runs."""
        return self._process is not None and self._process.poll() is None

    @property
    def process_id(self) -> int:
        """Of the servo process; raises PalpateError before `start`."""
        if self._process is None:
            raise PalpateError("the servo was not started: call start()")
        return self._process.pid

    @property
    def renderer(self) -> str:
        """The name of the renderer that runs."""
        return self._source.name

    @property
    def folder(self) -> Path:
        """Of the model that it was made with; raises PalpateError for another source."""
        if self._folder is None:
            raise PalpateError("this servo runs no model: start it with one")
        return self._folder.path

    @property
    def tip_radius_m(self) -> float:
        """Of the first tip; raises PalpateError before `start`."""
        if self._tip_radius_m is None:
            raise PalpateError("the servo was not started: call start()")
        return self._tip_radius_m

    @property
    def words(self) -> tuple[str, ...]:
        """What the system did not permit, what protects less than by default, what acts on the forces."""
        return tuple(self._words.values())

    @property
    def failure(self) -> str:
        """Why the servo ended by itself; '' while it runs, and after an ordinary end."""
        if self._listener is not None and not self.alive:
            self._listener.join(1.0)  # its last words may still be on their way
        return self._error

    def start(self, progress: Progress = silent, *, compiled: Callable[[], object] = lambda: None) -> Self:
        """Spawn; returns when compiled, warmed up and ticking with force off.

        compiled: waits until what the servo runs need not be compiled by it; it loads the model meanwhile.
        Raises the PalpateError that the servo process met.
        """
        self._process = (self._started or StartedServo(block=self._block)).take()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()
        self._send(self._job)
        compiled()
        self._send(GO)
        ready = self._await("ready", progress, START_TIMEOUT_S)
        self._block.forget()
        self._tip_radius_m = float(ready["tip_radius_m"])
        self._cpu_start_s = _cpu_time_s(self.process_id)
        self._started_s = time.perf_counter()
        return self

    def beat(self) -> None:
        """One heartbeat: this side lives. Called by whatever asks the servo for something."""
        self.arrays.control[BEAT] += 1

    def wait(self, seconds: float) -> bool:
        """Let the servo run for so long, heart beating; False where it ended by itself meanwhile."""
        end = time.perf_counter() + seconds
        while self.alive:
            self.beat()
            left = end - time.perf_counter()
            if left <= 0.0:
                return True
            time.sleep(min(left, BEAT_S))
        return False

    def enable(self) -> None:
        """Force on: it ramps in. Needed again after every fault that latched."""
        self.beat()
        self._enablings += 1
        self.arrays.control[ENABLE] = self._enablings

    def disable(self) -> None:
        """Force off, at once."""
        self.arrays.control[ENABLE] = 0

    def set_renderer(self, name: str, progress: Progress = silent, *, options: Any = None) -> None:
        """Go on with another renderer of the same model, swapped between two ticks once it is ready.

        options: the renderer's, None for those of before.
        """
        if not isinstance(self._source, ModelSource):
            raise PalpateError("only a model's renderer can be switched by name: start with a model")
        self.set_source(self._source.named(name, options), progress)

    def set_source(self, source: RendererSource, progress: Progress = silent) -> None:
        """Go on with what `source` makes."""
        self._command("source", source, progress)
        self._source = source

    def change(self, change: RendererChange) -> None:
        """Change the renderer that runs; a touch goes on. One that is set later knows nothing of it."""
        self._command("change", change)

    def set_modulus(self, young_modulus_pa: float) -> None:
        """Another global Young's modulus; costs nothing."""
        self._command("modulus", float(young_modulus_pa))

    def set_friction(self, mu: float) -> None:
        """Another coefficient of friction; inf sticks."""
        self._command("friction", float(mu))

    def set_mapping(self, mapping: Mapping) -> None:
        """Another mapping from device to scene. Force goes off, since the tip leaps."""
        self.disable()
        self._command("mapping", mapping)

    def snapshot(self) -> ServoSnapshot | None:
        """The newest tick; None before the first."""
        self.beat()
        return snapshot(self.arrays)

    def history(self, since: int = 0) -> tuple[np.ndarray, int]:
        """Rows (palpate.servo.layout.ROW) after the first `since` that the ring still holds (7 s at 1 kHz),
        and the number to pass next time."""
        self.beat()
        return ring_rows(self.arrays, since)

    def report(self) -> ServoReport:
        """What happened so far."""
        wall = time.perf_counter() - self._started_s
        cpu = _cpu_time_s(self._process.pid) - self._cpu_start_s if self._process else float("nan")
        return report(self.arrays, self.options.period_ns, self.words, cpu, wall)

    def stop(self) -> int:
        """Zero force, close the device, end the process; returns its exit code. Harmless when repeated."""
        process = self._process
        if process is None:
            return 0
        self.arrays.control[ENABLE] = 0
        self.arrays.control[STOP] = 1
        try:
            process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if process.stdin is not None:
            try:
                process.stdin.close()
            except BrokenPipeError:
                pass
        return process.returncode

    def close(self) -> None:
        """Stop, and remove what was made for the session; counters and ring stay readable."""
        self.stop()
        self._block.forget()
        if self._folder is not None:
            self._folder.close()

    def __exit__(self, *error: object) -> None:
        self.close()

    def _send(self, value: Any) -> None:
        assert self._process is not None and self._process.stdin is not None
        try:
            pickle.dump(value, self._process.stdin)
            self._process.stdin.flush()
        except (BrokenPipeError, ValueError) as error:
            raise DeviceError(self._error or "the servo process has ended: start it again") from error

    def _listen(self) -> None:
        assert self._process is not None and self._process.stdout is not None
        for line in self._process.stdout:
            message = json.loads(line)
            if "word" in message:
                # of what is told anew with every table the last word counts
                self._words[message.get("about", f"{len(self._words)}")] = message["word"]
            elif "error" in message:
                self._error = message["error"]
                self._answers.put(message)
            else:
                self._answers.put(message)
        self._answers.put({"ended": True})

    def _command(self, name: str, value: Any, progress: Progress = silent) -> None:
        self._send((name, value))
        self._await("done", progress, START_TIMEOUT_S)

    def _await(self, key: str, progress: Progress, timeout_s: float) -> MappingType[str, Any]:
        end = time.perf_counter() + timeout_s
        while True:
            self.beat()
            try:
                message: MappingType[str, Any] = self._answers.get(timeout=BEAT_S)
            except queue.Empty:
                if time.perf_counter() > end:
                    raise DeviceError(f"the servo did not answer within {timeout_s:.0f} s") from None
                continue
            if "stage" in message:
                progress(message["stage"], message["fraction"])
            elif "failed" in message:
                raise PalpateError(message["why"])
            elif "error" in message:
                self._process_ended()
                raise PalpateError(message["error"])
            elif key in message:
                return message
            elif "ended" in message:
                self._process_ended()
                raise DeviceError(self._error or "the servo process ended before it was ready")

    def _process_ended(self) -> None:
        if self._process is not None:
            try:
                self._process.wait(STOP_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self._process.kill()


def _cpu_time_s(process_id: int) -> float:
    """User and system time of a process so far, s; NaN where it is gone."""
    import psutil

    try:
        times = psutil.Process(process_id).cpu_times()
    except psutil.Error:
        return float("nan")
    return float(times.user + times.system)
