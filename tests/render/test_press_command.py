"""`palpate press` and the pytest fixture, as somebody uses them who tests a model of their own."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from palpate.cli import main
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.files import read_model, write_model
from palpate.render.press import read_curve
from palpate.testing import press_model  # noqa: F401  (pytest finds the fixture by its name)

DOWN = ["--at", "0,0,0.03", "--direction", "0,0,-1", "--depth", "0.003", "--speed", "0.02"]


@pytest.fixture
def model_folder(block_folder):
    return str(block_folder)


def test_a_curve_that_was_stored_is_met_again_and_another_law_is_told(model_folder, tmp_path, capsys):
    stored, result = str(tmp_path / "top.csv"), tmp_path / "result.json"
    assert main(["press", model_folder, *DOWN, "-o", stored]) == 0
    assert main(["press", model_folder, *DOWN, "--expect", stored, "--tolerance", "1e-6"]) == 0
    said = capsys.readouterr().out
    assert "agrees" in said and "next: feel it: palpate touch" in said
    other = [*DOWN, "--dent-law", "hertz", "--expect", stored, "--tolerance", "0.01", "--json", str(result)]
    assert main(["press", model_folder, *other]) == 1
    found = json.loads(result.read_text())
    assert found["passed"] is False and found["difference_n"] > 0.01
    assert found["depth_m"] == pytest.approx(0.003, abs=1e-6)


def test_what_was_mended_in_a_file_is_said_where_it_is_pressed(model_folder, tmp_path, capsys):
    model = read_model(Path(model_folder))
    mended = replace(model, provenance={**model.provenance, "mended": "it crosses itself"}, path=None)
    write_model(tmp_path / "mended", mended)
    assert main(["press", str(tmp_path / "mended"), *DOWN]) == 0
    assert "the file's surface was mended: it crosses itself" in capsys.readouterr().out


def test_a_softer_object_and_another_press_do_not_pass_unasked(model_folder, tmp_path):
    """However small the forces: what is allowed goes with the stored curve's own."""
    stored, result = str(tmp_path / "top.csv"), tmp_path / "result.json"
    soft = ["--modulus", "500"]
    assert main(["press", model_folder, *DOWN, *soft, "-o", stored]) == 0
    assert read_curve(stored).peak_force_n < 0.02
    assert main(["press", model_folder, *DOWN, *soft, "--expect", stored]) == 0
    again = [*DOWN, "--modulus", "550", "--expect", stored]
    assert main(["press", model_folder, *again, "--json", str(result)]) == 1
    told = json.loads(result.read_text())
    assert told["same_path"] and told["tolerance_n"] < told["difference_n"]
    assert main(["press", model_folder, *again, "--tolerance", "0.02"]) == 0
    for other in (
        ["--at", "0.002,0,0.03"], ["--depth", "0.0028"], ["--speed", "0.03"], ["--hold", "0.01"],
        ["--direction", "0.05,0,-1"],
    ):  # fmt: skip
        pressed = ["press", model_folder, *DOWN, *soft, *other, "--expect", stored, "--tolerance", "1"]
        assert main([*pressed, "--json", str(result)]) == 1, other
        assert json.loads(result.read_text())["same_path"] is False


def test_a_suggested_command_takes_a_path_with_a_space(model_folder, tmp_path, capsys):
    import shlex

    stored = str(tmp_path / "my curve.csv")
    assert main(["press", model_folder, *DOWN, "-o", stored]) == 0
    line = next(each for each in capsys.readouterr().out.splitlines() if "--expect" in each)
    assert stored in shlex.split(line)


def test_a_point_in_millimetres_is_asked_back(model_folder, capsys):
    assert main(["press", model_folder, "--at", "10,5,30", "--direction", "1,0,0"]) == 2
    assert "--at 0.01,0.005,0.03" in capsys.readouterr().err


def test_a_direction_away_from_the_object_is_answered_with_the_other_way(model_folder, capsys):
    assert main(["press", model_folder, "--at", "0,0,0.03", "--direction", "0,0,1"]) == 2
    assert "--direction=0,0,-1" in capsys.readouterr().err


def test_beside_the_object_a_place_on_it_is_named_that_can_be_pressed(model_folder, capsys):
    """The corner of its box was named, which may lie beside it."""
    assert main(["press", model_folder, *BESIDE]) == 1
    there = capsys.readouterr().out.split("`--at=")[1].split("`")[0]
    assert main(["press", model_folder, f"--at={there}", *BESIDE[2:]]) == 0


def test_a_modulus_in_kilopascals_is_asked_back_and_no_small_number_is_lost(model_folder, capsys):
    assert main(["press", model_folder, *DOWN, "--modulus", "5"]) == 0
    told = capsys.readouterr()
    said = told.out.splitlines()
    assert "kPa?" in told.err and "--modulus 5000" in told.err
    force = float(said[0].rsplit("(", 1)[1].split(")")[0].split(",")[2])
    assert force == pytest.approx(float(said[0].split(": ")[1].split()[0]), rel=0.02)
    assert "modulus is 5 Pa" in said[1]


BESIDE = ["--at", "0.05,0,0.03", "--direction", "0,0,-1", "--depth", "0.003"]  # the block ends at 0.03


def test_a_press_of_the_support_is_not_given_out_as_the_objects(model_folder, tmp_path, capsys):
    result = tmp_path / "result.json"
    assert main(["press", model_folder, *BESIDE, "--json", str(result)]) == 1
    assert "support" in capsys.readouterr().out.split(":")[0]
    told = json.loads(result.read_text())
    assert told["on_support"] and "force_error_n" not in told  # the law's bound is of the object
    assert main(["press", model_folder, *DOWN, "--json", str(result)]) == 0
    assert json.loads(result.read_text())["on_support"] is False
    # a table beside a scene's object is part of the scene: a warning
    scene = tmp_path / "scene.toml"
    shutil.copytree(model_folder, tmp_path / "block")
    capsys.readouterr()
    scene.write_text('title = "a block"\n[object]\nmodel = "block"\n')
    assert main(["press", str(scene), *BESIDE]) == 0
    assert "support" in capsys.readouterr().out.split(":")[0]


def test_without_a_point_the_object_is_met_wherever_it_lies(model_folder, tmp_path):
    from dataclasses import replace

    from palpate.mechanics.model.files import read_model
    from palpate.render.press import Stroke
    from palpate.render.press import press as pressed
    from palpate.render.registry import create

    result = tmp_path / "result.json"
    assert main(["press", model_folder, "--depth", "0.003", "--json", str(result)]) == 0
    there = json.loads(result.read_text())["force_at_depth_n"]
    model, shift = read_model(model_folder), np.array([0.3, -0.2, 0.1])
    mesh = replace(model.mesh, points=model.mesh.points + shift, shape=None)
    support = replace(model.support, point=model.support.point + shift)
    moved = create("fem", replace(model, mesh=mesh, support=support, path=None))
    curve = pressed(moved, None, np.array([0.0, 0.0, -1.0]), Stroke(0.003, 0.01))
    assert not curve.on_support
    assert curve.force_at(0.003) == pytest.approx(there, rel=0.01, abs=1e-3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([*DOWN, "--expect", "nowhere.csv"], "nowhere.csv"),
        (["--at", "0,0,0.03", "--direction", "0,0,-1", "--depth", "-0.003"], "depth is -0.003"),
        (["--at", "1,0,0.03", "--direction", "0,0,-1", "--depth", "0.003"], "does not meet"),
    ],
)
def test_what_cannot_be_pressed_is_told_in_a_line(model_folder, capsys, arguments, words):
    assert main(["press", model_folder, *arguments]) == 2
    line = capsys.readouterr().err.strip()
    assert words in line and "\n" not in line


def test_the_fixture_presses_like_the_command(model_folder, tmp_path, press_model):  # noqa: F811
    assert main(["press", model_folder, *DOWN, "-o", str(tmp_path / "top.csv")]) == 0
    there = {"at": (0, 0, 0.03), "direction": (0, 0, -1)}
    curve = press_model(model_folder, **there, depth_m=0.003, speed_m_per_s=0.02)
    expected = read_curve(tmp_path / "top.csv")
    for depth in (0.001, 0.00137, 0.004):  # the turn need not be a sample, nor rounding kind
        assert press_model(model_folder, **there, depth_m=depth).force_at(depth)[2] > 0
    with pytest.raises(OptionError, match="not on the curve"):
        curve.force_at(0.0031)
    assert curve.force_at(0.003) == pytest.approx(expected.force_at(0.003), abs=1e-8)
    assert curve.force_at(0.003)[2] > 0.3


@pytest.mark.slow
def test_a_file_of_a_surface_is_felt_again_by_the_command_that_a_press_names(tmp_path, capsys):
    """What was said of the file goes on, and only what was not said is told."""
    import shlex

    import pyvista as pv

    from palpate.operations._run import parser_of

    file = str(tmp_path / "organ.stl")
    pv.Cube(bounds=(120.0, 160.0, -95.0, -55.0, 200.0, 230.0)).triangulate().rotate_z(35).save(file)
    said = ["--unit", "mm", "--modulus", "12000"]
    assert main(["press", file, *said, "--depth", "0.002"]) == 0
    told = capsys.readouterr().out
    words = shlex.split(next(line for line in told.splitlines() if "feel it: " in line).split("feel it: ")[1])
    typed = parser_of("touch").parse_args(words[2:])
    assert vars(typed)["young_modulus_pa"] == ["12000"] and vars(typed)["unit"] == "mm"
    assert "20000" not in told


@pytest.mark.parametrize("typed", [["12000"], ["core=60000", "shell=9000"]])
def test_moduli_are_typed_again_as_they_came(typed):
    from palpate.operations._written import typed as command

    words = command("touch", {"scene": "organ.stl", "young_modulus_pa": typed}).split()
    assert words == ["palpate", "touch", "organ.stl", *(w for each in typed for w in ("--modulus", each))]
