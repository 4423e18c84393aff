"""Free air that slopes with the travel moves no modulus of a flat object; what looks like it is left."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from palpate.mechanics.contact.dent import dent_law
from palpate.reconstruction.geometry.stated import nowhere
from palpate.reconstruction.steps.s3_contacts.contacts import explore

RADIUS, MODULUS = 0.004, 12e3


def log(slope: float = 0.0, drift: float = 0.0, pull_n: float = 0.0, noise_n: float = 5e-4) -> pp.Recording:
    """Six presses of 3 mm after 4 mm of air at 7 mm/s, read at 100 Hz; slope N/m, drift N/s; pull_n: what the
    solid holds the tip back by, on the way out alone, over 2 mm."""
    t = np.arange(0, 6 * 2.1, 0.01)
    place, within = np.divmod(t, 2.1)
    height = 4e-3 - 7e-3 * np.clip(1 - np.abs(within - 1.0), 0, 1)
    force = noise_n * np.random.default_rng(2).standard_normal((len(t), 3))
    force[:, 2] += dent_law("sphere").force(np.maximum(-height, 0), MODULUS, 0.49, RADIUS)
    force[:, 2] += slope * (4e-3 - height) + drift * t
    force[:, 2] -= pull_n * np.clip(1 - height / 2e-3, 0, 1) * ((within > 1) & (height > 0))
    centre = np.column_stack([0.012 * (place // 3), 0.012 * (place % 3), height + RADIUS])
    return pp.Recording(t, centre, force, 100.0, RADIUS)


QUIET = [{}, {"drift": 2e-3}, {"drift": -2e-3}, {"pull_n": 0.02}, {"noise_n": 5e-3}]


def found(recording):
    return explore(recording, boundary=nowhere(recording), unbroken=True, flat=True)


@pytest.mark.parametrize("slope", [2.0, -2.0, 5.0, -5.0])
def test_a_slope_is_known_with_its_error_and_moves_no_first_touch(slope):
    measured = found(log(slope, drift=1e-3))
    assert measured.air_slope is not None
    assert measured.air_slope.n_per_m == pytest.approx(slope, rel=0.03)
    assert 0 < measured.air_slope.error_n_per_m < 0.1
    assert np.abs(measured.presses.centre[:, 2] - RADIUS).max() < 6e-5


@pytest.mark.parametrize(
    "given", [{}, {"drift": 2e-3}, {"drift": -2e-3}, {"pull_n": 0.02}, {"noise_n": 5e-3}]
)
def test_drift_noise_and_a_pull_on_the_way_out_are_no_slope(given):
    assert found(log(**given)).air_slope is None


@pytest.mark.parametrize("slope", [5.0, pytest.param(-5.0, marks=pytest.mark.slow)])
def test_a_slope_of_a_sixth_of_the_peak_moves_no_modulus_and_is_said(slope):
    """It made 8.1 and 13.1 kPa of 12."""
    made = pp.reconstruct(log(slope), half_space=True, progress=False)
    assert made.young_modulus_pa == pytest.approx(MODULUS, rel=0.02) and not made.doubt
    assert [each.name for each in made.findings] == ["sloping free air"]
