"""Intervals as wide as judged cases need them."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.verdict import conclusion as corrections
from palpate.diagnosis.verdict.conclusion import factors, widened
from tools.diagnose_widening import chosen_factors, distances


def test_ends_move_away_from_the_value_and_stay_within_what_the_key_allows(monkeypatch):
    monkeypatch.setattr(corrections, "factors", lambda: {"all": 2.0, "force_bias": 3.0})
    wider = widened(
        "force_bias", {"bias_n": [0.1, 0.0, 0.0]}, {"bias_n": [[0.0, -0.1, -0.2], [0.3, 0.1, 0.2]]}
    )
    assert np.allclose(wider["bias_n"], [[-0.2, -0.3, -0.6], [0.7, 0.3, 0.6]])
    slip = widened("friction_slip", {"mu": 0.2}, {"mu": [0.05, 0.4]})
    assert np.allclose(slip["mu"], [0.0, 0.6])


def test_what_is_read_from_the_file_never_makes_an_interval_narrower():
    assert "all" in factors()
    assert min(factors().values()) >= 1.0


def test_a_factor_covers_as_many_as_it_says():
    rng = np.random.default_rng(0)
    far = {"time_delay": list(np.abs(rng.normal(0, 2 / 1.96, 400))), "backlash": [0.1] * 5}
    found = chosen_factors(far)
    assert found["time_delay"] == pytest.approx(2.0, rel=0.15)
    assert set(found) == {"all", "time_delay"}


def test_a_truth_at_the_end_of_its_interval_is_one_half_interval_away():
    opened = {
        "case": {"tested": ["time_delay"]},
        "verdict": {
            "effects": ["time_delay"],
            "parameters": {"time_delay": {"delay_s": 0.02}},
            "intervals": {"time_delay": {"delay_s": [0.015, 0.03]}},
        },
        "truth": {"parameters": {"time_delay": {"delay_s": 0.03}}},
    }
    assert distances(opened) == [("time_delay", pytest.approx(1.0))]
    unnamed = {**opened, "verdict": {**opened["verdict"], "effects": []}}
    assert distances(unnamed) == []
