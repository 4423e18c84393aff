"""A servo session without a window: start, enable, wait, stop, report; with a recording on demand."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.devices.intention import FreeExploration
from palpate.devices.mapper import Mapping
from palpate.devices.registry import DeviceChoice
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.model.files import read_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.servo.client import Servo
from palpate.servo.options import ServoOptions
from palpate.servo.recorder import Recorder
from palpate.servo.report import ServoReport

POLL_S = 0.2


def exploring_hand(model: Model, *, seed: int = 0, target_force_n: float = 1.0) -> DeviceChoice:
    """The simulated hand, pressing a model from all free sides until it feels `target_force_n`."""
    points = model.mesh.points[np.unique(model.mesh.touchable_surface)]
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = float(np.linalg.norm(points - centre, axis=1).max()) + 2.0 * model.tool.tip_radius_m
    intention = FreeExploration(
        centre,
        radius,
        up=model.support.normal,
        target_force_n=target_force_n,
        speed_m_per_s=0.05,
        seed=seed,
    )
    return DeviceChoice("simulated", {"intention": intention, "seed": seed})


@dataclass(frozen=True)
class HeadlessOptions:
    """servo: of the loop; mapping: from the device's frame to the model's, None the identity; render: of the
    renderer; record: a recording (NAME.csv or NAME.csv.gz) of what was touched."""

    servo: ServoOptions | None = None
    mapping: Mapping | None = None
    render: Any = None
    record: Path | str | None = None


def run_headless(
    model: Model | Path | str,
    renderer: str = "fem",
    device: str | DeviceChoice = "simulated",
    seconds: float = 10.0,
    *,
    options: HeadlessOptions | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> ServoReport:
    """Feel `model` for `seconds` and report; prints nothing.

    device: a name, or a DeviceChoice with options; 'simulated' explores the model by itself. Raises the
    PalpateError that stopped it.
    """
    options = options or HeadlessOptions()
    if device == "simulated":
        device = exploring_hand(model if isinstance(model, Model) else read_model(model), seed=seed)
    elif isinstance(device, str):
        device = DeviceChoice(device, {})
    with Servo(
        model,
        renderer=renderer,
        device=device,
        options=options.servo,
        mapping=options.mapping,
        render_options=options.render,
    ) as servo:
        servo.start(lambda stage, fraction: progress(stage, 0.3 * fraction))
        recorder = Recorder(servo) if options.record is not None else None
        servo.enable()
        start = time.perf_counter()
        while (elapsed := time.perf_counter() - start) < seconds:
            progress("touching", 0.3 + 0.7 * elapsed / seconds)
            if not servo.wait(min(POLL_S, seconds - elapsed)):
                break
            if recorder is not None:
                recorder.collect()
        result = servo.report()
        servo.stop()
        if recorder is not None and options.record is not None:
            recorder.write(options.record)
        if servo.failure:
            raise DeviceError(servo.failure)
        progress("touching", 1.0)
        return result
