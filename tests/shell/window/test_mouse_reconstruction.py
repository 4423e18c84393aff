"""A person with only a mouse traces the base, presses here and there, and gets back what was rendered."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import read_recording
from palpate.reconstruction.pipeline import reconstruct
from palpate.scenes.scene import Scene
from palpate.window.session import SessionOptions

from .driven import HALF, SIDES, Driven, along_the_foot, driving
from .small import SIZE


def press(driven: Driven, place: np.ndarray) -> None:
    driven.mouse_at(place)
    driven.rests(0.3)
    driven.button(True)
    driven.rests(0.3)
    driven.button(False)
    driven.rests(0.3)


@pytest.mark.release
def test_what_a_mouse_touched_is_reconstructed(block: Model, tmp_path: Path) -> None:
    path = tmp_path / "mouse.csv.gz"
    scene = Scene("block", "model", "", title="Block")
    with driving(block, scene, SessionOptions(recording=path)) as driven:
        for side in SIDES:
            driven.look_from(np.arctan2(side[1], side[0]))
            along_the_foot(driven, side)
        assert driven.session.recording.traced > 0.95
        driven.wheel(2, ctrl=True)  # deeper than at the beginning
        for side in SIDES:
            right = np.array([-side[1], side[0], 0.0])
            driven.look_from(np.arctan2(side[1], side[0]))
            for across in (-0.5, 0.4):
                press(driven, HALF * side + across * HALF * right + [0, 0, 0.022])
                press(driven, 0.6 * HALF * side + across * HALF * right + [0, 0, SIZE[2]])
    recording = read_recording(path)
    assert recording.base_model is None and recording.boundary_phase is not None
    model = reconstruct(recording)
    assert model.material.young_modulus_pa == pytest.approx(block.material.young_modulus_pa, rel=0.05)
