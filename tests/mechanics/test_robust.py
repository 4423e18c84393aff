"""Robust statistics against what they must be: Gaussian scales, and lines that outliers do not move."""

import numpy as np
import pytest

from palpate.mechanics.statistics import biweight, spread, spread_about_zero, tukey


def test_scales_are_those_of_gaussian_values_whatever_a_tenth_of_them_does() -> None:
    values = np.random.default_rng(0).normal(3.0, 0.2, (20001, 3))
    assert spread(values, axis=0) == pytest.approx(0.2, rel=0.03)
    assert spread_about_zero(values[:, 0] - 3.0) == pytest.approx(0.2, rel=0.03)
    values[:2000] = 50.0
    assert spread(values, axis=0) == pytest.approx(0.2, rel=0.2)


def line(x: np.ndarray, y: np.ndarray):
    system = np.column_stack([np.ones_like(x), x])

    def fit(weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        root = np.sqrt(weight)
        found = np.linalg.lstsq(system * root[:, None], y * root, rcond=None)[0]
        return found, y - system @ found

    return fit


def test_outliers_lose_their_weight_and_leave_the_line_where_it_is() -> None:
    rng = np.random.default_rng(1)
    x = np.linspace(0, 1, 200)
    y = 2.0 + 3.0 * x + rng.normal(0, 0.01, 200)
    clean = biweight(line(x, y), 200, least=1e-6)
    bad = rng.choice(200, 60, replace=False)
    y[bad] += rng.uniform(1, 9, 60)
    found = biweight(line(x, y), 200, least=1e-6)
    assert found.fitted == pytest.approx(clean.fitted, abs=0.005)
    assert found.fitted == pytest.approx([2, 3], abs=0.01)
    assert (found.weight[bad] == 0).all() and found.weight.max() > 0.99
    assert clean.scale == pytest.approx(0.01, rel=0.2)


def test_on_gaussian_errors_it_costs_a_twentieth_of_the_precision() -> None:
    rng = np.random.default_rng(2)
    x = np.linspace(-1, 1, 40)
    robust, plain = [], []
    for _ in range(1500):
        y = rng.normal(size=40)
        fit = line(x, y)
        robust.append(biweight(fit, 40, least=1e-6).fitted[1])
        plain.append(fit(np.ones(40))[0][1])
    assert np.var(plain) / np.var(robust) == pytest.approx(0.95, abs=0.05)


def test_the_least_scale_keeps_exact_data_whole() -> None:
    x = np.linspace(0, 1, 10)
    found = biweight(line(x, 1 + x), 10, least=1e-3)
    assert found.scale == 1e-3 and found.weight == pytest.approx(1.0)
    assert tukey(np.array([0.0, 1.0, 2.0])).tolist() == [1.0, 0.0, 0.0]
