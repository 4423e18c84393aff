"""An instrument told from presses on something known, and recordings that name it."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import palpate as pp
from palpate import cli
from palpate.diagnosis.calibrate.on_object import instrument_of
from palpate.diagnosis.calibrate.on_plate import calibrate_on_plate
from palpate.mechanics.errors import ContactError, OptionError, RecordingError
from palpate.mechanics.recording.calibration import Calibration, read_calibration
from palpate.mechanics.recording.recording import read_recording, write_recording
from palpate.mechanics.recording.segments import delayed
from palpate.reconstruction.geometry.stated import nowhere
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.scenes.embedded import embedded_recording

from .flat_contact import recorded
from .flat_ground import MODULUS_PA, TIP_M, raster


def on_plate(stiffness: float, play_m: float, delay_s: float, bias: np.ndarray, seed: int = 0):
    """Presses on a rigid plate z = 0 at nine places: the tip stays on it, and the handle goes on by F / k."""
    rng = np.random.default_rng(seed)
    rate, paths = 500.0, []
    for place in range(9):
        t = np.arange(0, 1.6, 1 / rate)
        deep = rng.uniform(0.6, 1.4) * 2.5e-3 * np.sin(np.pi * t / 1.6) ** 2 - 0.7e-3
        paths.append(
            np.column_stack([np.full_like(t, 0.01 * (place % 3)), np.full_like(t, 0.01 * (place // 3)), deep])
        )
    path = np.concatenate(paths)
    deep, n = path[:, 2], len(path)
    # the tool's spring begins half the play later on the way in, half earlier on the way out
    tip = np.empty(n)
    tip[0] = deep[0]
    for i in range(1, n):
        tip[i] = min(max(tip[i - 1], deep[i] - play_m / 2), deep[i] + play_m / 2)
    force = np.column_stack([np.zeros(n), np.zeros(n), stiffness * np.maximum(tip, 0)])
    t = np.arange(n) / rate
    force = delayed([slice(None)], t, force, delay_s) + bias
    made = recorded(np.column_stack([path[:, :2], TIP_M - deep]), np.zeros(n), rate, 0.005, seed)
    return dataclasses.replace(made, force_on_tool=made.force_on_tool + force)


@pytest.mark.parametrize(("stiffness", "play_m", "delay_s"), [(1500.0, 0.0, 0.012), (4000.0, 2e-4, 0.0)])
def test_a_rigid_plate_tells_stiffness_play_and_delay(stiffness, play_m, delay_s):
    bias = np.array([0.03, -0.02, 0.05])
    recording = on_plate(stiffness, play_m, delay_s, bias)
    found = calibrate_on_plate(explore(recording, boundary=nowhere(recording), unbroken=True))
    assert found.stiffness_n_per_m == pytest.approx(stiffness, rel=0.05)
    assert (found.play_m or 0.0) == pytest.approx(play_m, abs=3e-5)
    assert (found.delay_s or 0.0) == pytest.approx(delay_s, abs=2e-3)
    assert found.bias_n == pytest.approx(bias, abs=3e-3)
    low, high = found.interval["stiffness_n_per_m"]
    assert low < found.stiffness_n_per_m < high
    assert "tip_radius_m" in found.about["not_told"]


def test_a_soft_object_is_no_rigid_plate():
    recording = read_recording(embedded_recording())
    with pytest.raises(ContactError, match="differs from press to press"):
        calibrate_on_plate(explore(recording, boundary=nowhere(recording), unbroken=True))


def test_a_recording_that_names_a_calibration_is_read_as_an_ideal_instrument_had(tmp_path):
    clean = raster((2, 2), tilt=False)
    tool = Calibration(
        tip_radius_m=0.0042, stiffness_n_per_m=2000.0,
        matrix=np.array([[1.1, 0.05, 0], [0, 0.95, 0], [0.02, 0, 1.05]]),
        bias_n=np.array([0.1, 0.0, -0.2]), delay_s=0.02,
    )  # fmt: skip
    bent = clean.position - clean.force_on_tool / 2000.0
    read = clean.force_on_tool @ np.asarray(tool.matrix).T + tool.bias_n
    spoilt = dataclasses.replace(
        clean, position=bent, force_on_tool=delayed([slice(None)], clean.t, read, 0.02)
    )
    path = write_recording(tmp_path / "rec.csv.gz", spoilt)
    tool.save(tmp_path / "tool.toml")
    described = tmp_path / "rec.toml"
    described.write_text(described.read_text().replace("[tool]", '[tool]\ncalibration = "tool.toml"'))
    back = read_recording(path)
    inner = slice(10, -10)
    # half a sample of the noise is smeared by the delay
    assert np.abs(back.force_on_tool - clean.force_on_tool)[inner].max() < 0.02
    assert np.abs(back.position - clean.position)[inner].max() < 2e-5
    assert back.tip_radius_m == 0.0042
    assert read_calibration(tmp_path / "tool.toml").delay_s == 0.02
    (tmp_path / "tool.toml").write_text("[calibration]\n[sensor]\nmatrix = [[1, 0], [0, 1]]\n")
    with pytest.raises(RecordingError, match="3 x 3"):
        read_recording(path)


def test_what_was_pressed_must_be_said():
    with pytest.raises(OptionError, match="--rigid"):
        pp.calibrate(raster((2, 2)), progress=False)
    with pytest.raises(OptionError, match="--rigid"):
        pp.calibrate(raster((2, 2)), rigid=True, modulus_pa=MODULUS_PA, progress=False)


@pytest.mark.parametrize(("trust", "gain", "radius"), [("tip", 0.8, 1.0), ("gain", 1.0, 0.64)])
def test_a_tools_give_is_of_the_true_force(trust, gain, radius):
    """A support shows what the tool gives by the force as read; a fit, by the force that the fit has."""
    own = {"time_delay": 0.01, "backlash": 1e-4, "force_gain": np.eye(3).ravel(), "tool_compliance": 1e-3}
    names, values, places = [], [np.log(0.8 * MODULUS_PA)], {}
    for name, value in own.items():
        places[name] = slice(len(values), len(values) + np.size(value))
        values += np.ravel(value).tolist()
        names.append(name)
    up = np.array([0.0, 0.0, 1.0])

    def keys(names, rigid):
        found = SimpleNamespace(names=tuple(names), place_of=places.get)
        return instrument_of(found, np.array(values), MODULUS_PA, rigid, up, trust)

    fitted, shown = keys(names, 0.0), keys(names[:-1], 1e-3)
    assert fitted["give"] == pytest.approx(1e-3 * gain)
    # a sensor that reads 0.8 N of 1 N shows a tool that gives 1 mm a newton read
    assert shown["give"] == pytest.approx(1e-3 * gain)
    assert shown["common_gain"] == pytest.approx(gain) and shown["radius"] == pytest.approx(radius)
    assert shown["delay_s"] == 0.01 and shown["play_m"] == 1e-4


@pytest.mark.slow
def test_ground_of_known_modulus_tells_gain_and_bending_together():
    """Sixteen straight presses hardly part them: what is said of one must leave room for the other. Nine
    leave the bending open, as all may have met the ground early."""
    gain, stiffness = 1.12, 900.0
    clean = raster((4, 4), 0.012, depth_m=0.0025, press_s=0.8)
    spoilt = dataclasses.replace(
        clean,
        force_on_tool=gain * clean.force_on_tool,
        position=clean.position - clean.force_on_tool / stiffness,
    )
    found = pp.calibrate(spoilt, modulus_pa=MODULUS_PA, half_space=True, progress=False)
    low, high = found.interval["common_gain"]
    assert low < gain < high and high - low < 0.6
    soft, stiff = found.interval["stiffness_n_per_m"]
    assert soft < stiffness <= stiff
    assert "tool's bending" not in found.about["not_told"]


def test_the_command_says_how_recordings_are_read_by_it(tmp_path, capsys):
    plate = write_recording(tmp_path / "plate.csv.gz", on_plate(1500.0, 0.0, 0.0, np.zeros(3)))
    assert cli.main(["calibrate", str(plate), "--rigid", "-o", str(tmp_path / "tool.toml")]) == 0
    said = capsys.readouterr().out
    assert "next: " in said and f'calibration = "{tmp_path / "tool.toml"}"' in said
