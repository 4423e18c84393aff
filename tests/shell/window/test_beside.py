"""The renderer beside the one that is felt follows every tick of the servo, in as few calls as pictures."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from palpate.render.scene import scene_of
from palpate.window.window_renderers import Beside


def test_many_ticks_at_once_are_felt_as_one_after_the_other(block):
    scene = scene_of(pp.renderer(block, "fem"))
    top = float(block.mesh.points[:, 2].max())
    tips = np.tile([0.0, 0.0, top + 0.005], (300, 1))
    tips[:, 2] -= 0.004 * np.sin(np.linspace(0, np.pi, 300))
    tips[:, 0] += np.linspace(0, 0.003, 300)
    at_once, by_one = Beside("fem", scene, 0.004), Beside("fem", scene, 0.004)
    sizes = np.concatenate([at_once.follow(tips[:200]), at_once.follow(tips[:0]), at_once.follow(tips[200:])])
    state, expected = scene.start([0.004]), []
    for tip in tips:
        state, forces = scene.step(state, tip[None])
        expected.append(np.linalg.norm(forces[0]))
        by_one.follow(tip[None])
    assert max(expected) > 0.02
    assert sizes == pytest.approx(expected, abs=1e-9)
    assert at_once.view().displacement_m == pytest.approx(by_one.view().displacement_m, abs=1e-9)
