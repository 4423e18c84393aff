"""A touch session without a window: the servo, a second renderer beside it, the recording, what keys change.

The window asks for a `frame` sixty times a second; everything that takes longer runs in one worker thread
while the servo goes on. A second renderer is driven by every tick's tip, read from the servo's ring, so
that it feels the same path at 1 kHz.
"""

from __future__ import annotations

import math
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from devices.mapper import Mapping
from devices.registry import DeviceChoice, spec_of
from mechanics.compliance import load_or_condense
from mechanics.errors import PalpateError
from mechanics.model import Model, read_model, write_model
from mechanics.progress import Progress, silent
from mechanics.recording import write_recording
from palpate.servo import Servo, ServoOptions, ServoReport, ServoSnapshot
from palpate.servo.recorder import Recorder
from palpate.window.trace import Trace
from palpate.window.tracing import BaseTracing
from render.base import Renderer
from render.registry import create, names
from scenes.inclusions import modulus_ratio
from scenes.phantoms import Region

FRICTIONS = (math.inf, 1.0, 0.5, 0.2, 0.05)
MODULUS_STEP = 1.25


@dataclass(frozen=True)
class View:
    """One renderer's side of a frame: force on the tool (3,) N and the surface's displacement (n, 3) m."""

    name: str
    force_n: np.ndarray
    displacement_m: np.ndarray


@dataclass(frozen=True)
class Frame:
    """What a picture shows. depth_m: of the first tip in the object; stiffness in N/m, 0 in air.

    reason: why the commanded force is not the rendered one, in plain words. busy: what the worker does.
    """

    time_s: float
    tip_m: np.ndarray
    depth_m: float
    touching: bool
    stiffness_n_per_m: float
    force_enabled: bool
    reason: str
    views: tuple[View, ...]
    busy: str
    recorded_s: float | None


class TouchSession:
    """Use in a `with` statement, after which every force is zero and the servo is gone.

    beside: a second renderer, '' for none. recording: its file, written on close; None until asked for.
    """

    def __init__(
        self,
        model: Model,
        *,
        title: str = "object",
        device: DeviceChoice | str = "simulated",
        renderer: str = "fem",
        beside: str = "",
        friction: float | None = None,
        mapping: Mapping | None = None,
        options: ServoOptions | None = None,
        recording: Path | None = None,
        pictures: bool = True,
    ) -> None:
        self.model = model
        self.title = title
        self.trace = Trace()
        self.young_modulus_pa = model.young_modulus_pa
        self.friction = friction
        self.inclusion: Region | None = None
        self.busy = ""
        self.failure = ""
        self.recording_path = recording
        self._pictures = pictures
        self._beside_name = beside
        self._device = DeviceChoice(device) if isinstance(device, str) else device
        self._has_force = spec_of(self._device.name).has_force
        self._servo = Servo(model, renderer=renderer, device=self._device, mapping=mapping, options=options)
        self._renderers: dict[str, Renderer] = {}
        self._recorder: Recorder | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._next = 0
        self._worker: threading.Thread | None = None
        self._beside_state: object = None
        self._beside_force = np.zeros(3)

    def start(self, progress: Progress = silent) -> Self:
        """Spawn the servo, load the renderers that draw, begin to record where asked; force stays off."""
        drawn = (
            {self._servo.renderer, self._beside_name} - {""} if self._pictures else {self._beside_name} - {""}
        )
        if "fem" in {self._servo.renderer, *drawn}:
            # once, before two processes ask for it at the same time
            load_or_condense(self.model, lambda stage, share: progress(stage, 0.5 * share))
        with ThreadPoolExecutor(1) as pool:
            loading = {name: pool.submit(create, name, self.model) for name in sorted(drawn)}
            self._servo.start(lambda stage, share: progress(stage, 0.5 + 0.4 * share))
            self._renderers = {name: job.result() for name, job in loading.items()}
        self._restart_beside()
        self._apply()
        self._next = int(self._servo.arrays.ring_head[0])
        if self.recording_path is not None:
            self.begin_recording(self.recording_path)
        progress("touching", 1.0)
        return self

    def _apply(self) -> None:
        """What the user changed, to a renderer that is new."""
        if self.young_modulus_pa != self.model.young_modulus_pa:
            self._servo.set_modulus(self.young_modulus_pa)
        if self.friction is not None:
            self._servo.set_friction(self.friction)

    @property
    def servo(self) -> Servo:
        """The servo's client."""
        return self._servo

    @property
    def renderer_name(self) -> str:
        """The renderer that the hand feels."""
        return self._servo.renderer

    @property
    def beside_name(self) -> str:
        """The second renderer, '' for none."""
        return self._beside_name

    def drawing(self, name: str) -> Renderer:
        """The renderer that draws: the named one where it is loaded, else any (they share the surface)."""
        return self._renderers.get(name) or next(iter(self._renderers.values()))

    def enable(self) -> None:
        """Force on, ramping in."""
        self._servo.enable()

    def toggle_force(self) -> None:
        """Force off where it is on, on where it is off."""
        snapshot = self._servo.snapshot()
        (self._servo.disable if snapshot and snapshot.force_enabled else self._servo.enable)()

    def frame(self) -> Frame | None:
        """The newest state for a picture; None before the first tick."""
        rows, self._next = self._servo.history(self._next)
        if self._recorder is not None:
            self._recorder.collect()
            self._tracing.add(rows["tip"])
        beside = self._drive_beside(rows)
        snapshot = self._servo.snapshot()
        if snapshot is None:
            return None
        self._add_to_trace(rows, beside, snapshot)
        held = np.flatnonzero(snapshot.touching)
        views = [
            View(
                self.renderer_name,
                snapshot.forces_n.sum(axis=0),
                self._displacement(self.renderer_name, snapshot, held),
            )
        ]
        if self._beside_name and self._beside_state is not None:
            renderer = self._renderers[self._beside_name]
            shown = renderer.displacement(self._beside_state)
            views.append(View(self._beside_name, self._beside_force.copy(), shown))
        return Frame(
            time_s=snapshot.time_s,
            tip_m=snapshot.tips[0],
            depth_m=float(snapshot.depths[0]) if snapshot.touching[0] else 0.0,
            touching=bool(snapshot.touching[0]),
            stiffness_n_per_m=float(snapshot.stiffness[0]),
            force_enabled=snapshot.force_enabled,
            reason=snapshot.reason if self._has_force else "",
            views=tuple(views),
            busy=self.busy or self.failure,
            recorded_s=None if self._recorder is None else self._recorded_s(rows),
        )

    def _displacement(self, name: str, snapshot: ServoSnapshot, held: np.ndarray) -> np.ndarray:
        if not self._pictures:
            return np.zeros((0, 3))
        renderer = self.drawing(name)
        return renderer.displacement_of(
            snapshot.points[held],
            snapshot.normals[held],
            snapshot.forces_n[held],
            np.full(len(held), self._servo.tip_radius_m),
            snapshot.depths[held],
        )

    def _drive_beside(self, rows: np.ndarray) -> np.ndarray:
        """(n,) N, the second renderer's force at each tick of the ring."""
        sizes = np.zeros(len(rows))
        if not self._beside_name or self._beside_state is None:
            return sizes
        renderer, state = self._renderers[self._beside_name], self._beside_state
        for i, tip in enumerate(np.ascontiguousarray(rows["tip"]) if len(rows) else ()):
            forces = renderer.step(state, tip[None])[1]
            sizes[i] = np.linalg.norm(forces[0])
            self._beside_force = forces[0]
        return sizes

    def _restart_beside(self) -> None:
        self._beside_state = None
        if self._beside_name:
            self._beside_state = self._renderers[self._beside_name].start([self._servo.tip_radius_m])
            self._beside_force = np.zeros(3)

    def _add_to_trace(self, rows: np.ndarray, beside: np.ndarray, snapshot: ServoSnapshot) -> None:
        if not len(rows):
            return
        force = np.linalg.norm(rows["rendered"], axis=1)
        normal = snapshot.normals[0]
        first_touch = snapshot.points[0] + self._servo.tip_radius_m * normal
        depth = np.where(rows["touching"] > 0, -(rows["tip"] - first_touch) @ normal, 0.0)
        self.trace.add(np.column_stack([rows["time_s"], force, depth, beside]))

    def begin_recording(self, path: Path) -> None:
        """Record from now on; the file is written by `end_recording` or on close."""
        self.recording_path = path
        self._recorder = Recorder(self._servo)
        self._tracing = BaseTracing(self.model)
        self._recording_start_s = self._newest_s()

    def _newest_s(self) -> float:
        snapshot = self._servo.snapshot()
        return snapshot.time_s if snapshot else 0.0

    def _recorded_s(self, rows: np.ndarray) -> float:
        return (float(rows["time_s"][-1]) if len(rows) else self._newest_s()) - self._recording_start_s

    def end_recording(self) -> Path | None:
        """Write what was recorded with what is known of it; None where nothing was being recorded."""
        recorder, self._recorder = self._recorder, None
        if recorder is None or self.recording_path is None:
            return None
        recorder.collect()
        recording = recorder.recording(self._servo.tip_radius_m, self.title)
        truth = {"young_modulus_pa": self.young_modulus_pa, "effects": sorted(self.model.effects)}
        recording = replace(
            recording,
            poisson_ratio=self.model.poisson_ratio,
            # the model's own base stands in where nobody traced it
            base_model=None if self._tracing.done or self.model.path is None else self.model.path.resolve(),
        )
        return write_recording(self.recording_path, recording, truth=truth)

    @property
    def recording(self) -> bool:
        """Whether a recording runs."""
        return self._recorder is not None

    @property
    def traced(self) -> float:
        """The share of the way around the base that the recording has traced on the support."""
        return self._tracing.share if self._recorder is not None else 0.0

    def _work(self, words: str, job: Callable[[], None]) -> None:
        """Run a job that takes longer than a frame; one at a time, a second request is dropped."""
        if self._worker is not None and self._worker.is_alive():
            return

        def run() -> None:
            try:
                job()
                self.failure = ""
            except PalpateError as error:
                self.failure = str(error)
            finally:
                self.busy = ""

        self.busy = words
        self._worker = threading.Thread(target=run, name="touch worker", daemon=True)
        self._worker.start()

    def wait(self) -> None:
        """Until the worker is done (for scripts and tests)."""
        if self._worker is not None:
            self._worker.join()

    def set_renderer(self, name: str) -> None:
        """Feel another renderer of the same model."""

        def job() -> None:
            if self._pictures and name not in self._renderers:
                self._renderers[name] = create(name, self.model)
            self._servo.set_renderer(name)
            self._apply()

        if name != self.renderer_name:
            self._work(f"loading {name}", job)

    def next_renderer(self) -> None:
        """The next of the registry."""
        every = names()
        self.set_renderer(every[(every.index(self.renderer_name) + 1) % len(every)])

    def set_beside(self, name: str) -> None:
        """Another second renderer, '' for none."""

        def job() -> None:
            if name and name not in self._renderers:
                self._renderers[name] = create(name, self.model)
            self._beside_state, self._beside_name = None, name
            self._restart_beside()

        self._work(f"loading {name}", job)

    def scale_modulus(self, factor: float) -> None:
        """Stiffer or softer; costs nothing."""
        self.young_modulus_pa *= factor
        modulus = self.young_modulus_pa

        def job() -> None:
            self._servo.set_modulus(modulus)
            for name, renderer in list(self._renderers.items()):
                self._renderers[name] = renderer.with_modulus(modulus)

        self._work("changing the modulus", job)

    def next_friction(self) -> None:
        """Stick, then ever more slippery, then stick again."""
        now = math.inf if self.friction is None else self.friction
        later = [f for f in FRICTIONS if f < now]
        self.friction = later[0] if later else FRICTIONS[0]
        self._work("changing friction", lambda: self._servo.set_friction(self.friction))

    def place_inclusion(self, region: Region | None) -> None:
        """Put a stiff ball into the object, or take it out; the compliance is computed again meanwhile."""
        self.inclusion = region
        self._folder = self._folder or tempfile.TemporaryDirectory(prefix="palpate-touch-")
        path = Path(self._folder.name) / f"model-{time.monotonic_ns()}"
        ratio = modulus_ratio(self.model.mesh, () if region is None else (region,))

        def job() -> None:
            changed = read_model(write_model(path, self.model.replaced(modulus_ratio=ratio)))
            self._servo.set_model(path)
            self._apply()
            if self._pictures:
                name = self.renderer_name
                self._renderers[name] = create(name, changed).with_modulus(self.young_modulus_pa)
            self.model = changed

        self._work("computing the object with the inclusion", job)

    def report(self) -> ServoReport:
        """What the servo did so far."""
        return self._servo.report()

    def close(self) -> None:
        """Force off, servo ended, recording written."""
        self._servo.disable()
        if self._recorder is not None:
            self._recorder.collect()
        self._servo.stop()
        self.wait()
        self.end_recording()
        self._servo.close()
        if self._folder is not None:
            self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
