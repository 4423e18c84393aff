"""The closed share of a gap: what it is, and that its interval holds the truth as often as it says."""

import numpy as np
import pytest

from palpate.diagnosis.search.gaps import closed_share_ci95, gap


def test_the_share_is_that_of_the_excess_over_the_noise() -> None:
    counts = np.full(10, 50.0)
    before, after = np.full(10, 50 * 0.05**2), np.full(10, 50 * 0.03**2)
    value, (low, high) = closed_share_ci95(before, after, counts, 0.01**2, np.random.default_rng(0), 200)
    assert value == pytest.approx(1 - (0.03**2 - 0.01**2) / (0.05**2 - 0.01**2))
    assert low == pytest.approx(value) and high == pytest.approx(value)
    assert gap(before, counts, 0.0) == pytest.approx(0.05)


def test_nothing_is_closed_of_a_gap_within_the_noise() -> None:
    counts, plain = np.full(5, 50.0), np.full(5, 50 * 0.01**2)
    assert closed_share_ci95(plain, plain, counts, 0.02**2, np.random.default_rng(0), 100) == (None, None)


def test_resamples_within_the_noise_are_passed_over_and_one_site_is_enough() -> None:
    counts, before = np.full(3, 1.0), np.array([1.0, 1.0, 20.0])
    value, (low, high) = closed_share_ci95(before, before / 2, counts, 2.0**2, np.random.default_rng(0), 500)
    assert np.isfinite([value, low, high]).all()
    one = closed_share_ci95(before[2:], before[2:] / 2, counts[2:], 2.0**2, np.random.default_rng(0), 50)
    assert one == (pytest.approx(0.625), (pytest.approx(0.625), pytest.approx(0.625)))


def test_the_interval_holds_the_truth_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    held = 0
    for seed in range(300):
        counts = rng.integers(40, 120, 30).astype(float)
        before = counts * rng.gamma(4.0, 0.25, 30) * 0.05**2
        after = before * rng.uniform(0.2, 0.6, 30)
        low, high = closed_share_ci95(before, after, counts, 0.0, np.random.default_rng(seed), 300)[1]
        held += low < 0.6 < high
    assert 0.88 < held / 300 < 0.98
