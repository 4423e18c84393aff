"""A machine's curves are brought to a hand's size and back: every parameter by the powers of its own unit."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.specimen.bench import Similarity

L, F, T = 50.0, 3e4, 0.25
"""Factors from the machine's metres, newtons and seconds to a hand's."""


@pytest.mark.parametrize(
    ("key", "factor"),
    [
        ("diffusivity_m2_per_s", L**2 / T),
        ("work_j_per_m2", F / L),
        ("mass_kg", F * T**2 / L),
        ("k_normal_pa_per_m", F / L**3),
        ("rate_n_per_s", F / T),
        ("stiffness_n_per_m", F / L),
        ("pull_off_n", F),
        ("tau_s", T),
        ("rotation_rad", 1.0),
        ("mu", 1.0),
    ],
)
def test_a_parameter_scales_by_the_powers_of_its_unit(key, factor):
    back = Similarity(length=L, force=F, time=T).back({key: [7.0, 2.0]})
    assert back[key] == pytest.approx([7.0 / factor, 2.0 / factor], rel=1e-12)


def test_a_poroelastic_time_comes_back_as_a_time():
    """a^2 / D is a time in any units, so it scales as one."""
    similarity = Similarity(length=L, force=F, time=T)
    back = similarity.back({"range_m": 2e-3, "diffusivity_m2_per_s": 4e-6, "tau_s": 1.0})
    assert back["range_m"] ** 2 / back["diffusivity_m2_per_s"] == pytest.approx(back["tau_s"], rel=1e-12)


def test_what_falls_falls_alike():
    """m = F / a: a mass scales as what accelerates it."""
    similarity = Similarity(length=L, force=F, time=T)
    back = similarity.back({"mass_kg": 2.0, "push_n": 6.0, "way_m": 3.0, "tau_s": 1.0})
    assert back["mass_kg"] * back["way_m"] / back["tau_s"] ** 2 == pytest.approx(back["push_n"], rel=1e-12)
    assert np.isclose(back["push_n"], 6.0 / F)
