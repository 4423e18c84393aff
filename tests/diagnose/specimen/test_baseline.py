"""Free air that slopes with the travel or drifts with time moves no modulus, and nothing is lost by it."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.specimen.baseline import form_scores, without_slope
from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.material import material_of
from palpate.diagnosis.specimen.result import MachineTests
from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.contact.tip import Tip

RADIUS, MODULUS, STEP_S = 1e-3, 10e3, 0.05
TIP = Tip("sphere", RADIUS)


def curve(slope: float = 0.0, drift: float = 0.0, seed: int = 0, noise_n: float = 2e-6) -> MachineCycle:
    """A sphere 0.4 mm into a solid of 10 kPa after 1.2 mm of air, and back; N/m of travel, N/s."""
    way = np.linspace(0.0, 1.6e-3, 95)
    travel = np.concatenate([way, way[::-1]])
    t = STEP_S * np.arange(len(travel))
    force = np.asarray(dent_law("hertz").force(np.maximum(travel - 1.2e-3, 0), MODULUS, 0.49, RADIUS))
    noise = noise_n * np.random.default_rng(seed).standard_normal(len(travel))
    return MachineCycle(t, travel, force + slope * travel + drift * t + noise, "a curve")


@pytest.mark.parametrize(
    ("slope", "drift"), [(0.0, 0.0), (0.4, 0.0), (-0.4, 0.0), (0.0, 1e-4), (0.0, -1e-4), (0.4, -1e-4)]
)
def test_a_slope_or_a_drift_of_free_air_moves_no_modulus_and_loses_no_work(slope, drift):
    made = material_of(MachineTests("indentation", curves=(curve(slope, drift),), tip=TIP), ["a"], fast=True)
    low, high = made.young_modulus_ci95_pa
    assert low <= MODULUS <= high and high < 1.1 * low
    assert made.young_modulus_pa == pytest.approx(MODULUS, rel=0.02)
    assert "0 % of the work" in made.verdict
    assert ("free air slopes" in str(made.notes)) == bool(slope or drift)


def test_what_a_slope_is_known_by_is_wider_where_little_air_tells_it():
    def width(rows: int) -> float:
        c = curve(0.4)
        way_in = slice(rows, int(np.argmax(c.force)) + 1)
        found = without_slope([MachineCycle(c.t[way_in], c.travel[way_in], c.force[way_in])], TIP)
        assert found.slope_n_per_m == pytest.approx([0.4], rel=0.1)
        low, high = found.fit.interval_pa
        assert low < MODULUS < high
        return float(np.log(high / low))

    assert width(60) > 1.2 * width(0) > 0


def test_a_contact_from_the_first_row_on_is_no_slope():
    c = curve()
    inside = slice(int(np.argmax(c.travel > 1.22e-3)), int(np.argmax(c.force)) + 1)
    pressed = MachineCycle(c.t[inside], c.travel[inside], c.force[inside])
    assert not len(without_slope([pressed], TIP).slope_n_per_m)
    line = MachineCycle(c.t[:60], c.travel[:60], 20.0 * c.travel[:60])
    assert not len(without_slope([line], Tip("punch", RADIUS)).slope_n_per_m)


def test_without_a_time_a_drift_is_no_cause():
    c = curve(0.4)
    found = without_slope([c], TIP, timed=False)
    assert found.slope_n_per_m == pytest.approx([0.4], rel=0.02)
    assert not len(without_slope([curve()], TIP).slope_n_per_m)


@pytest.mark.parametrize("slope", [0.4, -0.4])
def test_a_slope_does_not_change_the_tips_form(slope):
    scores = form_scores([curve(slope, seed=k) for k in range(3)], RADIUS, 0.49)
    assert max(scores, key=lambda form: scores[form]) == "sphere"
