"""Spreadsheets and NumPy arrays hold what a text would."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from palpate.importing.headers import header_of
from palpate.importing.tables import read_tables
from palpate.mechanics.errors import RecordingError
from tests.support.containers import WRITERS, Content

T = np.arange(400) / 100
DEPTH = 0.006 * np.sin(np.pi * T) ** 2 - 0.001
PLACE = np.column_stack([0.01 * np.floor(T), 0 * T, -DEPTH])
FORCE = np.column_stack([0 * T, 0 * T, 400 * np.maximum(DEPTH, 0)])
NAMES = ["t", "x", "y", "z", "fx", "fy", "fz"]
UNITS = ["s", *["mm"] * 3, *["N"] * 3]
CONTENT = Content(NAMES, UNITS, np.column_stack([T, 1e3 * PLACE, FORCE]), ["Probe radius: 4 mm", "day 2"])


@pytest.mark.parametrize("kind", ["xlsx", "ods"])
@pytest.mark.parametrize("form", [0, 1, 2])
def test_a_sheet_with_its_units_in_any_form_is_a_recording(tmp_path, kind, form):
    pytest.importorskip("python_calamine")
    path = tmp_path / f"log.{kind}"
    WRITERS[kind](path, CONTENT, form, False)
    read = pp.read_table(path, tip_radius_m=0.004)
    assert np.allclose(read.position, PLACE, atol=1e-9) and np.allclose(read.force_on_tool, FORCE, atol=1e-9)
    assert header_of(path).radius_m == pytest.approx(0.004)


def test_a_sheet_without_numbers_is_one_line(tmp_path):
    pytest.importorskip("python_calamine")
    WRITERS["xlsx"](tmp_path / "words.xlsx", Content(["a", "b"], None, np.zeros((0, 2)), ["words"]), 0, False)
    with pytest.raises(RecordingError, match="holds no columns of numbers") as refused:
        read_tables(tmp_path / "words.xlsx")
    assert len(str(refused.value).splitlines()) == 1
    (tmp_path / "torn.xlsx").write_bytes(b"PK\x03\x04 torn")
    with pytest.raises(RecordingError, match="cannot be read as xlsx"):
        read_tables(tmp_path / "torn.xlsx")


@pytest.mark.parametrize("plain", [False, True])
def test_an_array_has_its_fields_names_or_numbers(tmp_path, plain):
    WRITERS["npy"](tmp_path / "log.npy", CONTENT, 0, plain)
    said = {}
    if plain:
        with pytest.raises(RecordingError, match="--column x=NAME"):
            pp.read_table(tmp_path / "log.npy", tip_radius_m=0.004)
        said = {
            "columns": {name: f"#{k + 1}" for k, name in enumerate(NAMES)},
            "units": {"position": "mm", "force": "N", "time": "s"},
        }
    read = pp.read_table(tmp_path / "log.npy", tip_radius_m=0.004, **said)
    assert np.allclose(read.position, PLACE, atol=1e-9) and np.allclose(read.force_on_tool, FORCE, atol=1e-9)


def test_columns_of_one_structure_are_known_by_their_own_names(tmp_path):
    WRITERS["mat"](tmp_path / "log.mat", CONTENT, 0, False)
    assert np.allclose(pp.read_table(tmp_path / "log.mat", tip_radius_m=0.004).position, PLACE, atol=1e-9)
