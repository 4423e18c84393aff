"""Uniaxial models: exact on exact data, bounded and steady on bad data, the condition of (4) reported."""

import numpy as np
import pytest

from reconstruct.one_d import Press, fit_paper, fit_robust, predicted


def press(k=400.0, b=6.0, r=1.3, deep=0.008, noise=0.0, seed=0) -> Press:
    t = np.linspace(0, 1, 800)
    u = deep * np.sin(np.pi * t) ** 2 + 1e-4
    v = np.gradient(u, t)
    f = u**r * (k + b * v) + noise * np.random.default_rng(seed).standard_normal(len(t))
    return Press(u, v, f)


def kelvin_voigt(k=200.0, b=1.5) -> Press:
    p = press()
    return Press(p.u, p.v, k * p.u + b * p.v)


@pytest.mark.parametrize("fit", [fit_paper, fit_robust])
def test_kelvin_voigt_is_recovered(fit):
    found = fit([kelvin_voigt()])[0]
    assert found.k_kv == pytest.approx(200.0, rel=1e-6)
    assert found.b_kv == pytest.approx(1.5, rel=1e-6)


@pytest.mark.parametrize(("fit", "tolerance"), [(fit_paper, 0.02), (fit_robust, 0.03)])
def test_hunt_crossley_is_recovered_when_slow(fit, tolerance):
    found = fit([press()])[0]
    assert found.r_hc == pytest.approx(1.3, rel=tolerance)
    assert predicted(press(), found.k_hc, found.b_hc, found.r_hc) == pytest.approx(press().f, abs=5e-3)
    assert found.valid


def test_the_condition_of_equation_four_is_reported():
    found = fit_paper([press(k=400.0, b=4e5)])[0]
    assert not found.valid
    assert found.slow < 1.0


def test_undamped_forms_and_the_mean_exponent():
    presses = [press(b=0.0, r=r) for r in (1.1, 1.5)]
    for fits in (fit_paper(presses), fit_robust(presses)):
        assert [f.r_c for f in fits] == pytest.approx([1.1, 1.5], abs=0.01)
        # at the mean exponent 1.3 the same force at typical depth: k_h lies on either side of 400
        assert fits[0].k_h > 400 > fits[1].k_h
        assert fits[0].k_v > fits[1].k_v


def test_logarithms_are_led_astray_by_noise_where_the_robust_fit_is_not():
    clean = press(b=0.0)
    wrong = {"paper": [], "robust": []}
    for seed in range(8):
        noisy = press(b=0.0, noise=0.02, seed=seed)
        inside = noisy.f > 0.005
        noisy = Press(noisy.u[inside], noisy.v[inside], noisy.f[inside])
        for name, fit in (("paper", fit_paper), ("robust", fit_robust)):
            wrong[name].append(abs(fit([noisy])[0].r_c - 1.3))
    assert np.median(wrong["robust"]) < 0.25 * np.median(wrong["paper"])
    assert len(clean.u)


def test_damping_is_never_negative_and_outliers_have_little_pull():
    p = kelvin_voigt(b=-1.0)
    assert fit_robust([p])[0].b_kv == 0.0
    good = kelvin_voigt()
    f = good.f.copy()
    f[380:400] += 3.0
    assert fit_robust([Press(good.u, good.v, f)])[0].k_kv == pytest.approx(200.0, rel=0.03)
    assert abs(fit_paper([Press(good.u, good.v, f)])[0].k_kv - 200.0) > 2.0


def test_a_press_without_samples_gives_nan_and_harms_no_other():
    empty = Press(np.zeros(0), np.zeros(0), np.zeros(0))
    for fits in (fit_paper([empty, kelvin_voigt()]), fit_robust([empty, kelvin_voigt()])):
        assert np.isnan(fits[0].k_v)
        assert fits[1].k_kv == pytest.approx(200.0, rel=1e-6)
