"""What is said of many things at once, and of what changed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from palpate import cli
from palpate.diagnosis.explore.candidates import ReachOptions
from palpate.diagnosis.explore.goals import GoalState
from palpate.diagnosis.explore.state import ExplorationState
from palpate.diagnosis.explore.suggestion import Suggestion, _first, _why
from palpate.operations.explore import _line
from palpate.operations.press import _compared
from palpate.operations.touch import _Opening
from palpate.reconstruction.checks.finding import Finding
from palpate.render.press import Curve
from palpate.words import chance_words, estimate_words, gathered, place_mm


def test_a_finding_says_its_cure_once():
    saw = "nothing was traced: say what is known of the object: --shape FILE"
    told = Finding("no base", saw, "it stops there", "say what is known of the object", np.inf, np.inf).line()
    assert told.count("what is known") == 1 and told.endswith("(it stops there)")


def test_a_share_has_the_digits_of_its_interval():
    """'100 % (99.5 to 99.8 %)' lay outside its own interval."""
    assert estimate_words(0.997, 0.995, 0.998) == ("99.7\u00a0%", "99.5 to 99.8\u00a0%")
    assert estimate_words(0.88, 0.85, 0.91) == ("88\u00a0%", "85 to 91\u00a0%")


def test_reasons_that_differ_in_figures_are_one():
    """Thirty lines 'lasts only 17 ms' followed a touch in which nothing was wrong."""
    reasons = [*(f"lasts only {ms} ms" for ms in (17, 9, 20)), "the tip slides (3.5 mm)", "lasts only 17 ms"]
    assert gathered(reasons) == [("lasts only 9 to 20 ms", 4), ("the tip slides (3.5 mm)", 1)]
    assert gathered([]) == []


def state(surface_m: float) -> ExplorationState:
    goals = (GoalState("modulus", 0.04, 0.05), GoalState("surface", surface_m, 0.002))
    return ExplorationState(7, 7, 30.0, 12e3, (11e3, 13e3), surface_m, "dome", goals)


def test_a_line_says_that_less_is_known_than_before():
    stop = Suggestion("stop", "so it is")
    assert "less sure" in _line(stop, state(0.007), state(0.002))
    assert "less sure" not in _line(stop, state(0.002), state(0.007))
    assert "less sure" not in _line(stop, state(0.002))
    assert "5 %" in state(0.001).words and "2 mm" in state(0.001).words  # what was asked for


def test_a_goal_that_is_missed_reads_as_missed():
    """'known within 5 % and 5 % is the goal' asked for one more press."""
    best = SimpleNamespace(for_goal="modulus")
    missed = GoalState("modulus", 0.0501, 0.05), GoalState("surface", 0.00201, 0.002)
    situation = SimpleNamespace(state=SimpleNamespace(goals=missed))
    assert "within 5.1 % and 5 % is the goal" in _why(situation, best)
    best.for_goal = "surface"
    assert "within 2.1 mm and 2 mm is" in _why(situation, best)


def test_a_first_press_is_reasoned_once():
    """'nothing is known yet; press at ...: nothing is known yet of how high the object is'."""
    base = SimpleNamespace(
        outline=0.04 * np.eye(3)[[0, 1, 0, 1]] * [[1], [1], [-1], [-1]], support_normal=np.array([0, 0, 1.0])
    )
    base.support_point = base.outline.mean(axis=0)
    situation = SimpleNamespace(
        state=SimpleNamespace(made=0), reach=ReachOptions(), heights=np.zeros(0), tip_radius_m=0.005
    )
    suggestion = _first(situation, base)
    assert _line(suggestion, unknown()).count("known") == 1 and "how high" in suggestion.why


def unknown() -> ExplorationState:
    return ExplorationState(0, 0, 0.0, np.nan, (np.nan, np.nan), np.nan, "", ())


def test_without_a_screen_an_exploration_is_told_what_explores_without_one(tmp_path, monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    assert cli.main(["explore", "--device", "mouse", "-o", str(tmp_path / "mine.csv.gz")]) == 2
    assert "palpate explore --phantom" in capsys.readouterr().err


def test_what_a_file_cannot_hold_is_no_difference():
    t, push = np.linspace(0.0, 1.0, 50), np.linspace(0.0, 0.789, 50)[:, None] / 3
    own = Curve(t, -1e-3 * np.outer(t, [0.0, 0.0, 1.0]), t, push * [0.1, 0.2, 1.0])
    call = SimpleNamespace(exit_code=0, figures={})

    def said(off: float) -> str:
        return _compared(own, Curve(t, own.position, t, own.force + off), 0.02, call)[0]

    assert "greatest difference" not in said(2e-11)
    assert "1.732e-06 N" in said(1e-6)


def test_a_touch_says_what_was_made_of_an_open_surface(block):
    """Of a mug of three bodies that overlap, `palpate model` said the volume and `palpate touch` nothing."""
    mended = block.replaced(provenance={**block.provenance, "mended": "filled by its winding number"})
    told = {}
    for model in (block, mended):
        report = SimpleNamespace(text=lambda **_: "", as_dict=dict)
        servo, table = SimpleNamespace(failure=""), SimpleNamespace(state={}, words="")
        session = SimpleNamespace(
            model=model, report=lambda r=report: r, servo=servo, table=table, renderer_name="fem"
        )
        opening = SimpleNamespace(device="simulated", record=None)
        run = _Opening.touched(opening, session, SimpleNamespace(title="mug", name="mug"))
        told[model is mended] = "\n".join(run.lines())
    assert "winding number" in told[True] and "cm³" in told[True] and "cm³" not in told[False]


def test_no_coordinate_is_minus_nothing():
    assert place_mm((0.01, -0.024, -1e-9)) == "(10, -24, 0) mm"


def test_chances_are_told_as_one_says_them():
    """'1 times in 100' stood in a table."""
    assert [chance_words(p) for p in (0.001, 0.012, 0.02, 0.9, 1.0)] == [
        "less than once in 100", "once in 100", "2 times in 100", "90 times in 100", "always"
    ]  # fmt: skip
