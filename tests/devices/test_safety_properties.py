"""The safety filter under any sequence of poses, forces and clocks: bounded, and as new when enabled anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.devices.base import DeviceSpec
from palpate.devices.safety import LATCHING, SILENT, RawPose, SafetyOptions, safety_parameters, safety_step
from palpate.mechanics.errors import DeviceError, OptionError

from .filtering import SafetyFilter
from .test_safety import DT, PUSH, SPEC, Session

HARD = settings(max_examples=60, deadline=None)
SLEW = SafetyOptions().slew_n_per_s

wild = st.one_of(
    st.sampled_from([0.0, np.nan, np.inf, -np.inf, 1e154, 1.4e154, -1e200, 1e308, -1e308, 5e-324, 0.5]),
    st.floats(-0.2, 0.2),
    st.floats(allow_nan=True, allow_infinity=True),
)
vector = st.tuples(wild, wild, wild)
tick = st.fixed_dictionaries(
    {
        "wanted": vector,
        "position": vector,
        "velocity": st.one_of(st.just((0.0, 0.0, 0.0)), vector),
        "age_s": st.one_of(st.just(0.0005), wild),
        "dt": st.one_of(st.just(DT), wild),
        "fresh": st.integers(-2, 3),
        "enable": st.integers(0, 3),
        "well": st.booleans() | st.just(True),
    }
)


class Wild:
    """A filter driven by hypothesis' ticks; every step is checked against clamp and slew."""

    def __init__(self) -> None:
        self.filter = SafetyFilter(SafetyOptions(), SPEC)
        self.sequence = 1000

    def step(self, one: dict) -> None:
        self.sequence += one["fresh"]
        before = self.filter.state.force.copy()
        reading = RawPose(
            np.array(one["position"]),
            np.array(one["velocity"]),
            one["age_s"],
            self.sequence,
            one["well"],
            True,
            False,
        )
        force, _ = self.filter.step(np.array(one["wanted"]), reading, one["enable"], one["dt"])
        assert np.isfinite(force).all()
        assert np.linalg.norm(force) <= SPEC.max_force_n * (1 + 1e-12)
        # from the nearest place between zero and the last force, no further than slew allows in the tick
        dt = one["dt"] if np.isfinite(one["dt"]) and one["dt"] > 0 else 0.0
        share = np.clip(force @ before / max(before @ before, 1e-300), 0.0, 1.0)
        assert np.linalg.norm(force - share * before) <= SLEW * min(dt, 0.005) * (1 + 1e-9) + 1e-12

    def good(self, enable: int, number: int) -> list[np.ndarray]:
        forces = []
        for _ in range(number):
            self.sequence += 1
            reading = RawPose(np.zeros(3), np.zeros(3), 0.0005, self.sequence, True, True, False)
            forces.append(self.filter.step(PUSH, reading, enable, DT)[0])
        return forces


@HARD
@given(st.lists(tick, max_size=30))
def test_any_sequence_stays_bounded_and_enabling_anew_is_a_fresh_start(ticks):
    unit, fresh = Wild(), Wild()
    for one in ticks:
        unit.step(one)
    np.testing.assert_array_equal(unit.good(9, 40), fresh.good(9, 40))


POISON = {
    "one pose of 1e200 m": {"position": np.array([1e200, 0.0, 0.0])},
    "one pose of 1e308 m": {"position": np.full(3, 1e308)},
    "an outward jump of 0.5 m": {"position": np.array([0.0, 0.0, 0.5])},
    "one speed of 1e300 m/s": {"velocity": np.full(3, 1e300)},
    "one force of 1e308 N": {"wanted": [1e308, 1e308, 1e308]},
}


@pytest.mark.parametrize("poison", POISON)
def test_over_speed_still_trips_after_poison_and_enabling_anew(poison):
    session = Session().ramped()
    force, why = session.tick(**POISON[poison])
    assert (force == 0).all() and why
    session.enable = 2
    for _ in range(600):
        force, why = session.tick()
    np.testing.assert_allclose(force, PUSH)
    for k in range(40):
        force, why = session.tick(position=np.array([0.0015 * k, 0.0, 0.0]))
    assert (force == 0).all() and "too fast" in why


@pytest.mark.parametrize("bad", [np.nan, np.inf, -0.001, 0.0])
def test_bad_clocks_in_a_row_latch_at_zero_force(bad):
    session = Session().ramped()
    for _ in range(3):
        force, why = session.tick(dt=bad)
        assert (force == 0).all() and "clock" in why
    assert (session.tick()[0] == 0).all()


def test_a_very_long_tick_skips_neither_ramp_nor_slew():
    session = Session()
    force, _ = session.tick(dt=1e300)
    assert np.linalg.norm(force) <= 0.2 * 2.0 + 1e-12


def test_a_fault_of_the_caller_zeroes_and_ramps_in_again():
    session = Session().ramped()
    unit, reading = session.filter, None
    for k in range(3):
        reading = RawPose(np.zeros(3), np.zeros(3), 0.0005, 1000 + k, True, True, False)
        reasons = safety_step(unit.parameters, unit.state, PUSH, reading, 1, DT, SILENT)
        assert reasons & SILENT and not reasons & LATCHING and not unit.state.force.any()
    session.sequence = 1002
    assert 0 < np.linalg.norm(session.tick()[0]) < 0.01


@pytest.mark.parametrize("where", ["wanted", "position", "velocity"])
def test_a_vector_of_two_is_refused(where):
    with pytest.raises(DeviceError, match=r"\(2,\)"):
        Session().tick(**{where: np.zeros(2)})


@pytest.mark.parametrize(
    ("limit", "value"),
    [(name, v) for name in ("workspace_radius_m", "max_speed_m_per_s") for v in (0.0, -1.0, np.nan, np.inf)]
    + [("max_force_n", np.inf)],
)
def test_a_device_without_a_limit_is_refused(limit, value):
    with pytest.raises(OptionError, match=limit):
        safety_parameters(SafetyOptions(), replace(SPEC, **{limit: value}))


def test_a_workspace_of_no_size_gives_no_force_even_past_the_check():
    session = Session()
    session.filter.parameters = session.filter.parameters._replace(workspace_radius_m=0.0)
    for _ in range(600):
        assert (session.tick(position=np.full(3, 1e-6))[0] == 0).all()


@pytest.mark.parametrize(
    ("field", "value"),
    [("stale_s", 1e9), ("jump_m", 1e9), ("slew_n_per_s", 1e300), ("ramp_s", 1e-300), ("max_force_n", 1e9)],
)
def test_no_option_switches_a_protection_off(field, value):
    with pytest.raises(OptionError, match=f"{field}.*allowed are numbers"):
        SafetyOptions(**{field: value})


def test_a_device_that_has_no_force_needs_no_limits():
    assert safety_parameters(SafetyOptions(), DeviceSpec("mouse", "mouse")).max_force_n == 0.0
