"""Every wait says its stage and what is left of it, on standard error alone."""

from __future__ import annotations

import io
import json
import sys
import time

import numpy as np
import pytest

from mechanics.progress import Remaining
from palpate import output
from palpate.output import Output, progress_bar
from palpate.tasks.engine import run_with_bar
from palpate.tasks.graph import Graph

LONG_S = 30.0
"""No test waits so long: until then a line must have come."""


class Terminal(io.StringIO):
    """Standard error that says it is one."""

    def isatty(self) -> bool:
        return True


def until(said, wanted: str) -> str:
    """What was said, once the words are there."""
    end = time.monotonic() + LONG_S
    while wanted not in (text := said()) and time.monotonic() < end:
        time.sleep(0.01)
    return text


@pytest.mark.parametrize(
    ("done", "after_s", "words"),
    [
        (0.5, 60.0, "about 60 s left"),
        (0.1, 60.0, "about 9 min left"),
        (0.01, 360.0, "about 9.9 h left"),
        (0.99, 60.0, "some seconds left"),
        (0.0, 60.0, ""),
    ],
)
def test_what_is_left_goes_by_the_pace_so_far(done, after_s, words):
    now = iter([100.0, *[100.0 + after_s] * 9])
    left = Remaining(lambda: next(now))
    left.tell(0.0)
    left.tell(done)
    assert left.words() == words


def test_what_was_done_before_does_not_count():
    """A wait that begins at 60 %, since a model is there already, is no quick one."""
    now = iter([0.0, *[30.0] * 9])
    left = Remaining(lambda: next(now))
    left.tell(0.6)
    left.tell(0.7)
    assert left.words() == "about 2 min left"


def test_without_a_terminal_there_is_a_line_now_and_then(monkeypatch, capfd):
    monkeypatch.setattr(output, "EVERY_S", 0.05)
    monkeypatch.setattr(output, "_SHORT_S", 0.0)
    said = []

    def error() -> str:
        said.append(capfd.readouterr())
        return "".join(each.err for each in said)

    with progress_bar("compare") as tell:
        tell("fold 2 of 8", 0.25)
        text = until(error, "left")
    assert "compare: fold 2 of 8, 25 %, after 0 s, " in text and "left\n" in text
    assert "\r" not in text and not "".join(each.out for each in said)


def test_a_short_wait_says_nothing_without_a_terminal(capfd):
    with progress_bar("compare") as tell:
        tell("fold 1 of 8", 0.5)
    assert capfd.readouterr() == ("", "")


def test_a_terminal_shows_stage_share_and_what_is_left(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(output, "_SHORT_S", 0.0)
    monkeypatch.setattr(output, "_REDRAWN_S", 0.05)
    monkeypatch.setenv("COLUMNS", "120")
    with progress_bar("diagnose") as tell:
        tell("effect 1: friction_slip", 0.5)
        text = until(terminal.getvalue, "left")
    assert "50%" in text and "diagnose: effect 1: friction_slip" in text and "left" in text


def test_json_stays_alone_on_standard_output(monkeypatch, capfd):
    monkeypatch.setattr(output, "EVERY_S", 0.02)
    with progress_bar("material") as tell:
        tell("curves", 0.1)
        text = until(lambda: capfd.readouterr().err, "material: curves")
        Output("-").json({"modulus_pa": np.float64(1.0)})
    assert "material: curves, 10 %" in text
    assert json.loads(capfd.readouterr().out) == {"modulus_pa": 1.0}


def test_a_batch_says_what_is_left_by_the_same_display(monkeypatch, tmp_path):
    shown: list[tuple[str, bool]] = []

    class Seen(output.Bar):
        def __init__(self, label: str, left: bool = True) -> None:
            shown.append((label, left))
            super().__init__(label, left)

    monkeypatch.setattr(output, "Bar", Seen)
    run_with_bar(Graph(()), tmp_path, workers=1)
    assert shown == [("", False)]
