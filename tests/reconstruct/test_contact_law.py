"""The contact law behind the first touch, and its fit."""

import numpy as np
import pytest

from palpate.reconstruction.steps.s3_contacts.contact_law import contact_law, fit_rise


@pytest.mark.parametrize(("hertz", "compliance"), [(2000.0, 2e-3), (2000.0, 1e-9), (1e5, 5e-3), (50.0, 1e-3)])
def test_the_law_solves_its_equation(hertz, compliance):
    u = np.linspace(-1e-3, 8e-3, 200)
    force = contact_law(u, hertz, compliance)
    assert (force[u <= 0] == 0).all()
    assert (force / hertz) ** (2 / 3) + compliance * force == pytest.approx(np.maximum(u, 0), abs=1e-9)


def test_the_fit_recovers_the_law_and_its_error_is_honest():
    travel = np.linspace(-0.003, 0.006, 300)
    wrong, stated = [], []
    for seed in range(30):
        noise = 0.012 * np.random.default_rng(seed).standard_normal(len(travel))
        rise = fit_rise(travel, contact_law(travel - 4e-4, 2000.0, 2e-3) + noise, 0.012, guess_m=0.001)
        wrong.append(rise.u0_m - 4e-4)
        stated.append(rise.u0_error_m)
    assert np.std(wrong) < 1.5e-4
    assert abs(np.mean(wrong)) < 4e-5
    assert np.median(stated) == pytest.approx(np.std(wrong), rel=0.5)
