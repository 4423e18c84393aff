"""`palpate open`: says what it took a file for, does the one sensible thing, writes one page."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

import palpate as pp
from palpate import cli
from tests.shell.importing.test_meaning import MODULUS, press, write


def curve(folder):
    t, depth, force = press()
    return write(folder / "dent.csv", [t, 12 - 1e3 * depth, -force], "Time (s),Height (mm),Load (N)")


def log(folder):
    t = np.arange(2000) / 200
    depth = 0.006 * np.sin(np.pi * t) ** 2 - 0.001
    position = np.column_stack([0.01 * np.floor(t), 0 * t, -depth])
    force = np.column_stack([0 * t, 0 * t, 400 * np.maximum(depth, 0)])
    force += 0.01 * np.random.default_rng(0).standard_normal(force.shape)
    return write(folder / "log.csv", [t, position, force], "t_s,x_m,y_m,z_m,fx_N,fy_N,fz_N")


def test_a_machines_curve_becomes_a_material_and_a_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["open", str(curve(tmp_path)), "--tip-radius", "0.003", "--json", "out.json"]) == 0
    said = capsys.readouterr().out
    assert "dent.csv" in said and "odds" in said
    held = json.loads((tmp_path / "out.json").read_text())
    assert set(held) == {"schema", "kind", "understood", "odds", "result"} and held["kind"] == "curves"
    assert held["odds"] >= 9 and held["result"]["young_modulus_pa"] == pytest.approx(MODULUS, rel=0.1)
    page = (tmp_path / "dent-palpate.html").read_text()
    assert page.rstrip().endswith("</html>")


def test_a_curve_of_palpate_press_is_a_curve_whichever_way_it_went(tmp_path, curves):
    """Of a block of 30 kPa, which is a little softer than a half-space of it, on a tip of 5 mm."""
    turn = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    for name, way in (("down", np.eye(3)), ("aside", turn)):
        pressed = dataclasses.replace(
            curves[0], position=curves[0].position @ way, force=curves[0].force @ way
        )
        made = pp.open(pressed.save(tmp_path / f"{name}.csv"), tip_radius_m=0.005, progress=False)
        assert made.kind == "curves" and made.result.young_modulus_pa == pytest.approx(30e3, rel=0.3)


def test_a_robots_log_is_checked_and_what_is_grave_ends_with_1(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["open", str(log(tmp_path)), "--tip-radius", "0.004"]) == 1
    said = capsys.readouterr().out
    assert "GRAVE" in said


def test_a_surface_and_a_model_are_opened(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((40, 40, 20)).export(tmp_path / "box.stl")
    given = {"unit": "mm", "young_modulus_pa": 3e4, "progress": False}
    made = pp.open(tmp_path / "box.stl", save=tmp_path / "box", **given)
    assert made.kind == "mesh" and made.result.material.young_modulus_pa == 3e4
    again = pp.open(tmp_path / "box", progress=False)
    assert again.kind == "model" and again.result.material.young_modulus_pa == pytest.approx(3e4)


def test_without_a_terminal_what_is_open_is_one_line(tmp_path, capsys):
    assert cli.main(["open", str(curve(tmp_path))]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and "--tip-radius" in said[0]


def test_an_embedded_recording_is_opened_by_its_name(capsys):
    """Every other command knew the name; this one said that no such file is there."""
    assert cli.main(["open", "silicone-1-cylinder", "--tip", "cone", "--tip-angle", "30"]) == 2
    said = capsys.readouterr().err
    assert "does not exist" not in said and "cone" in said


def test_other_commands_point_to_it(tmp_path, capsys):
    file = log(tmp_path)
    assert cli.main(["reconstruct", str(file), "-o", str(tmp_path / "model")]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1 and f"palpate open {file}" in said[0] and "palpate import" in said[0]


def test_the_builtin_is_left_alone():
    import builtins

    import palpate.operations.open_ as home

    assert home.open is pp.open is not builtins.open
