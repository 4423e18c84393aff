"""A servo session without a window, felt by the simulated hand: start, enable, wait, stop, report."""

from __future__ import annotations

import time

import numpy as np

from palpate.devices.intention import FreeExploration
from palpate.devices.registry import DeviceChoice
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.servo.client import Servo
from palpate.servo.report import ServoReport

POLL_S = 0.2


def exploring_hand(model: Model, *, seed: int = 0) -> DeviceChoice:
    """The simulated hand, pressing a model from all free sides until it feels 1 N."""
    points = model.mesh.points[np.unique(model.mesh.touchable_surface)]
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = float(np.linalg.norm(points - centre, axis=1).max()) + 2.0 * model.tool.tip_radius_m
    intention = FreeExploration(
        centre,
        radius,
        up=model.support.normal,
        target_force_n=1.0,
        speed_m_per_s=0.05,
        seed=seed,
    )
    return DeviceChoice("simulated", {"intention": intention, "seed": seed})


def run_headless(
    model: Model, renderer: str, seconds: float, *, seed: int, progress: Progress = silent
) -> ServoReport:
    """Let the simulated hand explore `model` for `seconds`, and report; prints nothing. Raises the
    PalpateError that stopped it."""
    with Servo(model, renderer=renderer, device=exploring_hand(model, seed=seed)) as servo:
        servo.start(lambda stage, fraction: progress(stage, 0.3 * fraction))
        servo.enable()
        start = time.perf_counter()
        while (elapsed := time.perf_counter() - start) < seconds:
            progress("touching", 0.3 + 0.7 * elapsed / seconds)
            if not servo.wait(min(POLL_S, seconds - elapsed)):
                break
        result = servo.report()
        servo.stop()
        if servo.failure:
            raise DeviceError(servo.failure)
        progress("touching", 1.0)
        return result
