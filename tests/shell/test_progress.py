"""Every wait says its stage and what is left of it, on standard error alone."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import time

import pytest

from palpate import output
from palpate.mechanics.progress import Remaining
from palpate.output import progress_bar
from palpate.parallel.run import run_with_bar

from ..support.waiting import eventually


class Terminal(io.StringIO):
    """Standard error that says it is one."""

    def isatty(self) -> bool:
        return True


def until(said, wanted: str) -> str:
    """What was said, once the words are there."""
    eventually(lambda: wanted in said())
    return said()


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


def test_a_short_wait_without_a_terminal_says_nothing(capfd, monkeypatch):
    monkeypatch.setattr(output, "_SHORT_S", 0.0)
    with progress_bar("compare") as tell:
        tell("fold 1 of 8", 0.5)
        time.sleep(0.3)
    assert capfd.readouterr() == ("", "")


def test_a_long_wait_without_a_terminal_says_a_line_now_and_then(capfd, monkeypatch):
    """A press of a new object was silent for 50 s where its lines were piped."""
    monkeypatch.setattr(output, "SILENT_S", 0.05)
    with progress_bar("press") as tell:
        tell("compliance", 0.5)
        eventually(lambda: "press: compliance ..." in capfd.readouterr().err)


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


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are of POSIX")
def test_a_terminal_that_says_no_size_is_told_all_the_same(monkeypatch):
    """A container's or a log's terminal has 0 columns and 0 rows: every wait was silent there."""
    outer, inner = os.openpty()
    monkeypatch.delenv("COLUMNS", raising=False)
    with open(inner, "w") as terminal, open(outer, "rb", buffering=0) as read:
        monkeypatch.setattr(sys, "stderr", terminal)
        with progress_bar("reconstruct") as tell:
            tell("contacts", 0.5)
        terminal.flush()
        os.set_blocking(read.fileno(), False)
        shown = bytearray()

        def drawn() -> str:  # a terminal hands over what it has by then, often a part of the line
            with contextlib.suppress(BlockingIOError):
                shown.extend(os.read(read.fileno(), 4096))
            return shown.decode(errors="replace")

        assert until(drawn, "reconstruct: contacts")


def test_a_batch_says_what_is_left_by_the_same_display(monkeypatch, tmp_path):
    shown: list[str] = []

    class Seen(output.Bar):
        def __init__(self, label: str) -> None:
            shown.append(label)
            super().__init__(label)

    monkeypatch.setattr(output, "Bar", Seen)
    run_with_bar((), tmp_path, workers=1)
    assert shown == [""]


def test_what_is_said_on_the_way_reaches_a_pipe_at_once(tmp_path, monkeypatch):
    """A pipe or a file is buffered: lines that were said before long work came after it."""
    told = (tmp_path / "out.txt").open("w", encoding="utf-8")
    monkeypatch.setattr(sys, "stdout", told)
    output.Output().say("picture: rec.png")
    assert (tmp_path / "out.txt").read_text() == "picture: rec.png\n"
    told.close()


def test_stages_are_said_where_no_terminal_shows_a_bar_each_before_it_begins(capsys, monkeypatch):
    """Whoever reads a pipe saw nothing of two minutes' work, and thought that it hung."""

    def tell() -> str:
        told = output.Output().stages(lambda *_: None, "once:", brief=("starting",))
        told("starting", 0.0)
        before = capsys.readouterr().out
        told("meshing", 0.1)
        seen = capsys.readouterr().out
        told("meshing", 0.9)
        told("solving", 0.9)
        return before + seen + capsys.readouterr().out

    assert tell() == "once:\n  meshing ...\n  solving ...\n"
    monkeypatch.setattr(sys, "stderr", Terminal())
    assert tell() == ""


def test_standard_output_that_belongs_to_json_holds_no_stages(capsys):
    output.Output("-").stages(lambda *_: None, "once:")("meshing", 0.0)
    assert capsys.readouterr().out == ""
