"""Uniaxial models: exact on exact data, bounded and steady on bad data, the condition of (4) reported."""

import numpy as np
import pytest

from palpate.mechanics.presses.making import of_paths
from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.steps.s6_one_d import fit_paper, fit_robust

RATE = 800.0
Profile = tuple[np.ndarray, np.ndarray, np.ndarray]


def press(k=400.0, b=6.0, r=1.3, deep=0.008, noise=0.0, seed=0) -> Profile:
    """Depth (m), its rate (m/s) and force (N) of one press."""
    t = np.arange(800) / RATE
    u = deep * np.sin(np.pi * t) ** 2 + 1e-4
    v = np.gradient(u, t)
    return u, v, u**r * (k + b * v) + noise * np.random.default_rng(seed).standard_normal(len(t))


def kelvin_voigt(k=200.0, b=1.5) -> Profile:
    u, v, _ = press()
    return u, v, k * u + b * v


def table(*profiles: Profile) -> Presses:
    """Straight presses onto z = 0, a decimetre apart."""
    up = np.array([0.0, 0.0, 1.0])
    centres = np.array([[0.1 * i, 0.0, 0.005] for i in range(len(profiles))])
    paths = [c - np.outer(u, up) for c, (u, _, _) in zip(centres, profiles, strict=True)]
    return of_paths(
        np.concatenate([[0], np.cumsum([len(u) for u, _, _ in profiles])]),
        np.vstack(paths), np.vstack([np.outer(f, up) for _, _, f in profiles]), centres,
        np.tile(up, (len(profiles), 1)), tip_radius_m=0.005, sample_rate_hz=RATE,
    )  # fmt: skip


@pytest.mark.parametrize("fit", [fit_paper, fit_robust])
def test_kelvin_voigt_is_recovered(fit):
    found = fit(table(kelvin_voigt()))[0]
    assert found.k_kv == pytest.approx(200.0, rel=1e-6)
    assert found.b_kv == pytest.approx(1.5, rel=1e-6)


@pytest.mark.parametrize(("fit", "tolerance"), [(fit_paper, 0.02), (fit_robust, 0.03)])
def test_hunt_crossley_is_recovered_when_slow(fit, tolerance):
    found = fit(table(press()))[0]
    assert found.r_hc == pytest.approx(1.3, rel=tolerance)
    u, v, f = press()
    assert u**found.r_hc * (found.k_hc + found.b_hc * v) == pytest.approx(f, abs=5e-3)
    assert found.valid


def test_the_condition_of_equation_four_is_reported():
    found = fit_paper(table(press(k=400.0, b=4e5)))[0]
    assert not found.valid
    assert found.slow < 1.0


def test_undamped_forms_and_the_mean_exponent():
    presses = table(*(press(b=0.0, r=r) for r in (1.1, 1.5)))
    for fits in (fit_paper(presses), fit_robust(presses)):
        assert [f.r_c for f in fits] == pytest.approx([1.1, 1.5], abs=0.01)
        # at the mean exponent 1.3 the same force at typical depth: k_h lies on either side of 400
        assert fits[0].k_h > 400 > fits[1].k_h
        assert fits[0].k_v > fits[1].k_v


def test_logarithms_are_led_astray_by_noise_where_the_robust_fit_is_not():
    wrong = {"paper": [], "robust": []}
    for seed in range(8):
        noisy = table(press(b=0.0, noise=0.02, seed=seed))
        for name, fit in (("paper", fit_paper), ("robust", fit_robust)):
            wrong[name].append(abs(fit(noisy, 0.005)[0].r_c - 1.3))
    assert np.median(wrong["robust"]) < 0.25 * np.median(wrong["paper"])


def test_damping_is_never_negative_and_outliers_have_little_pull():
    assert fit_robust(table(kelvin_voigt(b=-1.0)))[0].b_kv == 0.0
    u, v, f = kelvin_voigt()
    f[380:400] += 3.0
    assert fit_robust(table((u, v, f)))[0].k_kv == pytest.approx(200.0, rel=0.03)
    assert abs(fit_paper(table((u, v, f)))[0].k_kv - 200.0) > 2.0


def test_a_press_without_samples_gives_nan_and_harms_no_other():
    above = np.full(50, -1e-3)
    both = table((above, 0 * above, 0 * above), kelvin_voigt())
    for fits in (fit_paper(both), fit_robust(both)):
        assert np.isnan(fits[0].k_v)
        assert fits[1].k_kv == pytest.approx(200.0, rel=1e-6)
