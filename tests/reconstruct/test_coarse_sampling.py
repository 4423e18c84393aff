"""A robot's log of any rate holds all of its presses, and its modulus: coarse readings widen the interval."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from palpate.mechanics.contact.dent import dent_law

RADIUS, MODULUS = 0.004, 12e3


def log(folder, rate_hz: float, late_s: float = 0.0):
    """Nine presses of 3 mm at 5 mm/s into a half-space with its surface at z = 0, from 2 mm above it."""
    t = np.arange(0, 9 * 2.1, 1 / rate_hz)
    place, within = np.divmod(t + late_s, 2.1)
    height = 2e-3 - 5e-3 * np.clip(1 - np.abs(within - 1.0), 0, 1)
    x, y = 0.012 * (place // 3), 0.012 * (place % 3)
    force = np.zeros((len(t), 3))
    force[:, 2] = dent_law("sphere").force(np.maximum(-height, 0), MODULUS, 0.49, RADIUS)
    force += 5e-4 * np.random.default_rng(2).standard_normal(force.shape)
    path = folder / f"log-{rate_hz:g}.csv"
    table = np.column_stack([t, x, y, height + RADIUS, force])
    np.savetxt(path, table, delimiter=",", header="t,x,y,z,fx,fy,fz", comments="", fmt="%.6f")
    return path


@pytest.mark.parametrize(
    "rate_hz", [10, pytest.param(20, marks=pytest.mark.slow), pytest.param(50, marks=pytest.mark.slow),
                pytest.param(200, marks=pytest.mark.slow), pytest.param(1000, marks=pytest.mark.slow)]
)  # fmt: skip
def test_a_motion_read_at_any_rate_gives_all_presses_and_one_modulus(tmp_path, rate_hz):
    recording = pp.read_table(log(tmp_path, rate_hz), tip_radius_m=RADIUS)
    made = pp.reconstruct(recording, half_space=True, tip="sphere", progress=False)
    presses = made.model.presses
    assert len(presses) == 9
    assert np.abs(presses.point[:, 2]).max() < 1e-4
    low, high = made.model.material.young_modulus_ci95_pa
    assert low < MODULUS < high


@pytest.mark.parametrize("late_s", [0.04, pytest.param(0.08, marks=pytest.mark.slow)])
def test_slow_readings_do_not_move_the_modulus_wherever_they_fall(tmp_path, late_s):
    """By lines between readings it was up to 5 % too low."""
    recording = pp.read_table(log(tmp_path, 10, late_s), tip_radius_m=RADIUS)
    made = pp.reconstruct(recording, half_space=True, tip="sphere", progress=False)
    assert made.young_modulus_pa == pytest.approx(MODULUS, rel=0.015)
    low, high = made.young_modulus_ci95_pa
    assert high / low > 1.12 and [each.name for each in made.findings] == ["slow readings"]
