"""Stated probabilities: how often what stood so was true."""

from __future__ import annotations

import pytest

from palpate.diagnosis.verdict import conclusion as module
from palpate.diagnosis.verdict.conclusion import (
    ALONE,
    BOTH,
    CANDIDATE,
    REMAINDER,
    RIVALLED,
    UNNAMED,
    counts,
    how_named,
    sureness,
)
from tools.diagnose_sureness import stood


@pytest.mark.parametrize(
    ("named", "candidates", "kind", "how"),
    [
        (["backlash"], [], "effect", ALONE),
        (["backlash"], ["adhesion"], "ambiguous", RIVALLED),
        (["backlash"], [], "effect+unknown", REMAINDER),
        (["backlash"], ["adhesion"], "effect+unknown", BOTH),
        (["adhesion"], ["backlash"], "ambiguous", CANDIDATE),
        ([], [], "none", UNNAMED),
    ],
)
def test_how_an_effect_stands(named, candidates, kind, how):
    assert how_named("backlash", named, candidates, kind) == how


def test_a_share_of_few_cases_leans_on_that_of_all(monkeypatch):
    table = {ALONE: {"searched": (90.0, 100.0), "free_air": (1.0, 1.0)}}
    monkeypatch.setattr(module, "counts", lambda: table)
    usual = 92 / 103
    assert sureness("backlash", ALONE) == pytest.approx((90 + 2 * usual) / 102)
    # one right of one is not certain
    assert usual < sureness("force_bias", ALONE) < 1
    assert sureness("force_bias", ALONE) == pytest.approx((1 + 2 * usual) / 3)
    assert sureness("surface_shape", ALONE) == pytest.approx(usual)
    assert sureness("backlash", RIVALLED) == 0.5


def test_what_is_not_named_is_there_less_often_than_its_score_says(monkeypatch):
    monkeypatch.setattr(module, "counts", lambda: {UNNAMED: {"searched": (20.0, 100.0)}})
    low, high = (sureness("backlash", UNNAMED, scored) for scored in (0.01, 0.4))
    assert low < 0.003 < 0.07 < high < 0.1


def test_the_file_tells_names_from_rivals_from_the_rest():
    table = counts()
    assert set(table) <= {ALONE, RIVALLED, REMAINDER, BOTH, CANDIDATE, UNNAMED}
    assert all(0 <= right <= of for each in table.values() for right, of in each.values())
    alone, rivalled, candidate, unnamed = (
        sureness("backlash", how, 0.3) if how == UNNAMED else sureness("backlash", how)
        for how in (ALONE, RIVALLED, CANDIDATE, UNNAMED)
    )
    assert alone > rivalled > candidate > unnamed


def test_a_case_counts_how_each_effect_stood_but_not_what_was_drawn_beside():
    opened = {
        "case": {"effects": ["backlash"], "beside": ["tool_gravity_inertia"]},
        "verdict": {
            "kind": "ambiguous", "effects": ["backlash", "tool_gravity_inertia"], "candidates": ["adhesion"],
            "probability": dict.fromkeys(["backlash", "tool_gravity_inertia", "adhesion", "time_delay"], 0.5),
            "scores": {"backlash": [1e4, 0.9], "adhesion": [9e3, 0.8], "time_delay": [3.0, 0.1]},
        },
    }  # fmt: skip
    found = {(how, role, there): weight for how, role, there, weight in stood(opened)}
    assert found[RIVALLED, "searched", True] == found[CANDIDATE, "searched", False] == 1.0
    assert found.pop((UNNAMED, "searched", False)) < 0.01
    assert len(found) == 2
