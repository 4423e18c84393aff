"""The predictive density of held-out places: its covariance, its score, its null."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mechanics.presses import Noise
from palpate.benchmarks._density_covariance import Terms, estimated, weigh
from palpate.benchmarks._density_noise import coloured, whitened
from palpate.benchmarks._density_score import null_gains, predictive

PLACES, ROWS = 12, 60


def drawn_terms(rng, *, own_sd: float, effect: float = 0.0) -> tuple[Terms, list[tuple]]:
    """Places with one own error each ('bend', of standard deviation own_sd), two parameters, one field
    pattern."""
    grams, raw = [], []
    for _ in range(PLACES):
        x = rng.normal(size=(ROWS, 2))
        n = rng.normal(size=(ROWS, 1))
        w = rng.normal(size=(ROWS, 1))
        r = rng.normal(size=ROWS) + own_sd * rng.normal() * n[:, 0] + effect * x[:, 1]
        stack = np.column_stack([r, x, w, n])
        grams.append(stack.T @ stack)
        raw.append((r, x, w, n))
    terms = Terms(
        np.array(grams), np.full(PLACES, ROWS), ("bend", "level"), np.zeros((PLACES, 1), int), np.array([1]),
        np.zeros(2), np.zeros(2), np.full(2, -np.inf), np.full(2, np.inf),
    )  # fmt: skip
    return terms, raw


def test_slow_noise_becomes_white():
    rng = np.random.default_rng(0)
    white, slow, tau, n = 0.3, 1.0, 0.05, 20_000
    keep = np.exp(-0.01 / tau)
    x = np.zeros(n)
    for i in range(1, n):
        x[i] = keep * x[i - 1] + np.sqrt(slow * (1 - keep**2)) * rng.normal()
    seen = (x + np.sqrt(white) * rng.normal(size=n))[:, None]
    table = SimpleNamespace(press=np.zeros(n, int), t=0.01 * np.arange(n))
    noise = SimpleNamespace(white=white, slow=slow, time_s=tau)
    out = whitened(table, np.arange(n), seen, noise)[:, 0]
    assert out.var() == pytest.approx(1.0, abs=0.05)
    assert abs(np.corrcoef(out[:-1], out[1:])[0, 1]) < 0.03 < np.corrcoef(seen[:-1, 0], seen[1:, 0])[0, 1]


def test_three_scatters_of_free_air_tell_slow_from_white():
    assert coloured(Noise(0.01, 0.01 / np.sqrt(10), 1.0), 1000.0).slow == 0.0
    # 0.01 N white a sample at 1 kHz and 0.005 N slow, of 50 ms: as means over 10 and 100 ms scatter
    kept = [2 * (x - 1 + np.exp(-x)) / x**2 for x in (0.2, 2.0)]
    step = 1e-5 + 25e-6 * kept[0]
    long = 1e-6 + 25e-6 * kept[1]
    found = coloured(Noise(np.sqrt(125e-6), np.sqrt(step), 10 * long / step), 1000.0)
    assert found.slow == pytest.approx(25e-6 * kept[0], rel=0.15)
    assert found.time_s == pytest.approx(0.05, rel=0.3)


def test_the_gradient_of_the_likelihood_is_its_slope():
    terms, _ = drawn_terms(np.random.default_rng(1), own_sd=0.5)
    x = np.array([0.2, -0.4, 0.3])
    slope = weigh(terms, x)[1]
    for i, step in enumerate(1e-5 * np.eye(3)):
        there = (weigh(terms, x + step)[0].loss - weigh(terms, x - step)[0].loss) / 2e-5
        assert slope[i] == pytest.approx(there, rel=1e-3, abs=1e-2)


@pytest.mark.parametrize("own_sd", [0.3, 3.0])
def test_own_errors_are_as_large_as_they_are(own_sd):
    found = [
        estimated(drawn_terms(np.random.default_rng(seed), own_sd=own_sd)[0]).sizes["bend"]
        for seed in range(20)
    ]
    assert np.median(found) == pytest.approx(own_sd, rel=0.25)


def test_the_score_is_the_density_of_a_place_given_the_others():
    terms, raw = drawn_terms(np.random.default_rng(2), own_sd=0.5)
    weighed = weigh(terms, np.zeros(3))[0]
    score = predictive(terms, weighed)

    def law(places: list[int]) -> tuple[np.ndarray, np.ndarray]:
        """(mean information, of (r, mean, covariance)) of these places' residuals, parameters nearly free."""
        r = np.concatenate([raw[k][0] for k in places])
        x = np.vstack([raw[k][1] for k in places])
        w = np.vstack([raw[k][2] for k in places])
        cov = np.eye(len(r)) + 1e6 * x @ x.T + w @ w.T
        for i, k in enumerate(places):
            part = slice(i * ROWS, (i + 1) * ROWS)
            cov[part, part] += raw[k][3] @ raw[k][3].T
        return r, cov

    def density(places: list[int]) -> float:
        r, cov = law(places)
        return float(-0.5 * (np.linalg.slogdet(cov)[1] + r @ np.linalg.solve(cov, r)))

    everyone = list(range(PLACES))
    for left_out in (0, 7):
        rest = [k for k in everyone if k != left_out]
        assert score[left_out] == pytest.approx(density(everyone) - density(rest), abs=1e-2)


def test_the_null_is_reached_as_often_as_it_says():
    rng = np.random.default_rng(3)
    terms, _ = drawn_terms(rng, own_sd=0.5)
    weighed = weigh(terms, np.zeros(3))[0]
    null = null_gains(terms, weighed, 1, [np.array([1])], 2000, rng)
    bar = np.quantile(null, 0.9)
    stays = {"low": np.array([-np.inf, 0.0]), "high": np.array([np.inf, 0.0])}
    reached = 0
    for seed in range(200):
        again, _ = drawn_terms(np.random.default_rng(100 + seed), own_sd=1.0)
        both = weigh(again, np.zeros(3))[0]
        held = Terms(**{**again.__dict__, **stays})
        reached += (predictive(again, both) - predictive(held, both)).sum() > bar
    assert 8 <= reached <= 36  # 20 expected
