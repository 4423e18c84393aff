"""Results: their numbers mean what they say, they print with units, and what they draw is what they hold."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
import pyvista
from matplotlib.image import imread

import palpate as pp
from palpate.testing import press_model  # noqa: F401  (pytest finds the fixture by its name)

from .conftest import DEPTH_M, PLACES_M, STIFFER


def test_paths_names_and_loaded_things_are_all_taken(folder, recording, tmp_path):
    model = pp.load(folder)
    assert isinstance(model, pp.Model) and pp.load(model) is model
    for again in (model, pp.load(str(folder))):
        assert again.material.young_modulus_pa == pytest.approx(30e3)
    taken = pp.read_recording(recording)
    assert isinstance(taken, pp.Recording) and pp.read_recording(taken) is taken
    again = pp.read_recording(taken.save(tmp_path / "block.csv.gz"))
    assert again.position == pytest.approx(recording.position, abs=1e-9)
    assert pp.read_recording("silicone-1-cylinder").duration_s == pytest.approx(109.5, abs=0.1)


def test_what_is_not_there_is_told_with_what_is():
    with pytest.raises(pp.RecordingError, match="embedded are silicone-1-cylinder"):
        pp.read_recording("silicone-9")
    with pytest.raises(pp.SceneError, match="allowed are .*nodule"):
        pp.load("no-such-model")
    with pytest.raises(pp.OptionError, match="a float is no recording"):
        pp.read_recording(3.0)
    with pytest.raises(pp.OptionError, match="a float is no model"):
        pp.load(3.0)


def test_replay_of_a_stiffer_object_errs_by_its_share(felt, recording):
    result = pp.replay(felt, recording)
    assert result.relative == pytest.approx(1 - 1 / STIFFER, rel=1e-6)
    assert result.rmse_n == pytest.approx(result.relative * result.force_rms_n)
    assert np.abs(result.error_n[~result.contact]).max() < 1e-12
    assert result.noise_n == pytest.approx(0.01 * np.sqrt(3))
    places, errors = result.touches()
    expected = np.column_stack([PLACES_M, np.full(3, 0.03)])
    assert places == pytest.approx(expected, abs=2e-4)
    assert errors == pytest.approx(np.full(3, result.rmse_n), rel=0.05)


def test_a_recording_far_from_the_model_is_refused_in_a_line(felt, recording):
    far = dataclasses.replace(recording, position=recording.position + np.array([0.5, 0.0, 0.0]))
    for asked in (
        pp.replay,
        lambda model, rec: pp.diagnose(rec, model.model),
        lambda m, r: pp.compare(r, m.model),
    ):
        with pytest.raises(pp.ContactError, match=r"lies 0.4\d m from the model .*: is it in another frame"):
            asked(felt, far)


def test_check_counts_presses_over_the_base_that_a_model_lends(folder, recording):
    t = np.arange(3000) / 1000.0
    wave = np.column_stack([0.08 * np.cos(3 * t), 0.08 * np.sin(3 * t), 0.08 + 0.03 * np.sin(5 * t)])
    force = np.concatenate([0 * wave, recording.force_on_tool])
    lent = dataclasses.replace(
        recording,
        t=np.arange(len(t) + len(recording.t)) / 1000.0,
        position=np.concatenate([wave, recording.position]),
        force_on_tool=force + np.random.default_rng(0).normal(0, 0.01, force.shape),
        base_model=folder,
    )
    checked = pp.check(lent)
    assert [f.name for f in checked.grave] == ["no presses"] and "usable" in checked.grave[0].saw


def test_press_by_a_name_is_press_by_a_renderer(folder, curves):
    again = pp.press(str(folder), (0, 0, 0.03), (0, 0, -2), DEPTH_M, hold_s=0.1, friction=np.inf)
    assert np.array_equal(again.force, curves[0].force)
    assert again.force_at(DEPTH_M)[2] > 0.3


@pytest.fixture(scope="module")
def results(folder, felt, recording, curves):
    """A result of each kind that takes no minute."""
    return {
        "recording": pp.read_recording(recording),
        "model": pp.load(folder),
        "replay": pp.replay(felt, recording),
        "curve": curves[0],
    }


@pytest.mark.parametrize("name", ["recording", "model", "replay", "curve"])
def test_it_prints_a_few_lines_with_units(results, name):
    words = str(results[name])
    assert repr(results[name]) == words
    assert 1 <= len(words.splitlines()) <= 6 and max(map(len, words.splitlines())) < 160
    assert re.search(r"\d (mm|N|kPa|Hz)\b", words) and "array(" not in words


def test_a_curve_says_its_modulus_and_names_the_file_that_was_written(curves):
    from palpate.show import next_lines

    assert "30 kPa" in str(curves[0])
    assert "--expect mine.csv" in " ".join(next_lines(curves[0], written="mine.csv"))
    assert "-o CURVE.csv" in " ".join(next_lines(curves[0]))


@pytest.mark.parametrize("name", ["recording", "replay", "curve"])
def test_its_plot_has_units_and_its_numbers(results, name):
    ax = results[name].plot()
    assert re.search(r"\[(s|mm)\]", ax.get_xlabel()) and "[N]" in ax.get_ylabel()
    drawn = ax.lines[0].get_ydata()
    held = {
        "recording": lambda r: np.linalg.norm(r.force_on_tool, axis=1),
        "replay": lambda r: np.linalg.norm(r.recording.force_on_tool, axis=1),
        "curve": lambda r: (r.force @ r.normal)[r.depth > 0],
    }
    assert drawn == pytest.approx(held[name](results[name]))


def test_plot_draws_where_it_is_told(results):
    from matplotlib.figure import Figure

    axes = Figure().subplots(1, 2)
    for ax, result in zip(axes, results.values(), strict=False):
        assert result.plot(ax) is ax and (ax.lines or ax.collections)


@pytest.mark.parametrize("name", ["recording", "model", "replay", "curve"])
def test_it_shows_itself_without_a_screen(results, name, tmp_path):
    path = tmp_path / "scene.png"
    results[name].show(screenshot=path)
    picture = imread(path)[..., :3]
    assert 0.02 < np.mean(np.ptp(picture.reshape(-1, 3), axis=1) + (picture.min(axis=2).ravel() < 0.9) > 0.05)
    mine = pyvista.Plotter(off_screen=True)
    assert results[name].show(mine) is mine and len(mine.actors) >= 1
    mine.close()


def test_shown_press_is_deformed_by_its_depth(curves):
    plotter = pyvista.Plotter(off_screen=True)
    curves[0].show(plotter)
    moved = next(m for m in plotter.meshes if "displacement [mm]" in m.array_names)
    under = (np.linalg.norm(moved.points[:, :2], axis=1) < 1e-3) & (moved.points[:, 2] > 0.015)
    assert 0.03 - moved.points[under, 2].min() == pytest.approx(DEPTH_M, rel=0.15)
    assert moved["displacement [mm]"].max() == pytest.approx(DEPTH_M * 1e3, rel=0.15)
    plotter.close()


def test_a_notebook_gets_words_and_picture(results):
    page = results["curve"]._repr_html_()
    assert "N at most" in page and "data:image/png;base64," in page


def test_without_a_screen_show_says_what_to_do(results, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr(pyvista, "OFF_SCREEN", False)
    with pytest.raises(pp.OptionError, match="no screen .*screenshot="):
        results["curve"].show()


def test_folder_that_is_no_model_is_refused_before_the_work(recording, tmp_path):
    (tmp_path / "mine.txt").write_text("precious")
    with pytest.raises(pp.FileError, match="is no MODEL folder"):
        pp.reconstruct(recording, save=tmp_path)


def test_testing_fixture_presses_through_the_door(folder, curves, press_model):  # noqa: F811
    curve = press_model(folder, at=(0, 0, 0.03), depth_m=DEPTH_M, hold_s=0.1, friction=np.inf)
    assert isinstance(curve, pp.Curve) and np.array_equal(curve.force, curves[0].force)
