"""A person with only a mouse traces the base, presses here and there, and gets back what was rendered."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from devices.channel import PoseChannel
from devices.registry import DeviceChoice
from mechanics.model import Model
from mechanics.recording import read_recording
from palpate.window.session import TouchSession
from palpate.window.window import TouchWindow
from reconstruct.pipeline import reconstruct
from scenes.scene import Scene

from .driven import Driven
from .small import SIZE

SIDES = [
    np.array([0.0, -1.0, 0.0]),
    np.array([1.0, 0.0, 0.0]),
    np.array([0.0, 1.0, 0.0]),
    np.array([-1.0, 0, 0]),
]
HALF = SIZE[0] / 2
TRACING_M_PER_S = 0.03


def along_the_foot(driven: Driven, side: np.ndarray) -> None:
    """Button down on the support before the side, mouse along its foot, button up."""
    right = np.array([-side[1], side[0], 0.0])
    reach = HALF + 0.008
    driven.mouse_at(HALF * side + 0.006 * side - reach * right)
    driven.until(lambda f: np.linalg.norm(f.tip_m - driven.window.pointer.tip_m) < 1e-4)
    driven.wait(0.3)
    driven.button(True)
    driven.wait(0.6)
    start, duration = time.perf_counter(), 2 * reach / TRACING_M_PER_S
    while (share := (time.perf_counter() - start) / duration) < 1.0:
        driven.mouse_at(HALF * side + 0.004 * side + (2 * share - 1) * reach * right)
        driven.wait(0.01)
    driven.button(False)
    driven.wait(0.4)


def press(driven: Driven, place: np.ndarray) -> None:
    driven.mouse_at(place)
    driven.wait(0.8)
    driven.button(True)
    driven.wait(0.9)
    driven.button(False)
    driven.wait(0.5)


@pytest.mark.slow
def test_what_a_mouse_touched_is_reconstructed(block: Model, tmp_path: Path) -> None:
    path = tmp_path / "mouse.csv.gz"
    channel = PoseChannel.create()
    channel.write(time.perf_counter(), (0.0, 0.0, 0.1))
    device = DeviceChoice("mouse", {"channel": str(channel.path)})
    with TouchSession(block, title="Block", device=device, recording=path) as session:
        session.start()
        session.enable()
        window = TouchWindow(session, Scene("block", "model", "", title="Block"), channel, off_screen=True)
        driven = Driven(window)
        for side in SIDES:
            driven.look_from(np.arctan2(side[1], side[0]))
            along_the_foot(driven, side)
        assert session.recording.traced > 0.95
        driven.wheel(2, ctrl=True)  # deeper than at the beginning
        for side in SIDES:
            right = np.array([-side[1], side[0], 0.0])
            driven.look_from(np.arctan2(side[1], side[0]))
            for across in (-0.5, 0.4):
                press(driven, HALF * side + across * HALF * right + [0, 0, 0.022])
                press(driven, 0.6 * HALF * side + across * HALF * right + [0, 0, SIZE[2]])
        window.plotter.close()
    channel.close()
    recording = read_recording(path)
    assert recording.base_model is None and recording.boundary_phase is not None
    model = reconstruct(recording)
    assert model.material.young_modulus_pa == pytest.approx(block.material.young_modulus_pa, rel=0.05)
