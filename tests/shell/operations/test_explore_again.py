"""An exploration goes on in its own file, and says what is kept where it is interrupted."""

from __future__ import annotations

import re
import shlex
from types import SimpleNamespace

import numpy as np
import pytest

from palpate import cli
from palpate.diagnosis.explore.segments import Instrument, Segment, join
from palpate.mechanics.recording.recording import Recording, read_recording, write_recording


def _sweep(kind: str = "trace") -> Segment:
    t = np.arange(600) / 1000
    way = np.column_stack([0.03 * np.cos(6 * t), 0.03 * np.sin(6 * t), np.full(600, 0.005)])
    return Segment(kind, t, way, np.full((600, 3), 0.1))


class _Hand:
    """Makes one sweep, then is interrupted."""

    def __init__(self, *given: object, **more: object) -> None:
        self.instrument, self.last, self.made = Instrument(0.005), None, 0
        self.phantom, self._left = SimpleNamespace(poisson_ratio=0.49), 1

    def carry_out(self, suggestion: object) -> Segment:
        self._left -= 1
        if self._left < 0:
            raise KeyboardInterrupt
        return _sweep()


@pytest.fixture
def swept(monkeypatch, tmp_path):
    """Runs `palpate explore` with such a hand, in a folder of its own."""
    monkeypatch.setattr("palpate.operations.explore.LaboratoryRobot", _Hand)
    monkeypatch.chdir(tmp_path)
    return lambda *words: cli.main(["explore", "--phantom", "dome", "-o", "mine.csv.gz", *words])


def test_what_is_said_to_go_on_does(swept, capsys):
    assert swept() == 130
    said = capsys.readouterr().out
    assert "kept in mine.csv.gz" in said
    (command,) = re.findall(r"go on: palpate (explore .*--continue .*)", said)
    assert cli.main(shlex.split(command)) == 130
    assert "replaced" not in capsys.readouterr().err, "it holds all that it held"
    assert [s.kind for s in read_recording("mine.csv.gz").segments] == ["trace", "trace"]


def test_a_recording_that_is_there_is_said_to_be_replaced(swept, capsys):
    swept()
    assert "is there" not in capsys.readouterr().err
    swept()
    said = capsys.readouterr().err
    assert "mine.csv.gz is there, and is replaced" in said
    assert "`palpate explore --phantom dome --output mine.csv.gz --continue mine.csv.gz`" in said


def test_a_recording_of_other_origin_is_not_replaced_by_what_goes_on_with_it(swept, capsys):
    joined = join(Instrument(0.005), [_sweep()])
    bare = Recording(joined.t, joined.position, joined.force_on_tool, 1000.0, 0.005)
    write_recording("mine.csv.gz", bare, truth={"young_modulus_pa": 12e3})
    before = open("mine.toml").read()
    assert swept("--continue", "mine.csv.gz") == 2
    assert "no exploration's" in capsys.readouterr().err and open("mine.toml").read() == before


def test_where_nothing_was_taken_in_nothing_is_to_be_continued(monkeypatch, capsys, tmp_path):
    def touched(scene, guide, **given):
        servo = SimpleNamespace(
            tip_radius_m=0.005,
            options=SimpleNamespace(rate_hz=1000.0),
            arrays=SimpleNamespace(ring_head=[0]),
        )
        made = SimpleNamespace(material=SimpleNamespace(poisson_ratio=0.49))
        guide(SimpleNamespace(servo=servo, model=made, title="dome", worker=None))

    monkeypatch.setattr("palpate.window.guide.Guide", lambda *given: SimpleNamespace(keep_tracing=int))
    monkeypatch.setattr("palpate.operations.touch.touch", touched)
    monkeypatch.setattr("palpate.show.scenery.no_screen", lambda: "")
    assert cli.main(["explore", "--device", "mouse", "-o", str(tmp_path / "mine.csv.gz")]) == 0
    said = capsys.readouterr().out
    assert "--continue" not in said and "nothing written" in said
