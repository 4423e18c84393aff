"""One scene: beside the object a tip meets the plane that it stands on, at its foot both, whoever renders
it."""

from __future__ import annotations

import json

import numpy as np
import pytest

from palpate.cli import main
from palpate.mechanics.errors import OptionError
from palpate.render.press import Stroke, press, read_curve
from palpate.render.replay import replay
from palpate.render.scene import TouchScene, in_the_air, scene_of
from palpate.render.support import SupportOptions, support_plane

TIP = 0.005
BESIDE = [0.09, 0.0, 0.0]  # the block ends at 0.06


def test_a_press_beside_the_object_meets_the_plane_with_its_stiffness(block_renderer):
    curve = press(block_renderer, BESIDE, [0, 0, -1], Stroke(1e-3, 0.01, hold_s=0.1))
    assert curve.normal == pytest.approx([0, 0, 1])
    assert curve.position[curve.depth.argmax()] == pytest.approx([0.09, 0, TIP - 1e-3], abs=1e-12)
    still = curve.force[1:][np.diff(curve.position[:, 2]) == 0]
    assert len(still) > 50 and still == pytest.approx(np.tile([0, 0, 1.5], (len(still), 1)), abs=1e-9)
    coming = (np.diff(curve.depth, prepend=0) > 9.99e-6) & (curve.depth > 1e-5)
    expected = 1500 * curve.depth[coming] + 2.0 * 0.01  # the plane's damping, at 10 mm/s
    assert curve.force[coming, 2] == pytest.approx(expected, abs=1e-9)
    leaving = (np.diff(curve.depth, prepend=0) < -9.99e-6) & (curve.depth > 1e-4)
    assert curve.force[leaving, 2] == pytest.approx(1500 * curve.depth[leaving] - 0.02, abs=1e-9)


def test_a_replay_of_a_press_feels_the_same_force(block_renderer):
    for at, direction in ((BESIDE, [0, 0, -1]), (BESIDE, [0.3, 0.2, -1]), ([0.06, 0, 0.004], [-1, 0, 0])):
        curve = press(block_renderer, at, direction, Stroke(1e-3, 0.02))
        again = replay(block_renderer, curve.t, curve.position)
        assert np.abs(again - curve.force).max() < 1e-9 and curve.peak_force_n > 0.2


def test_at_the_foot_object_and_support_add_up(block_renderer):
    options = SupportOptions(support_damping_n_s_per_m=0.0, support_friction=0.3)
    scene = scene_of(block_renderer, options)
    both = press(scene, [0.06, 0, 0.004], [-1, 0, 0], Stroke(2e-3, 0.05))
    alone = press(in_the_air(block_renderer), [0.06, 0, 0.004], [-1, 0, 0], Stroke(2e-3, 0.05))
    support = both.force - alone.force
    moving = np.abs(np.diff(both.position[:, 0], prepend=np.nan)) > 4.99e-5
    going = -np.sign(np.diff(both.position[:, 0], prepend=np.nan))[moving]
    assert support[moving, 2] == pytest.approx(np.full(moving.sum(), 1.5), abs=1e-9)
    # drags against the motion: at the object, going in, the plane pulls back
    assert support[moving, 0] == pytest.approx(0.3 * 1.5 * going, abs=1e-9)
    assert alone.force[both.depth.argmax(), 0] > 0.3


def test_a_line_that_meets_both_touches_what_comes_first(block_renderer):
    on_top = press(block_renderer, [0, 0, 0.08], [0, 0, -1], Stroke(1e-3, 0.02))
    assert on_top.position[on_top.depth.argmax(), 2] == pytest.approx(0.08 + TIP - 1e-3, abs=1e-6)
    aslant = press(
        block_renderer, [0.08, 0, 0], [-0.5, 0, -1], Stroke(1e-3, 0.02)
    )  # the wall lies behind the plane
    assert aslant.normal == pytest.approx([0, 0, 1])


def test_without_a_support_there_is_nothing_beside_the_object(block_renderer):
    bare = scene_of(block_renderer, SupportOptions(support=False))
    with pytest.raises(OptionError, match="does not meet"):
        press(bare, BESIDE, [0, 0, -1], Stroke(1e-3, 0.02))
    path = np.tile([0.09, 0, 0.004], (5, 1))
    assert not replay(bare, np.arange(5) * 1e-3, path).any()
    assert replay(block_renderer, np.arange(5) * 1e-3, path)[:, 2] == pytest.approx(np.full(5, 1.5))
    with pytest.raises(OptionError, match="does not meet"):  # a metre away is a slip of the pen
        press(block_renderer, [1, 0, 0], [0, 0, -1], Stroke(1e-3, 0.02))


def test_each_tip_meets_the_plane_by_itself_and_one_that_is_lost_meets_nothing(block_renderer):
    scene = TouchScene(block_renderer, support_plane(block_renderer.model))
    state = scene.start([TIP, 2 * TIP])
    tips = np.array([[0.09, 0, 0.004], [0.12, 0, 0.009]])
    for _ in range(2):
        state, forces = scene.step(state, tips)
        assert forces[:, 2] == pytest.approx([1.5, 1.5])
    state, forces = scene.step(state, np.array([[np.nan, 0, 0], [0.12, 0, 0.009]]))
    assert not forces[0].any() and forces[1, 2] == pytest.approx(1.5)
    state, forces = scene.step(state, tips)  # back again: at rest, as nobody knows where from
    assert forces[:, 2] == pytest.approx([1.5, 1.5])


def test_a_device_makes_the_plane_softer(block_renderer):
    soft = scene_of(block_renderer).no_stiffer_than(300.0)
    curve = press(soft, BESIDE, [0, 0, -1], Stroke(1e-3, 0.01, hold_s=0.1))
    assert curve.force[len(curve.force) // 2, 2] == pytest.approx(0.3, abs=1e-9)
    assert scene_of(block_renderer).no_stiffer_than(1e5).support.stiffness_n_per_m == 1500.0
    with pytest.raises(OptionError, match="support_friction"):
        SupportOptions(support_friction=-1.0)


def test_press_and_replay_have_the_support_on_the_command_line(block_folder, tmp_path, capsys):
    folder = str(block_folder)
    curve, result = str(tmp_path / "curve.csv"), tmp_path / "result.json"
    there = ["press", folder, "--at", "0.05,0,0", "--direction", "0,0,-1", "--depth", "0.001"]
    assert main([*there, "--hold", "0.1", "-o", curve, "--json", str(result)]) == 1  # not the object's
    assert json.loads(result.read_text())["normal"] == [0, 0, 1]
    force = read_curve(curve).force
    assert force[len(force) // 2, 2] == pytest.approx(1.5, abs=1e-9)
    assert main([*there, "--hold", "0.1", "--support-stiffness", "500", "-o", curve]) == 1
    force = read_curve(curve).force
    assert force[len(force) // 2, 2] == pytest.approx(0.5, abs=1e-9)
    assert main([*there, "--no-support"]) == 2
    assert "does not meet" in capsys.readouterr().err
