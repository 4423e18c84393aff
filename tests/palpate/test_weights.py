"""The weights of evidence and closure: what their fit tells apart (palpate bench diagnose-weights)."""

import numpy as np

from palpate.benchmarks.diagnose_weights import rows_of, weights


def test_the_fit_tells_apart_what_evidence_or_closure_alone_do_not():
    rng = np.random.default_rng(0)
    x = rng.uniform([0, -1], [5, 1], (400, 2))
    there = 4 * x[:, 0] + 12 * x[:, 1] > 13
    w = weights(x, there)
    assert ((w[0] + x @ w[1:] > 0) == there).mean() > 0.97
    assert w[2] / w[1] == np.clip(w[2] / w[1], 2.2, 3.8)


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
