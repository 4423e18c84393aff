"""A new table format is one file and its line in the registry."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import palpate as pp
from palpate import cli
from palpate.importing.formats.registry import FORMATS, TableFormat
from palpate.importing.tables import Table
from palpate.mechanics.errors import RecordingError

from .test_import import TIP, check, exploration

NAMES = ("t", "x", "y", "z", "fx", "fy", "fz")


def _module() -> ModuleType:
    """What `shell/importing/formats/lists.py` would hold: a JSON object of lists of numbers."""
    module = ModuleType("palpate.importing.formats.lists")

    def read(path: Path) -> list[Table]:
        held = json.loads(path.read_text())
        return [Table(path.name, {name: np.array(values) for name, values in held.items()})]

    module.read = read
    return module


def test_a_table_format_is_added_in_one_file_and_one_line(tmp_path, monkeypatch: pytest.MonkeyPatch):
    world = exploration()
    columns = (world["t"], *world["p"].T, *world["f"].T)
    log = tmp_path / "log.lists"
    log.write_text(json.dumps({name: values.tolist() for name, values in zip(NAMES, columns, strict=True)}))
    words = ["import", str(log), "--tip-radius", str(TIP), "-o", str(tmp_path / "rec.csv")]
    with pytest.raises(RecordingError, match="of no kind that can be read: allowed are csv, "):
        pp.read_table(log, tip_radius_m=TIP)
    monkeypatch.setitem(sys.modules, "palpate.importing.formats.lists", _module())
    monkeypatch.setitem(FORMATS, "lists", TableFormat("palpate.importing.formats.lists", (".lists",)))
    assert cli.main(words) == 0
    check(pp.read_recording(tmp_path / "rec.csv"), world)
