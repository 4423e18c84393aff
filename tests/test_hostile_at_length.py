"""Whole commands with damaged input, and ended at random moments (`python -m tests.support fuzz`)."""

from __future__ import annotations

import argparse

import pytest

from .support import fuzz, interrupts

pytestmark = pytest.mark.slow


def test_drawn_damage_is_refused_in_a_line_or_answered_rightly():
    """A traceback, several lines, a hang, left files or a silent other answer would stand in "broken"."""
    parser = argparse.ArgumentParser()
    fuzz.add_arguments(parser)
    found = fuzz.run(parser.parse_args(["--count", "24", "--first", "7000", "--deep", "0.1"]))
    assert found["broken"] == []
    assert sum(n for counts in found["counts"].values() for n in counts.values()) >= 24


def test_commands_that_are_ended_leave_whole_results_or_none():
    found = interrupts.interrupted(10, 7000, ["press", "export", "check", "import"], None)
    assert found["broken"] == []
    assert sum(n for of in found["tried"].values() for n in of.values()) >= 8
