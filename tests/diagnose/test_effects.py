"""Every effect of the contract is in the library, vanishes at its ideal values and changes the force
elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.search.fit import settings_of
from palpate.mechanics.effects.base import Role, Scope
from palpate.mechanics.effects.registry import NAMES, effect, effects
from palpate.mechanics.errors import OptionError

CONTRACT = {
    "viscoelasticity": {"g", "tau_s"},
    "power_law_relaxation": {"share", "exponent"},
    "poroelasticity": {"share", "diffusivity_m2_per_s"},
    "mullins_softening": {"r", "m_rel"},
    "strain_stiffening": {"c20_over_c10"},
    "poisson_ratio": {"poisson_ratio"},
    "inclusion": {"centre_m", "radius_m", "modulus_ratio"},
    "modulus_gradient": {"ratio_base", "ratio_top"},
    "skin_layer": {"thickness_m", "modulus_ratio"},
    "stiffness_field": {"length_m", "places_m", "ratio"},
    "unbonded_base": {"bonded_fraction", "direction"},
    "compliant_base": {"k_normal_pa_per_m", "k_tangential_pa_per_m"},
    "surface_offset": {"shift_m", "rotation_rad"},
    "tip_radius": {"tip_radius_m"},
    "friction_slip": {"mu"},
    "adhesion": {"pull_off_n", "range_m", "inside"},
    "jkr_adhesion": {"work_j_per_m2", "healed", "range_m"},
    "tool_compliance": {"stiffness_n_per_m"},
    "force_bias": {"bias_n"},
    "force_drift": {"rate_n_per_s"},
    "force_gain": {"matrix"},
    "tool_gravity_inertia": {"mass_kg", "tared"},
    "time_delay": {"delay_s"},
    "backlash": {"width_m"},
}


@pytest.fixture(scope="module")
def forward(bench):
    recording, model = bench.record()
    return build_forward(touches_of(model.presses), model)


MODULUS = 20e3


def test_every_name_of_the_contract_is_an_effect():
    assert {*CONTRACT, "finite_strain", "surface_shape"} <= set(NAMES) and len(set(NAMES)) == len(NAMES)
    assert [e.name for e in effects()] == list(NAMES)
    assert all(e.domain in ("object", "contact", "boundary", "instrument") for e in effects())


def test_instruments_are_corrected_and_the_others_rendered():
    for each in effects():
        assert not (each.rendered and each.domain == "instrument"), each.name
        assert each.correct is None or each.domain == "instrument", each.name
    ours = [effect(name) for name in (*CONTRACT, "finite_strain", "surface_shape")]
    assert {e.name for e in ours if not e.rendered and e.domain != "instrument"} == {
        "surface_shape", "surface_offset",
    }  # fmt: skip
    assert {e.name for e in ours if e.domain == "instrument" and e.correct is None} == {"backlash"}


def test_what_free_air_settles_is_on_every_reading():
    for each in effects():
        assert (each.role is Role.FREE_AIR) == (each.scope is Scope.READING), each.name
    assert [e.name for e in effects() if e.role is Role.KNOWN] == ["finite_strain"]


def test_unknown_name_lists_what_is_allowed():
    with pytest.raises(OptionError, match="time_delay"):
        effect("telekinesis")


@pytest.mark.parametrize(
    "name", [n for n in NAMES if n in CONTRACT and n not in ("unbonded_base", "poisson_ratio")]
)
def test_ideal_values_change_nothing_and_starts_do(forward, name):
    chosen = effect(name)
    ideal = forward.predict(settings_of(forward, [], np.array([np.log(MODULUS)])))
    values = np.concatenate([[np.log(MODULUS)], chosen.ideal])
    scale = np.abs(ideal).max()
    # a stick that may slide at 1.5 F is not quite a stick; everything else vanishes exactly
    tolerance = 2e-2 if name == "friction_slip" else 1e-6
    assert np.abs(forward.predict(settings_of(forward, [chosen], values)) - ideal).max() < tolerance * scale
    start = chosen.starts()[0].astype(float).copy()
    if name in ("force_bias", "force_drift", "surface_offset"):
        start[:3] = 2e-3
    if name == "force_gain":
        start[1] = 0.1
    if name == "tool_gravity_inertia":
        start[:] = (0.05, 1.0)
    if name == "inclusion":
        start[:3] = (0.0, 0.0, 0.02)  # where a ball lies inside
    moved = forward.predict(settings_of(forward, [chosen], np.concatenate([[np.log(MODULUS)], start])))
    assert np.abs(moved - ideal).max() > 1e-3 * scale
    assert set(chosen.report(start, forward, MODULUS)) == CONTRACT[name]


def test_delay_is_a_shift_in_time(forward):
    t = forward.touches
    plain = forward.predict(forward.ideal(MODULUS))
    values = np.array([np.log(MODULUS), 0.02])
    late = forward.predict(settings_of(forward, [effect("time_delay")], values))
    step = np.median(np.diff(t.t[: t.starts[1]]))
    rows = slice(t.starts[1] + 2, t.starts[2])
    before = slice(t.starts[1], t.starts[2] - 2)
    assert step == pytest.approx(0.01, rel=1e-6)
    np.testing.assert_allclose(late[rows], plain[before], atol=1e-12)


def test_relaxation_decays_by_its_time_constant(forward):
    values = np.array([np.log(MODULUS), 0.5, np.log(0.1), 0.0, 0.0])
    memory = settings_of(forward, [effect("viscoelasticity")], values)
    plain, slow = forward.predict(forward.ideal(MODULUS)), forward.predict(memory)
    t = forward.touches
    press = int(
        np.argmax([(t.phase[a:b] == 1).sum() for a, b in zip(t.starts[:-1], t.starts[1:], strict=True)])
    )
    hold = np.flatnonzero((t.press == press) & (np.abs(t.speed) < 1e-4) & (t.travel[:, 0] > 1e-3))[4:-4]
    extra = slow[hold, 0] - plain[hold, 0]
    decay = np.polyfit(t.t[hold], np.log(extra), 1)[0]
    assert decay == pytest.approx(-10.0, rel=0.05)


def test_springs_of_a_base_are_stated_for_the_fitted_modulus(forward):
    """Twice the modulus on the same compliance of the height: springs twice as stiff."""
    base = effect("compliant_base")
    one, two = (base.report(np.log([0.2, 0.5]), forward, e) for e in (MODULUS, 2 * MODULUS))
    assert one["k_normal_pa_per_m"] == pytest.approx(MODULUS / (0.2 * 0.04))
    assert one["k_tangential_pa_per_m"] == pytest.approx(0.5 * one["k_normal_pa_per_m"])
    assert two["k_normal_pa_per_m"] == pytest.approx(2 * one["k_normal_pa_per_m"])


def test_drift_is_counted_from_the_recordings_start(forward, bench):
    """What is added to a prediction is what is taken off a recording."""
    drift, rate = effect("force_drift"), np.array([1e-3, -2e-3, 3e-3])
    plain = forward.predict(forward.ideal(MODULUS))
    drifted = forward.predict(settings_of(forward, [drift], np.concatenate([[np.log(MODULUS)], rate])))
    frame = forward.touches.frame[forward.press]
    added = np.einsum("nji,nj->ni", frame, drifted - plain)
    np.testing.assert_allclose(added, forward.t[:, None] * rate, atol=1e-9)
    recording, _ = bench.record()
    taken = recording.force_on_tool - drift.correct(recording, {"rate_n_per_s": rate}).force_on_tool
    np.testing.assert_allclose(taken, recording.t[:, None] * rate, atol=1e-12)
