"""Schemas of `--json` and TOML. That commands keep to them is asserted wherever a test runs one
(`tests.support.schemas.check_every_json`); here: that they are whole, and agree with the readers."""

from __future__ import annotations

import json
import math
import tomllib

import pytest

from palpate.cli import main
from palpate.mechanics.disk.schema import check_table
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.model.files import MODEL
from palpate.operations._list import commands
from palpate.operations._run import command_operation
from palpate.scenes.embedded import embedded_names, embedded_recording
from palpate.scenes.scene import FOLDER, scene_names
from palpate.schemas import TOMLS, _keys, identity, names, schema

from ..conftest import REPOSITORY
from ..support.schemas import faults, validator


def test_every_command_with_json_has_a_schema():
    speaking = {name for name in commands() if command_operation(name)[0].has_json}
    assert speaking == set(names()) - set(TOMLS)


@pytest.mark.parametrize("name", names())
def test_a_schema_is_one_and_says_its_version(name):
    found = schema(name)
    assert validator(name) and found["$id"] == identity(name)
    json.dumps(found, allow_nan=False)


def test_an_answer_says_its_schema_and_keeps_to_it(tmp_path, capsys):
    assert main(["devices", "replay", "--json", str(tmp_path / "devices.json")]) == 0
    written = json.loads((tmp_path / "devices.json").read_text())
    assert written["schema"] == identity("devices") and not faults("devices", written)
    written["devices"][0]["rate_hz"] = "fast"
    assert faults("devices", written)
    assert faults("devices", {"schema": identity("devices")})
    assert faults("devices", {**written, "devices": [], "colour": "red"})


def test_the_files_that_are_shipped_keep_to_their_schemas(block_folder):
    for name in scene_names():
        assert not faults("scene.toml", tomllib.loads((FOLDER / f"{name}.toml").read_text()))
    for name in embedded_names():
        text = embedded_recording(name).with_suffix("").with_suffix(".toml").read_text()
        assert not faults("recording.toml", tomllib.loads(text))
    assert not faults("model.toml", tomllib.loads((block_folder / MODEL.marker).read_text()))


def test_the_evidence_is_of_one_form():
    for path in (REPOSITORY / "docs" / "evidence").glob("*.json"):
        assert set(json.loads(path.read_text())) == {"command", "commit", "date", "processor", "figures"}


_WRONG = [
    {"recording": {"force_on": "hand"}, "tool": {"tip_radius_m": 0.004}},
    {"recording": {"force_on": "tool"}, "tool": {"tip_radius_m": 4}},
    {"recording": {"force_on": "tool"}, "tool": {}},
    {"recording": {"force_on": "tool", "boundary_phase": [1.0]}, "tool": {"tip_radius_m": 0.004}},
    {"recording": {"force_on": "tool"}, "tool": {"tip_radius_m": 0.004}, "segment": [{"kind": "nap"}]},
]


@pytest.mark.parametrize("table", _WRONG)
def test_what_the_reader_refuses_the_schema_refuses(table):
    with pytest.raises(PalpateError):
        check_table(table, _keys("recording.toml"), "x.toml", PalpateError, strict=False)
    assert list(validator("recording.toml", strict=False).iter_errors(table))


def test_an_unknown_end_of_an_interval_is_allowed_as_the_reader_allows_it(block_folder):
    table = tomllib.loads((block_folder / MODEL.marker).read_text())
    table["material"]["young_modulus_ci95_pa"] = [math.nan, math.inf]
    assert not faults("model.toml", table)
