"""Scenes: what a file may say, and the model that comes of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palpate.devices.virtual_hand import LONGEST_CATCH_UP_S
from palpate.mechanics.errors import SceneError
from palpate.mechanics.model.material import ObjectMaterial, balls_ratio
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.scenes.build import model_of
from palpate.scenes.kept import keep
from palpate.scenes.phantoms import Region
from palpate.scenes.scene import ball_of, load_scene, read_scene, scene_names
from palpate.scenes.virtual_presses import ExplorationOptions, base_tracing, explore, spread_places

from .small import block_mesh


def test_embedded_scenes_are_there_and_whole() -> None:
    assert {"demo", "silicone-1", "silicone-2", "silicone-3", "bean", "nodule", "your-recording"} <= set(
        scene_names()
    )
    for name in scene_names():
        scene = load_scene(name)
        assert scene.title and scene.about and scene.renderer == "fem"
    assert load_scene("silicone-1").young_modulus_pa == 29e3
    assert load_scene("nodule").inclusions[0].modulus_ratio > 1


def test_what_the_demo_made_is_what_is_touched(block: Model, tmp_path: Path) -> None:
    scene = load_scene("demo")
    keep(scene, block.path, cache=tmp_path)
    touched = model_of(scene, cache=tmp_path)
    assert np.array_equal(touched.mesh.points, block.mesh.points)
    assert touched.path != block.path
    assert {f.name for f in touched.path.iterdir()} == {f.name for f in block.path.iterdir()}


def test_only_a_model_goes_before_a_scene_of_its_name(
    block: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "demo").mkdir()
    assert load_scene("demo").kind == "recording"
    (tmp_path / "bean").symlink_to(block.path)
    assert load_scene("bean").kind == "model"


def test_scenes_of_one_recording_share_its_model(block: Model, tmp_path: Path) -> None:
    keep(load_scene("demo"), block.path, cache=tmp_path)
    kept = model_of(load_scene("demo"), cache=tmp_path).path
    for name in ("your-recording", "silicone-1-cylinder"):
        assert model_of(load_scene(name), cache=tmp_path).path == kept


def test_anything_that_can_be_touched_is_a_scene(block: Model, tmp_path: Path) -> None:
    assert load_scene(block.path).kind == "model"
    assert load_scene("bowl").kind == "phantom"
    assert load_scene("silicone-1-cylinder").kind == "recording"
    with pytest.raises(SceneError, match="silicone-1, .*MODEL folder.*bowl"):
        load_scene("teapot")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[object]\nphantom = 'block'\nmodel = 'x'", "exactly one of"),
        ("[object]", "exactly one of"),
        ("[object]\nphantom = 'block'\nyoung_modulus_kpa = 3", "did you mean young_modulus_pa"),
        ("colour = 'red'\n[object]\nphantom = 'block'", "colour is no key: allowed are title"),
        ("[object]\nphantom = 'block'\nyoung_modulus_pa = -3", "from 1 to 1e.09 Pa"),
        ("[object]\nphantom = 'block'\nyoung_modulus_pa = 'soft'", "= 'soft'; it must be a number"),
        ("[object]\nphantom = 'block'\n[render]\ncolour = 'red'", "displacement, stiffness"),
        ("[object]\nphantom = 'block'\n[[inclusion]]\nradius_m = 0.01", "centre_m is missing"),
        ("[object", "no valid TOML"),
    ],
)
def test_a_wrong_scene_says_what_is_allowed(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(SceneError, match=words):
        read_scene(path)


def test_paths_are_from_the_scenes_own_folder(
    block: Model, tmp_path: Path, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "mine.toml"
    (tmp_path / "here").symlink_to(block.path)
    path.write_text("[object]\nmodel = 'here'\nyoung_modulus_pa = 5e3\n[tool]\ntip_radius_m = 0.004\n")
    with pytest.raises(SceneError, match="outside its folder"):  # where the link leads
        load_scene(path)
    monkeypatch.setenv("PALPATE_FOLLOW_PATHS", "1")
    model = model_of(load_scene(path))
    assert (model.material.young_modulus_pa, model.tool.tip_radius_m) == (5e3, 0.004)
    assert model.path.is_relative_to(own_cache) and block.material.young_modulus_pa == 20e3
    again = model_of(load_scene(path))
    assert again.path == model.path
    path.write_text(path.read_text().replace("5e3", "6e3"))
    assert model_of(load_scene(path)).path != model.path


def test_a_model_about_which_nothing_changes_is_used_itself(block: Model) -> None:
    assert model_of(load_scene(block.path)).path == block.path


def test_inclusions_are_stiff_where_they_are() -> None:
    mesh = block_mesh()
    ball = Region("ball", (0.01, 0.0, 0.02), 0.014, 5.0)
    other = Region("other", (-0.03, 0.0, 0.02), 0.006, 3.0)
    ratio = balls_ratio(mesh, [ball_of(ball), ball_of(other)])
    middle = mesh.points[mesh.tetrahedra[:, :4]].mean(axis=1)
    assert ratio.max() > 4.0 and np.linalg.norm(middle[ratio.argmax()] - ball.centre_m) < ball.radius_m
    assert (ratio[np.linalg.norm(middle - other.centre_m, axis=1) > 0.05] >= 1.0).all()
    assert ratio == pytest.approx(balls_ratio(mesh, [ball_of(ball)]) * balls_ratio(mesh, [ball_of(other)]))
    assert (balls_ratio(mesh, []) == 1.0).all()


def test_an_object_that_is_lower_than_a_tip_is_pressed_on_its_top() -> None:
    plate = Model(
        mesh=box_mesh((8, 8, 2), (0.04, 0.04, 0.006)).quadratic(),
        material=ObjectMaterial(5000.0, 0.45),
        support=Support(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        tool=Tool(0.005),
        mesh_size_m=0.005,
    )
    assert plate.mesh.points[spread_places(plate, 5), 2] == pytest.approx(0.006)


def test_virtual_presses_spread_and_stay_off_rims(block: Model) -> None:
    places = block.mesh.points[spread_places(block, 12)]
    gaps = np.linalg.norm(places[:, None] - places[None], axis=2) + np.eye(len(places))
    assert gaps.min() > 0.01
    on_faces = (np.abs(places[:, :2]) > 0.0399).sum(axis=1) + (places[:, 2] > 0.0399)
    assert (on_faces == 1).all()
    fits, r = block.presses.fits, block.presses.fits["r_hc"]
    assert (fits["k_kv"] > 0).all() and (fits["k_hc"] > 0).all() and ((r > 1.0) & (r < 1.6)).all()
    assert (block.presses.depth_m == 0.005).all()


def test_exploration_traces_the_foot_and_presses_outside_in(block: Model) -> None:
    options = ExplorationOptions(sites=5, repeats=2)
    trace = base_tracing(block, options)
    outside = np.maximum(np.abs(trace[:, :2]) - 0.04, 0.0)
    assert np.linalg.norm(outside, axis=1) == pytest.approx(
        block.tool.tip_radius_m - options.lean_m, abs=2e-4
    )
    assert trace[:, 2] == pytest.approx(block.tool.tip_radius_m - options.bear_down_m)
    angle = np.unwrap(np.arctan2(trace[:, 1], trace[:, 0]))
    assert angle[-1] - angle[0] > 2 * np.pi
    path, traced_s = explore(block, options)
    # what begins in a wall is not felt: the way round the foot went by without a push
    # nor is what a hand does before the loop begins, which may be late by as much as a hand catches up, twice
    late = np.array([path.place(t, np.zeros(3), np.zeros(3)) for t in (0.0, 2 * LONGEST_CATCH_UP_S)])
    outside = np.maximum(np.abs(late[:, :2]) - 0.04, 0.0)
    assert (np.linalg.norm(outside, axis=1) > block.tool.tip_radius_m).all()
    inside = (np.abs(path.waypoints_m[:, :2]) < 0.04 + block.tool.tip_radius_m).all(axis=1)
    inside &= path.waypoints_m[:, 2] < 0.04 + block.tool.tip_radius_m
    presses = path.times_s[inside & (path.times_s > traced_s)]
    assert len(presses) == 5 * 2 * 2  # reached, then held
    again, _ = explore(block, options)
    assert (again.waypoints_m == path.waypoints_m).all()
