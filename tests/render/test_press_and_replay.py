"""Scripted presses and replays: exact first touch, files, the error over contact samples, the command
line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from palpate.cli import main
from palpate.mechanics.errors import OptionError, RecordingError
from palpate.mechanics.presses.segmentation import FoundPresses, segment_recording
from palpate.mechanics.recording.recording import Recording
from palpate.render.expected import greatest_difference
from palpate.render.press import Stroke, check_start, press, read_curve, write_curve
from palpate.render.replay import replay, replay_error, replay_touches
from palpate.render.scene import in_the_air

TIP = 0.005


def test_a_press_starts_at_touch_and_reaches_its_depth(cylinder_renderer):
    curve = press(cylinder_renderer, [0, 0, 0.08], [0, 0, -3.0], Stroke(4e-3, 0.02, hold_s=0.05))
    assert curve.depth.max() == pytest.approx(4e-3, abs=1e-9)
    assert curve.normal == pytest.approx([0, 0, 1], abs=1e-6)
    touching = np.linalg.norm(curve.force, axis=1) > 0
    assert (touching == (curve.depth > 1e-9)).mean() > 0.995
    assert curve.force_at(4e-3)[2] > curve.force_at(2e-3)[2] > 0
    assert curve.t[-1] == pytest.approx(2 * 6e-3 / 0.02 + 0.05, abs=2e-3)


def test_an_oblique_press_counts_depth_along_the_normal(cylinder_renderer):
    curve = press(cylinder_renderer, [0.04, 0, 0.04], [-1, 0, -0.5], Stroke(3e-3, 0.01))
    assert curve.normal[0] > 0.99
    assert curve.depth.max() == pytest.approx(3e-3, rel=2e-3)  # the deepest sample is near the turn
    deepest = curve.force[curve.depth.argmax()]
    assert deepest[0] > 0 and deepest[2] > 0  # the sticking tip is held back


@pytest.mark.parametrize(
    ("at", "direction", "words"),
    [
        ([0, 0.3, 0.08], [0, 0, -1], "does not meet"),
        ([0, 0, 0.0], [0, 0, 1], "does not meet"),
        ([0, 0, 0.08], [0, 0, 0], "not 0"),
    ],
)
def test_a_press_that_misses_says_so(cylinder_renderer, at, direction, words):
    with pytest.raises(OptionError, match=words):
        press(cylinder_renderer, at, direction, Stroke(3e-3, 0.01))


def test_curves_survive_their_file_and_are_compared(cylinder_renderer, tmp_path):
    curve = press(cylinder_renderer, [0, 0, 0.08], [0, 0, -1], Stroke(3e-3, 0.02))
    write_curve(tmp_path / "curve.csv", curve)
    same = read_curve(tmp_path / "curve.csv")
    assert greatest_difference(curve, same)[0] < 1e-8
    stiffer = press(cylinder_renderer.with_modulus(30e3), [0, 0, 0.08], [0, 0, -1], Stroke(3e-3, 0.02))
    worst, when = greatest_difference(stiffer, curve)
    assert worst == pytest.approx(curve.peak_force_n / 29, rel=1e-3)
    assert curve.depth[np.searchsorted(curve.t, when)] == pytest.approx(3e-3, rel=0.01)
    (tmp_path / "bad.csv").write_text("t,x\n1,2\n")
    with pytest.raises(RecordingError, match="lacks the columns"):
        read_curve(tmp_path / "bad.csv")


def test_replay_error_counts_contact_samples_of_phase_two_only(cylinder_renderer):
    curve = press(cylinder_renderer, [0, 0, 0.08], [0, 0, -1], Stroke(4e-3, 0.02, approach_m=0.02))
    rng = np.random.default_rng(0)
    lead = 2000
    t = np.arange(lead + len(curve.t)) * 1e-3
    position = np.vstack([np.tile(curve.position[0], (lead, 1)), curve.position])
    force = np.vstack([np.zeros((lead, 3)), curve.force]) + rng.normal(0, 0.01, (len(t), 3))
    force[200:600] += [0.5, 0, 0]  # phase I: the tip leans on the support
    recording = Recording(t, position, force, 1000.0, TIP, boundary_phase=(0.1, 0.8))
    forces = replay(cylinder_renderer, t, position)
    touched = np.flatnonzero(curve.depth > 0)[0]
    presses = segment_recording(
        recording,
        FoundPresses(
            onset_s=t[[lead + touched]],
            peak_s=t[[lead + int(np.argmax(curve.depth))]],
            centre=curve.position[[touched]],
            normal=np.array([[0.0, 0.0, 1.0]]),
        ),
    )
    told = []
    alone = replay_touches(
        cylinder_renderer, recording, presses, np.array([True]), lambda *words: told.append(words)
    )
    assert alone == pytest.approx(forces, abs=1e-6) and not alone[:1000].any()
    assert told[0] == ("press 1 of 1", 0.0) and told[-1][1] == 1.0
    assert not replay_touches(cylinder_renderer, recording, presses, np.array([False])).any()
    error = replay_error(recording, presses, forces)
    assert error.rmse_n == pytest.approx(0.01 * np.sqrt(3), rel=0.05)
    touched = np.linalg.norm(np.vstack([np.zeros((lead, 3)), curve.force]), axis=1) > 0.05
    assert error.contact[touched].all() and not error.contact[:1000].any()
    assert error.contact.sum() < touched.sum() + 300
    with pytest.raises(OptionError, match="positions"):
        replay(cylinder_renderer, t, position[:-1])


@pytest.mark.parametrize(
    ("name", "limit_n"),
    [
        pytest.param("silicone-1-cylinder", 0.045, marks=pytest.mark.slow),
        pytest.param("silicone-2-block", 0.045, marks=pytest.mark.release),
        pytest.param("silicone-3-halfsphere", 0.05, marks=pytest.mark.release),
    ],
)
def test_a_reconstructed_model_replays_its_recording(
    shared_recordings, reconstructed, tmp_path, name, limit_n
):
    recording = str(shared_recordings / f"{name}.toml")
    model = str(reconstructed(name).path)
    for run in ("a", "b"):
        arguments = [
            "replay",
            model,
            recording,
            "-o",
            str(tmp_path / f"{run}.csv"),
            "--json",
            str(tmp_path / "r.json"),
        ]
        assert main(arguments) == 0
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert json.loads((tmp_path / "r.json").read_text())["rmse_n"] < limit_n


@pytest.mark.slow
def test_fem_predicts_the_left_out_top_and_the_1d_models_do_not(shared_recordings, tmp_path):
    recording = str(shared_recordings / "silicone-1-cylinder.toml")
    assert (
        main(["compare", recording, "--json", str(tmp_path / "c.json"), "-o", str(tmp_path / "c.html")]) == 0
    )
    result = json.loads((tmp_path / "c.json").read_text())
    assert set(result["rmse_n"]) == {"fem", "fem-homogeneous", "kelvin-voigt", "hunt-crossley"}
    top = next(r for r in result["regions"] if r["name"] == "top")
    assert abs(top["bias"]["fem"]) < 0.06
    assert top["bias"]["kelvin-voigt"] < -0.25 and top["bias"]["hunt-crossley"] < -0.25
    assert result["rmse_n"]["fem"] < 0.3 * min(
        result["rmse_n"]["kelvin-voigt"], result["rmse_n"]["hunt-crossley"]
    )


def test_a_press_starts_free_or_is_refused(block_renderer):
    side = np.array([-1.0, 0.0, 0.0])
    low = np.array([0.0, 0.0, -0.001])
    with pytest.raises(OptionError, match="support"):
        press(block_renderer, low, side, Stroke(1e-3, 0.02))
    foot = np.array([0.0, 0.0, 0.003])
    assert press(in_the_air(block_renderer), foot, side, Stroke(1e-3, 0.02)).peak_force_n > 0
    touch = np.array([0.065, 0.0, 0.04])
    for inside in ([0.05, 0.0, 0.04], [0.0605, 0.0, 0.04], [0.0649, 0.0, 0.04]):
        with pytest.raises(OptionError, match="meets the surface"):
            check_start(in_the_air(block_renderer), np.array(inside), touch, TIP)
    check_start(in_the_air(block_renderer), np.array([0.067, 0.0, 0.04]), touch, TIP)


def test_a_path_that_starts_in_the_object_is_refused_with_the_time_from_which_it_is_free(block_renderer):
    """Its first press would be felt as nothing."""
    height = 0.08 + TIP + np.concatenate([np.linspace(-2e-3, 4e-3, 50), np.linspace(4e-3, -2e-3, 50)])
    path, t = np.outer(height, [0.0, 0.0, 1.0]), 1e-3 * np.arange(100)
    scene = in_the_air(block_renderer)
    with pytest.raises(OptionError, match="is free at t = ") as refused:
        replay(scene, t, path)
    free = float(str(refused.value).split("t = ")[-1].split(" s")[0])
    rest = t >= free
    assert 0.01 < free < 0.05
    assert np.linalg.norm(replay(scene, t[rest], path[rest])[-1]) > 0.01
    with pytest.raises(OptionError, match="never leaves"):
        replay(scene, t[:10], path[:10])
    # a tip that was not read at first is none that is in the object
    path[:50] = np.nan
    assert np.linalg.norm(replay(scene, t, path)[-1]) > 0.01
