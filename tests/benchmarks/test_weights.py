"""The weights of evidence: what their fit tells apart (python -m tools.diagnose_weights)."""

import numpy as np
import pytest

from tools.diagnose_weights import rows_of, weights


def test_the_fit_finds_the_border_between_what_is_there_and_what_is_not():
    rng = np.random.default_rng(0)
    x = rng.uniform(0, 5, 800)
    in_time = np.arange(800) % 2 == 1
    there = x + 0.1 * rng.normal(size=800) > np.where(in_time, 2.5, 1.5)
    *borders, evidence = weights(x, there, in_time)
    assert np.log10(borders) == pytest.approx([1.5, 2.5], abs=0.05) and evidence > 5


def test_a_case_counts_what_is_false_in_controls_and_what_was_found_in_others():
    scores = {"backlash": [2000.0, 0.5], "adhesion": [300.0, 0.2]}
    control = {"key": "c", "case": {"tested": []}, "verdict": {"scores": scores}}
    assert [(name, there) for _, name, _, there in rows_of(control)] == [
        ("backlash", False),
        ("adhesion", False),
    ]
    asked = {"key": "b", "case": {"tested": ["backlash"]}, "verdict": {"scores": scores}}
    assert [(name, there) for _, name, _, there in rows_of(asked)] == [("backlash", True)]
    missed = {**asked, "verdict": {"scores": {"backlash": [5.0, 0.9]}}}
    assert rows_of(missed) == []


def test_what_is_weighed_after_all_that_is_there_was_picked_is_false():
    first = {"scores": {"viscoelasticity": [2000.0, 0.5]}}
    later = {"later_scores": [{"adhesion": [40.0, 0.1]}, {"backlash": [9.0, 0.1]}]}

    def told(*picked):
        verdict = {**first, **later, "picked": list(picked)}
        rows = rows_of({"key": "b", "case": {"tested": ["viscoelasticity"]}, "verdict": verdict})
        return [(name, there) for _, name, _, there in rows]

    found, false = ("viscoelasticity", True), ("adhesion", False)
    assert told("viscoelasticity") == [found, false]
    # another law of the same phenomenon is no wrong pick; after a wrong one nothing counts
    assert told("power_law_relaxation") == [found, false]
    assert told("viscoelasticity", "adhesion") == [found, false]
    assert told("time_delay", "adhesion") == [found]
