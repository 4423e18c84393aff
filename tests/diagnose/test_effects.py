"""Every effect of the contract is in the library, vanishes at its ideal values and changes the force
elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from diagnose.effects.base import DOMAINS
from diagnose.fit import settings_of
from diagnose.forward import build_forward
from diagnose.library import NAMES, effect, library
from diagnose.touches import touches_of
from mechanics.errors import OptionError

CONTRACT = {
    "viscoelasticity": {"g", "tau_s"},
    "mullins_softening": {"r", "m_rel"},
    "strain_stiffening": {"c20_over_c10"},
    "poisson_ratio": {"poisson_ratio"},
    "inclusion": {"centre_m", "radius_m", "modulus_ratio"},
    "modulus_gradient": {"ratio_base", "ratio_top"},
    "skin_layer": {"thickness_m", "modulus_ratio"},
    "unbonded_base": {"bonded_fraction", "direction"},
    "compliant_base": {"k_normal_pa_per_m", "k_tangential_pa_per_m"},
    "surface_offset": {"shift_m", "rotation_rad"},
    "tip_radius": {"tip_radius_m"},
    "friction_slip": {"mu"},
    "adhesion": {"pull_off_n", "range_m"},
    "tool_compliance": {"stiffness_n_per_m"},
    "force_bias": {"bias_n"},
    "force_drift": {"rate_n_per_s"},
    "force_gain": {"matrix"},
    "tool_gravity_inertia": {"mass_kg", "tared"},
    "time_delay": {"delay_s"},
    "backlash": {"width_m"},
}


@pytest.fixture(scope="module")
def forward(bench):  # type: ignore[no-untyped-def]
    recording, model = bench.record()
    return build_forward(touches_of(model.presses), model)


def test_all_22_names():
    assert len(NAMES) == 22 and len(set(NAMES)) == 22
    assert all(e.domain in DOMAINS for e in library())


def test_unknown_name_lists_what_is_allowed():
    with pytest.raises(OptionError, match="time_delay"):
        effect("telekinesis")


@pytest.mark.parametrize(
    "name", [n for n in NAMES if n in CONTRACT and n not in ("unbonded_base", "poisson_ratio")]
)
def test_ideal_values_change_nothing_and_starts_do(forward, name):
    chosen = effect(name)
    ideal = forward.predict(settings_of(forward, [], np.array([np.log(20e3)])))
    values = np.concatenate([[np.log(20e3)], chosen.ideal])
    scale = np.abs(ideal).max()
    # a stick that may slide at 1.5 F is not quite a stick; everything else vanishes exactly
    tolerance = 2e-2 if name == "friction_slip" else 1e-6
    assert np.abs(forward.predict(settings_of(forward, [chosen], values)) - ideal).max() < tolerance * scale
    start = chosen.starts(forward)[0].astype(float).copy()
    if name in ("force_bias", "force_drift", "surface_offset"):
        start[:3] = 2e-3
    if name == "force_gain":
        start[1] = 0.1
    if name == "tool_gravity_inertia":
        start[:] = (0.05, 1.0)
    moved = forward.predict(settings_of(forward, [chosen], np.concatenate([[np.log(20e3)], start])))
    assert np.abs(moved - ideal).max() > 1e-3 * scale
    assert set(chosen.report(start, forward)) == CONTRACT[name]


def test_delay_is_a_shift_in_time(forward):
    t = forward.touches
    plain = forward.predict(forward.ideal(20e3))
    settings = forward.ideal(20e3)
    settings.delay = 0.02
    late = forward.predict(settings)
    step = np.median(np.diff(t.t[: t.starts[1]]))
    rows = slice(t.starts[1] + 2, t.starts[2])
    before = slice(t.starts[1], t.starts[2] - 2)
    assert step == pytest.approx(0.01, rel=1e-6)
    np.testing.assert_allclose(late[rows], plain[before], atol=1e-12)


def test_relaxation_decays_by_its_time_constant(forward):
    settings = forward.ideal(20e3)
    settings.g, settings.tau = np.array([0.5]), np.array([0.1])
    plain, slow = forward.predict(forward.ideal(20e3)), forward.predict(settings)
    t = forward.touches
    press = int(
        np.argmax([(t.phase[a:b] == 1).sum() for a, b in zip(t.starts[:-1], t.starts[1:], strict=True)])
    )
    hold = np.flatnonzero((t.press == press) & (np.abs(t.speed) < 1e-4) & (t.y[:, 0] > 1e-3))[4:-4]
    extra = slow[hold, 0] - plain[hold, 0]
    decay = np.polyfit(t.t[hold], np.log(extra), 1)[0]
    assert decay == pytest.approx(-10.0, rel=0.05)
