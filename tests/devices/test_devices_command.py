"""`palpate devices`: what a person reads, what a program reads, and every driver's options as flags."""

from __future__ import annotations

import dataclasses
import json

import pytest

from palpate.cli import main
from palpate.devices.haply import HaplyOptions
from palpate.devices.registry import DEVICES, options_of
from palpate.operations._run import command_operation, parser_of

from .fake_inverse import FakeInverse


@pytest.fixture
def uri() -> str:
    service = FakeInverse()
    yield f"ws://localhost:{service.ports[0]}"
    service.stop()


def test_lists_what_is_there_and_why_not(uri: str, capsys: pytest.CaptureFixture) -> None:
    assert main(["devices", "simulated", "haply", "--haply-uri", "ws://localhost:9"]) == 0
    there, absent = capsys.readouterr().out.split("not there:")
    assert "simulated" in there and "force to 20 N" in there
    assert "ws://localhost:9" in absent and "palpate touch --device simulated" in absent
    assert main(["devices", "haply", "--haply-uri", uri]) == 0
    printed = capsys.readouterr().out
    assert "not there" not in printed and "049D" in printed


def test_measures_the_rate_of_what_is_there(uri: str, capsys: pytest.CaptureFixture) -> None:
    words = ["devices", "haply", "simulated", "--haply-uri", uri, "--haply-answer", "2", "--measure", "1.5"]
    assert main([*words, "--json", "-"]) == 0
    haply, simulated = json.loads(capsys.readouterr().out)["devices"]
    assert haply["measured_hz"] > 0 and haply["measured_jitter_s"] > 0
    assert simulated["measured_hz"] is None
    assert main(["devices", "--measure", "0.1"]) == 2
    assert "at least 1 s" in capsys.readouterr().err


def test_an_unknown_device_is_refused(capsys: pytest.CaptureFixture) -> None:
    assert main(["devices", "dataglove"]) == 2
    said = capsys.readouterr().err
    assert "allowed are" in said and all(name in said for name in ("mouse", "replay"))


def test_every_option_of_every_driver_is_a_flag_of_its_own() -> None:
    parser = parser_of("touch")
    names = [action.dest for action in parser._actions]
    assert len(names) == len(set(names)), "two options would overwrite each other"
    for device in DEVICES:
        assert {field.name for field in dataclasses.fields(options_of(device))} <= set(names)
    given = parser.parse_args(["block", "--haply-uri", "ws://elsewhere:1", "--ffb-full-scale", "4"])
    arriving = command_operation("touch")[0].arriving(vars(given))["devices"]
    assert arriving["haply"] == HaplyOptions(uri="ws://elsewhere:1")
    assert arriving["pid-ffb"].full_scale_n == 4.0
