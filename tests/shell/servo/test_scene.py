"""What the servo lets feel is what a press of the same scene says: the same path, the same force."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.devices.safety import SafetyOptions, safety_parameters
from palpate.devices.virtual_hand import SPEC
from palpate.render.passivity import PassivityOptions, passivity_parameters
from palpate.render.press import Stroke, press
from palpate.render.scene import scene_of
from palpate.servo.layout import ENABLE, total_bytes, views
from palpate.servo.loop import Program, run_tick
from palpate.servo.tick import (
    IN_CALIBRATED,
    IN_CONNECTED,
    IN_ENABLED,
    IN_FORCE_MAP,
    IN_POSITION,
    IN_QUATERNION,
    IN_SEQUENCE,
    IN_TIME,
    IN_TIP,
    IN_TIP_VELOCITY,
    IN_WIDTH,
    TickParameters,
    put_pose,
    tick_arrays,
)

from ...render import shapes

PERIOD = 1_000_000


@pytest.fixture(scope="module")
def scene():
    """A block of 60 x 60 x 30 mm on its support."""
    return scene_of(shapes.fem(shapes.model(shapes.block((0.06, 0.06, 0.03), (4, 4, 2)))))


def felt(scene, path: np.ndarray) -> np.ndarray:
    """(n, 3) N, rendered by the servo's own tick along a path (n, 3) m at 1 kHz."""
    arrays = tick_arrays(views(bytearray(total_bytes())), np.zeros((1, 3)), np.zeros(3))
    parameters = TickParameters(
        PERIOD,
        200_000,
        safety_parameters(SafetyOptions(), SPEC),
        passivity_parameters(PassivityOptions(), max_damping_n_s_per_m=10.0),
    )
    program = Program(scene, None, None, scene.renderer.start(dt_s=1e-3), parameters)
    arrays.shared.control[ENABLE] = 1
    velocity = np.diff(path, axis=0, prepend=path[:1]) / 1e-3
    forces = np.zeros_like(path)
    for k, place in enumerate(path):
        pose = np.zeros(IN_WIDTH)
        pose[[IN_CONNECTED, IN_CALIBRATED, IN_ENABLED, IN_QUATERNION]] = 1.0
        pose[[IN_FORCE_MAP, IN_FORCE_MAP + 4, IN_FORCE_MAP + 8]] = 1.0
        now = 10**9 + k * PERIOD
        pose[IN_TIME], pose[IN_SEQUENCE] = now * 1e-9, k + 1
        pose[IN_POSITION : IN_POSITION + 3] = pose[IN_TIP : IN_TIP + 3] = place
        pose[IN_TIP_VELOCITY : IN_TIP_VELOCITY + 3] = velocity[k]
        put_pose(arrays, pose)
        run_tick(program, arrays, now, now)
        forces[k] = arrays.rendered
    return forces


@pytest.mark.parametrize(
    ("at", "direction"),
    [
        ([0.05, 0, 0], [0, 0, -1]),  # beside the object
        ([0.05, 0, 0], [0.4, 0.3, -1]),
        ([0.03, 0, 0.004], [-1, 0, 0]),  # at its foot
        ([0, 0, 0.03], [0.1, 0, -1]),  # on its top
    ],
)
def test_the_servo_feels_what_a_press_says(scene, at, direction):
    curve = press(scene, at, direction, Stroke(1.5e-3, 0.02, hold_s=0.02))
    assert curve.peak_force_n > 0.1
    assert np.abs(felt(scene, curve.position) - curve.force).max() < 1e-9
