"""A touch session without a window: the servo, a second renderer beside it, the recording, what keys change.

The window asks for a `frame` sixty times a second; everything that takes longer runs in one worker thread
while the servo goes on. A second renderer is driven by every tick's tip, read from the servo's ring, so
that it feels the same path at 1 kHz.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from palpate.devices.mapper import Mapping
from palpate.devices.registry import DeviceChoice, spec_of
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.render.base import Renderer
from palpate.render.effects import rendered_touch
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.render.registry import names
from palpate.render.scene import scene_of
from palpate.scenes.phantoms import Region
from palpate.servo import Servo, ServoOptions, ServoReport, ServoSnapshot
from palpate.servo.started import StartedServo
from palpate.window.charts import ForceTrace
from palpate.window.inclusion import InclusionMover
from palpate.window.recording import SessionRecording
from palpate.window.table import SessionTable
from palpate.window.window_renderers import Beside, DrawnRenderers
from palpate.window.worker import Frame, RendererView, Worker

BESIDE = "hunt-crossley"
"""The second renderer where nobody said which."""
FRICTIONS = (math.inf, 1.0, 0.5, 0.2, 0.05)
MODULUS_STEP = 1.25


@dataclass(frozen=True)
class SessionOptions:
    """renderer: that is felt; beside: a second one, '' for none; render: of every renderer here, felt or
    drawn; servo: of the loop; recording: its file, written on close, None until asked for; pictures: whether
    there is something to draw on."""

    renderer: str = "fem"
    beside: str = ""
    render: RenderOptions = field(default_factory=RenderOptions)
    servo: ServoOptions | None = None
    recording: Path | None = None
    pictures: bool = True


class TouchSession(AbstractContextManager["TouchSession"]):
    """Use in a `with` statement, after which every force is zero and the servo is gone.

    servo: its client. beside_name: the second renderer, '' for none. has_force: whether the device gives any.
    """

    def __init__(
        self,
        model: Model,
        *,
        title: str = "object",
        device: DeviceChoice | str = "simulated",
        mapping: Mapping | None = None,
        options: SessionOptions | None = None,
        started: StartedServo | None = None,
    ) -> None:
        asked = options or SessionOptions()
        self.model = model
        self.title = title
        self.trace = ForceTrace()
        self._inclusion = InclusionMover(model)
        self._drawn = DrawnRenderers(model, asked.render, self._inclusion)
        self.friction = rendered_touch(model, asked.render).friction
        self.worker = Worker()
        self.recording: SessionRecording | None = None
        self._recording_path = asked.recording
        self._pictures = asked.pictures
        self.beside_name = asked.beside
        self._last_beside = asked.beside or BESIDE
        self._beside: Beside | None = None
        self._device = DeviceChoice(device) if isinstance(device, str) else device
        self.has_force = spec_of(self._device.name).has_force
        self.servo = Servo(
            model,
            renderer=asked.renderer,
            device=self._device,
            mapping=mapping,
            options=asked.servo,
            render_options=asked.render,
            coarse=True,
            started=started,
        )
        self.table = SessionTable(self.servo, self._drawn, self.worker, self._follow_drawn)
        self._next = 0

    def start(self, progress: Progress = silent, *, compiled: Callable[[], object] = lambda: None) -> Self:
        """Spawn the servo, load the renderers that draw, begin to record where asked; force stays off.

        compiled: see Servo.start.
        """
        drawn = ({self.servo.renderer} if self._pictures else set()) | ({self.beside_name} - {""})
        if "fem" in {self.servo.renderer, *drawn}:
            # once, before two processes ask for it at the same time
            self.table.begin(self.model, lambda stage, share: progress(stage, 0.5 * share))
        with ThreadPoolExecutor(1) as pool:
            loading = [pool.submit(self._drawn.load, name) for name in sorted(drawn)]
            self.servo.start(lambda stage, share: progress(stage, 0.5 + 0.4 * share), compiled=compiled)
            for job in loading:
                job.result()
        self._drawn.know_stiffness()
        self._restart_beside()
        self._apply()
        self._next = int(self.servo.arrays.ring_head[0])
        if self._recording_path is not None:
            self.begin_recording(self._recording_path)
        progress("touching", 1.0)
        return self

    def _follow_drawn(self) -> None:
        if self._beside is not None:
            self._beside.change(self._drawn.load(self._beside.name))

    def _apply(self) -> None:
        """What the user changed, to a renderer that is new."""
        if self.young_modulus_pa != self.model.material.young_modulus_pa:
            self.servo.set_modulus(self.young_modulus_pa)
        if self.friction != rendered_touch(self.model, self._drawn.options).friction:
            self.servo.set_friction(self.friction)
        self._inclusion.apply(self.servo)

    @property
    def renderer_name(self) -> str:
        """The renderer that the hand feels."""
        return self.servo.renderer

    @property
    def young_modulus_pa(self) -> float:
        """Of what is felt now."""
        return self._drawn.young_modulus_pa

    def drawing(self, name: str) -> Renderer:
        """The renderer that draws: the named one where it is loaded, else any (they share the surface)."""
        return self._drawn.for_drawing(name)

    def enable(self) -> None:
        """Force on, ramping in."""
        self.servo.enable()

    def toggle_force(self) -> None:
        """Force off where it is on, on where it is off."""
        snapshot = self.servo.snapshot()
        (self.servo.disable if snapshot and snapshot.force_enabled else self.servo.enable)()

    def frame(self) -> Frame | None:
        """The newest state for a picture; None before the first tick."""
        rows, self._next = self.servo.history(self._next)
        if self.recording is not None:
            self.recording.collect()
        beside = self._beside  # the worker may put another in its place
        sizes = np.zeros(len(rows)) if beside is None else beside.follow(rows["tip"])
        if not self._inclusion.settled and self.table.all_drawn:
            self.worker.offer("computing the ball", self._follow_inclusion)
        snapshot = self.servo.snapshot()
        if snapshot is None:
            return None
        self._add_to_trace(rows, sizes)
        self.table.follow(snapshot.tips[0])
        felt = snapshot.forces_n.sum(axis=0)
        views = [RendererView(self.renderer_name, felt, self._displacement(snapshot))]
        if beside is not None:
            views.append(beside.view())
        return Frame(
            time_s=snapshot.time_s,
            tip_m=snapshot.tips[0],
            depth_m=float(snapshot.depths[0]) if snapshot.touching[0] else 0.0,
            touching=bool(snapshot.touching[0]),
            stiffness_n_per_m=float(snapshot.stiffness[0]),
            force_enabled=snapshot.force_enabled,
            reason=snapshot.reason if self.has_force else "",
            views=tuple(views),
            busy=self.worker.busy or self.worker.failure,
            table=self.table.words,
            recorded_s=None if self.recording is None else self.recording.seconds,
        )

    def _displacement(self, snapshot: ServoSnapshot) -> np.ndarray:
        if not self._pictures:
            return np.zeros((0, 3))
        held = np.flatnonzero(snapshot.touching)
        return self.drawing(self.renderer_name).displacement_of(
            snapshot.points[held],
            snapshot.normals[held],
            snapshot.forces_n[held],
            np.full(len(held), self.servo.tip_radius_m),
            snapshot.depths[held],
        )

    def _restart_beside(self) -> None:
        name = self.beside_name
        if not name:
            self._beside = None
            return
        # the plane that is felt, which may be softer than the options' for the device's sake
        scene = scene_of(self._drawn.load(name), self.servo.options.support_plane)
        spec = spec_of(self._device.name)
        if spec.has_force:
            scene = scene.no_stiffer_than(spec.max_stiffness_n_per_m)
        self._beside = Beside(name, scene, self.servo.tip_radius_m)

    def _add_to_trace(self, rows: np.ndarray, beside: np.ndarray) -> None:
        if not len(rows):
            return
        force = np.linalg.norm(rows["rendered"], axis=1)
        self.trace.add(np.column_stack([rows["time_s"], force, rows["depth"], beside]))

    def begin_recording(self, path: Path) -> None:
        """Record from now on; the file is written by `end_recording` or on close."""
        self.recording = SessionRecording(self.servo, self.model, path)

    def end_recording(self) -> Path | None:
        """Write what was recorded with what is known of it; None where nothing was being recorded."""
        recording, self.recording = self.recording, None
        if recording is None:
            return None
        rendered: dict[str, Any] = {"renderer": self.renderer_name}
        if self.feels_inside and self.table.words:
            rendered["table_at_end"] = self.table.state
        if self.feels_inside:
            rendered["young_modulus_pa"] = self.young_modulus_pa
            rendered["effects"] = sorted(self.model.effects)
            if math.isfinite(self.friction):
                rendered["friction"] = self.friction
            if self.inclusion is not None:
                rendered["inclusion"] = {k: v for k, v in asdict(self.inclusion).items() if k != "name"}
        return recording.write(self.title, rendered)

    def set_renderer(self, name: str) -> None:
        """Feel another renderer of the same model."""
        self.worker.run(f"loading {name}", lambda: self._feel(name))

    def next_renderer(self) -> None:
        """The next of the registry."""
        self.worker.run("loading the next renderer", lambda: self._feel(_after(self.renderer_name, names())))

    def _feel(self, name: str) -> None:
        if name != self.renderer_name:
            self._feel_anew(name)

    def _feel_anew(self, name: str) -> None:
        """Both processes load it at once; the old one is felt until then."""
        with ThreadPoolExecutor(1) as pool:
            drawing = pool.submit(self._drawn.load, name, self.worker.tell) if self._pictures else None
            self.servo.set_renderer(name, self.worker.tell, options=self._drawn.options)
            if drawing is not None:
                drawing.result()
        self._apply()

    def set_beside(self, name: str) -> None:
        """Another renderer under the same tip; '' for none."""
        self.worker.run(f"loading {name}" if name else "one picture", lambda: self._compare(name))

    def toggle_beside(self) -> None:
        """The second renderer of before, or none."""
        self.set_beside("" if self.beside_name else self._last_beside)

    def _compare(self, name: str) -> None:
        if name:
            self._drawn.load(name, self.worker.tell)
            self._last_beside = name
        self.beside_name = name
        self._restart_beside()

    @property
    def effects(self) -> bool:
        """Whether the effects that the model names are rendered."""
        return self._drawn.options.effects

    def set_effects(self, on: bool) -> None:
        """Render the effects that the model names, or the ideal model; what the user changed stays."""

        def job() -> None:
            self._drawn.options = replace(self._drawn.options, effects=on)
            self._drawn.make_anew({self.renderer_name, self.beside_name} - {""}, self.worker.tell)
            self._feel_anew(self.renderer_name)
            self._compare(self.beside_name)

        self.worker.run("changing the effects", job)

    @property
    def feels_inside(self) -> bool:
        """Whether what is felt knows friction and the object's inside: one-dimensional models do not."""
        return self.renderer_name == "fem"

    def reset_modulus(self) -> None:
        """As the model has it."""
        self.scale_modulus(self.model.material.young_modulus_pa / self.young_modulus_pa)

    def scale_modulus(self, factor: float) -> None:
        """Stiffer or softer; costs nothing."""

        def job() -> None:
            modulus = self.young_modulus_pa * factor
            self.servo.set_modulus(modulus)
            self._drawn.set_modulus(modulus)
            self._follow_drawn()

        self.worker.run("changing the modulus", job)

    def next_friction(self) -> None:
        """Stick, then ever more slippery, then stick again."""
        self._set_friction(lambda: next((f for f in FRICTIONS if f < self.friction), FRICTIONS[0]))

    def set_friction(self, friction: float) -> None:
        """Coulomb's coefficient; inf sticks."""
        self._set_friction(lambda: friction)

    def _set_friction(self, which: Callable[[], float]) -> None:
        def job() -> None:
            friction = which()
            self.servo.set_friction(friction)
            self.friction = friction

        self.worker.run("changing friction", job)

    def place_inclusion(self, region: Region | None) -> None:
        """Put a stiff ball into the object, move it, or take it out (None); felt once it is computed."""
        self._inclusion.wanted = region

    @property
    def inclusion(self) -> Region | None:
        """The ball as the user wants it."""
        return self._inclusion.wanted

    @property
    def inclusion_felt(self) -> bool:
        """Whether what is felt has come up with what is wanted."""
        return self._inclusion.settled

    def _follow_inclusion(self) -> None:
        while not self._inclusion.settled:
            drawing = self._drawn.load("fem", self.worker.tell)
            assert isinstance(drawing, FemRenderer), "'fem' is made by palpate.render.fem.renderer"
            changed = self._inclusion.follow(self.servo, drawing, self.worker.tell)
            self._drawn.put("fem", changed)
            if self._beside is not None and self._beside.name == "fem":
                self._beside.change(changed)

    def report(self) -> ServoReport:
        """What the servo did so far."""
        return self.servo.report()

    def close(self) -> None:
        """Force off, servo ended, recording written."""
        self.servo.disable()
        with ExitStack() as rest:  # all of it, from the last, though one fails
            for each in (
                self._inclusion.close,
                self.table.close,
                self.servo.close,
                self.end_recording,
                self.worker.wait,
                self.servo.stop,
            ):
                rest.callback(each)
            if self.recording is not None:
                self.recording.collect()

    def __exit__(self, *error: object) -> None:
        self.close()


def _after(name: str, every: Sequence[str]) -> str:
    """The next of them all, round about; the first for one that is none of them."""
    return every[(every.index(name) + 1) % len(every)] if name in every else every[0]
