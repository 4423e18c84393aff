"""The real servo process for a while: effects are felt, nothing grows, forces stay within clamp and slew."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from ...support import effects_in_servo, soak
from ..window.small import block_model

pytestmark = pytest.mark.slow


def arguments(module, *words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    module.add_arguments(parser)
    return parser.parse_args(words)


def test_effects_are_felt_as_they_must_be(tmp_path: Path):
    wanted = ["viscoelasticity", "mullins_softening", "friction_slip", "adhesion"]
    rows = effects_in_servo.run_all(block_model(tmp_path), tmp_path, wanted)
    assert [row["effect"] for row in rows] == ["plain", *wanted]
    assert all(row["right"] for row in rows[1:])


def test_models_are_swapped_while_touching_without_a_jump_or_a_leak():
    swapped = soak.run(arguments(soak, "--minutes", "0", "--swaps", "20"))["swaps"]
    assert swapped["ticks with force"] > 0
    assert swapped["greatest N"] <= swapped["clamp N"] * (1 + 1e-9)
    # times are those at which ticks were written down, which stray from those that the filter counts by
    assert swapped["greatest rise / slew"] <= 1.05
    assert swapped["files end"] == swapped["files start"]


def test_a_session_leaves_no_fault_and_no_more_open_files():
    session = soak.run(arguments(soak, "--minutes", "0.3", "--swaps", "0", "--frames-per-s", "5"))["session"]
    assert not set(session["report"]["reasons"]) & set(soak.LATCHED)
    start, end = session["stages"]["start"], session["stages"]["end"]
    assert all(end[f"{of}_files"] <= start[f"{of}_files"] for of in ("window", "servo"))
    assert end["servo_threads"] == start["servo_threads"]
    assert session["report"]["energy_given_back_j"] < 1e-3
