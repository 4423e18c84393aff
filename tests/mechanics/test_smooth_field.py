"""A Gaussian process of ln E: kriged between places, found where there is one and not where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.compliance.smooth_field import (
    Shares,
    SmoothField,
    correlation,
    estimate,
    kriging,
    lengths_of,
    places_of,
    views_of,
)

NOISE = 0.03


def _raster(count: int = 6, spacing: float = 0.006) -> np.ndarray:
    x = np.arange(count) * spacing
    return np.array([[a, b, 0.0] for a in x for b in x])


def _drawn(points: np.ndarray, rng: np.random.Generator, sd: float, length: float) -> np.ndarray:
    own = correlation(points, points, length) + 1e-9 * np.eye(len(points))
    return sd * np.linalg.cholesky(own) @ rng.normal(size=len(points))


def _found(seed: int, sd: float):
    """(estimate, truth (p,)) of presses that tell of the point under them alone."""
    rng = np.random.default_rng(seed)
    points = _raster()
    truth = _drawn(points, rng, sd, 0.015) if sd else np.zeros(len(points))
    shares = Shares(points, np.eye(len(points)))
    told = np.log(20e3) + truth + rng.normal(0, NOISE, len(points))
    error = np.full(len(points), NOISE)
    site = np.arange(len(points))
    return estimate(told, error, site, views_of(shares, points, lengths_of(points, points))), truth


def test_kriging_gives_back_what_it_was_given_and_nothing_far_away():
    places = _raster(3)
    field = SmoothField(places, np.linspace(-0.5, 0.5, len(places)), 0.01)
    np.testing.assert_allclose(field.at(places), field.log_ratio, atol=1e-5)
    np.testing.assert_allclose(field.at(places + [0.0, 0.0, 1.0]), 0.0, atol=1e-9)
    assert kriging(places[:2], places, 0.01).shape == (2, len(places))


def test_a_field_is_found_where_there_is_one():
    found, truth = _found(0, 0.3)
    told = found.field.log_ratio + found.level - np.log(20e3)
    assert found.gain > 10 and found.explained > 0.5 and found.felt > 0.1
    assert np.sqrt(np.mean((told - truth) ** 2)) < NOISE
    assert 0.5 < found.prior.log_sd / 0.3 < 2 and 0.3 < found.prior.length_m / 0.015 < 3


def test_its_intervals_hold_the_truth():
    inside = []
    for seed in range(2):
        found, truth = _found(seed, 0.3)
        told = found.field.log_ratio + found.level - np.log(20e3)
        inside.append(np.abs(told - truth) < 1.96 * found.sd)
    assert 0.85 < np.mean(inside) <= 1.0


@pytest.mark.parametrize("seed", range(2))
def test_places_that_scatter_at_random_are_no_field(seed):
    found, _ = _found(seed, 0.0)
    assert found.gain < 4 or found.felt < 0.05


def test_a_share_in_the_depth_is_told_by_presses_that_reach_there():
    """Two layers: what reaches deeper tells of the lower one, and the upper is known better."""
    top = _raster(4, 0.008)
    low = top - [0.0, 0.0, 0.02]
    reach = np.random.default_rng(0).permutation(np.linspace(0.1, 0.6, len(top)))
    shares = Shares(np.vstack([top, low]), np.hstack([np.diag(1 - reach), np.diag(reach)]))
    truth = np.where(np.arange(2 * len(top)) < len(top), 0.3, -0.3)
    told = shares.weight @ truth
    error, site = np.full(len(top), 0.01), np.arange(len(top))
    found = estimate(told, error, site, views_of(shares, shares.nodes, np.array([0.02])))
    log = found.field.log_ratio
    assert log[: len(top)].mean() - log[len(top) :].mean() > 0.25
    assert found.sd[: len(top)].mean() < found.sd[len(top) :].mean()


def test_inner_places_keep_their_distance():
    rng = np.random.default_rng(1)
    touched, inside = _raster(4, 0.01), rng.uniform(0, 0.03, (500, 3))
    places = places_of(touched, inside, most=10)
    assert len(touched) < len(places) <= len(touched) + 10
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + np.eye(len(places))
    assert apart.min() > 0.0049
