"""MODEL folders and scenes that are damaged, absurd or foreign are refused in one line."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.effects.registry import NAMES, effect_keys
from palpate.mechanics.errors import ModelError, PalpateError, SceneError
from palpate.mechanics.model.files import read_model
from palpate.mechanics.model.material import Ball
from palpate.scenes.scene import load_scene

from .inputs import block, one_line

MODELS = {
    "a modulus of 1e-30": ("young_modulus_pa = 20000.0", "young_modulus_pa = 1e-30", "from 1 to 1e.09 Pa"),
    "a modulus of inf": ("young_modulus_pa = 20000.0", "young_modulus_pa = inf", "young_modulus_pa = inf"),
    "an interval of one": ("[19000.0, 21000.0]", "[19000.0]", "list of 2 numbers"),
    "an interval of words": ("[19000.0, 21000.0]", "['a', 'b']", "list of 2 numbers"),
    "a skin of 1e30": ("modulus_ratio = 3.0", "modulus_ratio = 1e30", "modulus_ratio = 1e.30"),
    "a tip of 1e30": ("tip_radius_m = 0.005", "tip_radius_m = 1e30", "from 0.0001 to 0.04 m"),
    "stiffening of nan": ("c20_over_c10 = 0.35", "c20_over_c10 = nan", "c20_over_c10 = nan"),
    "stiffening without its key": ("c20_over_c10 = 0.35", "", "c20_over_c10 is missing"),
    "friction without its key": ("mu = 0.3", "", "mu is missing"),
    "friction of a word": ("mu = 0.3", "mu = 'rough'", "mu = 'rough'"),
    "friction below 0": ("mu = 0.3", "mu = -1", "mu = -1"),
    "a misspelt key of friction": ("mu = 0.3", "nu = 0.3", "mu is missing"),
    "springs without a key": ("k_normal_pa_per_m = 10000000.0", "", "k_normal_pa_per_m is missing"),
    "springs of a list": ("k_normal_pa_per_m = 10000000.0", "k_normal_pa_per_m = [1]", "k_normal_pa_per_m"),
    "a base without direction": ("direction = [1.0, 0.0, 0.0]", "", "direction is missing"),
    "a direction of two": ("direction = [1.0, 0.0, 0.0]", "direction = [1.0, 0.0]", "list of 3 numbers"),
    "a bonded share of 2": ("bonded_fraction = 0.5", "bonded_fraction = 2", "from 0.001 to 1"),
    "memory of a number": ("g = [0.3]", "g = 0.3", "a list of numbers"),
    "an effect that is a number": (
        "[effects.friction_slip]\nmu = 0.3",
        "[effects]\nfriction_slip = 3",
        "must be a table",
    ),
    "a misspelt effect": (
        "[effects.friction_slip]",
        "[effects.friction_slipp]",
        "did you mean friction_slip",
    ),
    "a ball without radius": ("radius_m = 0.01", "", "radius_m is missing"),
    "a ball at nan": ("centre_m = [0.0, 0.0, 0.015]", "centre_m = [nan, 0.0, 0.0]", "centre_m"),
    "a ball that is a number": ("[material.inclusions.lump]", "[material.inclusions]\nlump = 3\n[x]", "lump"),
    "no frame": ("[frame]", "[fame]", "lacks .frame."),
    "no mesh size": ("mesh_size_m = 0.02", "", "mesh_size_m is missing"),
    "a future format": ("format = 3", "format = 4", "this program reads 3"),
}


@pytest.mark.parametrize("name", MODELS)
def test_hostile_models_are_refused_in_one_line(folder, name):
    old, new, words = MODELS[name]
    file = folder / "model.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(ModelError, match=words) as error:
        read_model(folder)
    one_line(error, folder)


def test_a_model_cut_off_anywhere_is_refused(folder):
    file = folder / "model.toml"
    whole = file.read_bytes()
    assert read_model(folder).effects["friction_slip"] == {"mu": 0.3}
    tables = [i for i in range(1, len(whole) - 1) if whole[i : i + 1] in (b"[", b"\n")]
    for length in sorted({*tables, *range(0, len(whole) - 1, 23)}):
        file.write_bytes(whole[:length])
        with pytest.raises(ModelError):
            read_model(folder)


def test_a_damaged_mesh_is_refused_in_one_line(folder, capfd):
    whole = (folder / "mesh.vtu").read_bytes()
    for data in (
        b"",
        b"no mesh",
        whole[: len(whole) // 2],
        whole.replace(b"fixed", b"fluid"),
        whole.replace(b"AQAAAACA", b"/////wCA", 1),  # VTK makes room for 2^32 blocks, and ends the process
        whole.replace(b'"Points"', b'"Points>', 1),
        whole.replace(b'NumberOfPoints="', b'NumberOfPoints="9', 1),
    ):
        assert data != whole
        (folder / "mesh.vtu").write_bytes(data)
        with pytest.raises(ModelError) as error:
            read_model(folder)
        one_line(error, folder)
    assert capfd.readouterr() == ("", ""), "what VTK says beside is not said"


def test_every_effect_says_which_keys_a_model_may_hold():
    assert list(effect_keys()) == list(NAMES)
    assert [name for name, keys in effect_keys().items() if keys is None] == []


SCENES = {
    "a misspelt key": ("[object]\nphantom = 'block'\nyoung_modulus = 1e4", "did you mean young_modulus_pa"),
    "a table that is a number": ("object = 3", "object. is 3"),
    "no object": ("title = 'x'", "exactly one of"),
    "an inclusion at nan": (
        "[object]\nphantom = 'block'\n[[inclusion]]\ncentre_m = [nan, 0.0, 0.0]\n"
        "radius_m = 0.01\nmodulus_ratio = 2.0",
        "centre_m",
    ),
    "an inclusion that is no list": ("[object]\nphantom = 'block'\n[inclusion]\na = 1", "list of tables"),
    "an inclusion of negative size": (
        "[object]\nphantom = 'block'\n[[inclusion]]\ncentre_m = [0.0, 0.0, 0.0]\n"
        "radius_m = -0.01\nmodulus_ratio = 2.0",
        "radius_m",
    ),
    "left-handed axes": ("[object]\nphantom = 'block'\n[device]\naxes = 'x,y,-z'", "left-handed"),
    "axes of a number": ("[object]\nphantom = 'block'\n[device]\naxes = 3", "axes = 3"),
    "a scale of 0": ("[object]\nphantom = 'block'\n[device]\nmotion_scale = 0", "motion_scale = 0"),
    "a scale of nan": ("[object]\nphantom = 'block'\n[device]\nmotion_scale = nan", "motion_scale = nan"),
    "a negative force": ("[object]\nphantom = 'block'\n[device]\nforce_scale = -1", "force_scale = -1"),
    "an infinite force": ("[object]\nphantom = 'block'\n[device]\nforce_scale = inf", "force_scale = inf"),
    "a mesh of 1e-9": ("[object]\nphantom = 'block'\nmesh_size_m = 1e-9", "mesh_size_m"),
    "a colour of ones own": ("[object]\nphantom = 'block'\n[render]\ncolour = 'pink'", "one of displacement"),
    "a path that leaves": ("[object]\nmodel = '/etc'", "outside its folder"),
    "a path up": ("[object]\nphantom = '../../x.stl'", "outside its folder"),
}


@pytest.mark.parametrize("name", SCENES)
def test_hostile_scenes_are_refused_in_one_line(tmp_path, name):
    text, words = SCENES[name]
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(SceneError, match=words) as error:
        load_scene(path)
    one_line(error, path)


def test_an_inclusion_beside_the_object_is_refused():
    from palpate.scenes.build import _check_inside

    _check_inside(block())
    far = dataclasses.replace(block().material, inclusions={"lump": Ball((9, 0, 0), 0.01, 6.0)})
    with pytest.raises(SceneError, match="lies outside the object") as error:
        _check_inside(dataclasses.replace(block(), material=far))
    one_line(error)


def test_a_press_deeper_than_the_object_or_without_end_is_refused(monkeypatch):
    from palpate.render.press import Stroke, press

    class Scene:
        model = block()

    monkeypatch.setattr("palpate.render.press.scene_of", lambda touched: touched)
    up = np.array([0.0, 0.0, 1.0])
    monkeypatch.setattr("palpate.render.press.first_touch", lambda *_: (0.035 * up, up, False))
    for words, stroke, radius in (
        ("the object is 0.03 m high", Stroke(4.0, 0.01), None),
        ("tip's radius is 1e.30", Stroke(1e-3, 0.01), 1e30),
        ("would last", Stroke(1e-3, 1e-12), None),
        ("would last", Stroke(1e-3, 0.01, hold_s=1e9), None),
    ):
        with pytest.raises(PalpateError, match=words):
            press(Scene(), np.zeros(3), -up, stroke, radius)


def test_an_object_that_would_take_millions_of_tetrahedra_is_refused():
    from palpate.mechanics.errors import MeshError
    from palpate.reconstruction.steps.s5_mesh.tetwild import check_count

    mesh = block().mesh
    check_count(mesh.points, mesh.surface[:, :3], 0.005)
    with pytest.raises(MeshError, match="check that the positions are in metres") as error:
        check_count(10 * mesh.points, mesh.surface[:, :3], 0.005)
    one_line(error)


def test_a_mesh_that_takes_too_much_memory_is_made_coarser_and_that_is_said():
    """Of the object's volume and size; the edge that is taken is as small as is allowed."""
    from palpate.reconstruction.steps.s5_mesh.tetwild import AFFORDABLE, affordable, tetrahedra

    mesh = block().mesh
    points, faces = mesh.points * 0.25 / np.ptp(mesh.points[:, 0]), mesh.surface[:, :3]
    edge = affordable(points, faces, 0.004)
    assert edge > 0.004 and tetrahedra(points, faces, edge) == pytest.approx(AFFORDABLE)
    assert affordable(points, faces, edge * 1.1) == edge * 1.1


def test_a_mesher_is_stopped_by_its_work_or_where_it_stands_still(tmp_path, monkeypatch):
    from palpate.reconstruction.steps.s5_mesh import tetwild

    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    np.savez(tmp_path / "surface.npz", vertices=np.zeros((1, 3)), triangles=np.zeros((1, 3), dtype=int))
    loop = "def tetrahedralize(*a, **k):\n    while True: pass"
    (tmp_path / "pytetwild.py").write_text(loop)
    assert tetwild._ended(tmp_path, 1.0) is None
    (tmp_path / "pytetwild.py").write_text("import time\ntime.sleep(3600)")
    monkeypatch.setattr(tetwild, "_STILL_S", 2.0)
    assert tetwild._ended(tmp_path, 1e4) is None
    (tmp_path / "pytetwild.py").write_text("raise SystemExit(3)")
    assert tetwild._ended(tmp_path, 60.0) == 3


def test_a_damaged_mesh_of_the_laboratory_is_not_taken(tmp_path):
    from palpate.scenes.laboratory.mesh import _kept

    mesh = block().mesh
    path = tmp_path / "mesh.npz"
    np.savez(path, points=mesh.points, tetrahedra=mesh.tetrahedra[:, :4])
    whole = path.read_bytes()
    assert len(_kept(path)[0]) == len(mesh.points)
    for data in (b"", whole[:100], whole[: len(whole) // 2], b"PK" + whole[2:40]):
        path.write_bytes(data)
        assert _kept(path) is None
    np.savez(path, points=mesh.points, tetrahedra=mesh.tetrahedra[:, :4] + 10_000)
    assert _kept(path) is None
