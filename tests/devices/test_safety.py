"""The safety filter: every rule by itself, and every fault bounded."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.devices.base import DeviceSpec
from palpate.devices.safety import RawPose, SafetyOptions
from palpate.mechanics.errors import OptionError

from .filtering import SafetyFilter

SPEC = DeviceSpec(
    name="test",
    title="test device",
    actuated_axes=("x", "y", "z"),
    max_force_n=8.0,
    max_stiffness_n_per_m=3000.0,
    max_damping_n_s_per_m=10.0,
    max_speed_m_per_s=1.0,
    workspace_radius_m=0.1,
)
DT = 0.001
PUSH = np.array([0.0, 0.0, 2.0])


class Session:
    """A filter, and a device that is well unless a test says otherwise."""

    def __init__(self, **options: float) -> None:
        self.filter = SafetyFilter(SafetyOptions(**options), SPEC)
        self.sequence = 0
        self.enable = 1
        self.forces: list[np.ndarray] = []

    def tick(self, wanted=PUSH, *, dt=DT, fresh=True, **reading) -> tuple[np.ndarray, str]:
        self.sequence += fresh
        values = {
            "position": np.zeros(3),
            "velocity": np.zeros(3),
            "age_s": 0.0005,
            "sequence": self.sequence,
            "connected": True,
            "calibrated": True,
            "fault": False,
        } | reading
        force, why = self.filter.step(np.asarray(wanted, float), RawPose(**values), self.enable, dt)
        self.forces.append(force)
        return force, why

    def ramped(self) -> Session:
        for _ in range(510):
            self.tick()
        return self


def test_a_healthy_force_passes_unchanged_after_the_ramp():
    session = Session().ramped()
    session.tick([1.0, -2.0, 0.5])
    force, why = session.tick([1.0, -2.0, 0.5])
    np.testing.assert_allclose(force, [1.0, -2.0, 0.5])
    assert why == ""


def test_force_rises_evenly_over_half_a_second_after_enabling():
    session = Session()
    sizes = np.array([session.tick()[0][2] for _ in range(600)])
    np.testing.assert_allclose(sizes[249], 1.0, atol=0.01)
    np.testing.assert_allclose(sizes[499:], 2.0)
    assert np.diff(sizes).max() < 0.0041


def test_the_clamp_keeps_the_direction():
    session = Session().ramped()
    for _ in range(20):
        force, why = session.tick([30.0, -40.0, 0.0])
    np.testing.assert_allclose(force, 8.0 * np.array([0.6, -0.8, 0.0]))
    assert "clamped" in why


def test_a_lower_limit_of_the_user_counts_and_a_higher_one_does_not():
    for own, expected in ((3.0, 3.0), (100.0, 8.0)):
        session = Session(max_force_n=own).ramped()
        for _ in range(20):
            force, _ = session.tick([0.0, 0.0, 50.0])
        np.testing.assert_allclose(np.linalg.norm(force), expected)


def test_force_rises_and_turns_slowly_but_falls_at_once():
    session = Session(slew_n_per_s=500.0).ramped()
    force, why = session.tick([0.0, 0.0, 6.0])
    np.testing.assert_allclose(force, [0, 0, 2.5])
    assert "rise" in why
    for _ in range(20):
        session.tick([0.0, 0.0, 6.0])
    force, why = session.tick([0.0, 0.0, 1.0])
    np.testing.assert_allclose(force, [0, 0, 1.0])
    assert why == ""
    force, _ = session.tick([0.0, 0.0, -6.0])
    np.testing.assert_allclose(force, [0, 0, -0.5])


def test_the_force_never_leaves_the_bounds_whatever_is_wanted():
    session, random = Session(slew_n_per_s=1000.0), np.random.default_rng(3)
    for _ in range(3000):
        session.tick(random.normal(size=3) * 10.0 ** random.uniform(-2, 6))
    forces = np.array(session.forces)
    assert np.linalg.norm(forces, axis=1).max() <= 8.0 + 1e-9
    sizes = np.linalg.norm(forces, axis=1)
    assert np.diff(sizes).max() <= 1.0 + 1e-9


PASSING = {
    "force is NaN": {"wanted": [np.nan, 0, 0]},
    "force is infinite": {"wanted": [0, np.inf, 0]},
    "pose is NaN": {"position": np.array([0.0, np.nan, 0.0])},
    "pose is stale": {"age_s": 0.021, "fresh": False},
    "age is NaN": {"age_s": np.nan},
    "outside the workspace": {"position": np.array([0.0, 0.0, 0.106])},
}
LATCHING = {
    "unplugged": {"connected": False},
    "calibration lost": {"calibrated": False},
    "the device reports a fault": {"fault": True},
    "told over-speed": {"velocity": np.array([0.0, 1.2, 0.0])},
    "pose jumps": {"position": np.array([0.0, 0.0, 0.02])},
    "sequence runs backwards": {"sequence": 3},
    "pose from the future": {"age_s": -0.5},
    "time runs backwards": {"dt": -0.001},
    "time is NaN": {"dt": np.nan},
}


@pytest.mark.parametrize("fault", PASSING)
def test_a_passing_fault_gives_zero_at_once_and_then_a_fresh_ramp(fault):
    session = Session().ramped()
    if fault == "outside the workspace":
        for z in np.linspace(0.0, 0.1055, 300):
            session.tick(position=np.array([0.0, 0.0, z]))
    force, why = session.tick(**PASSING[fault])
    assert (force == 0).all() and why
    if fault == "outside the workspace":
        for z in np.linspace(0.1055, 0.0, 300):
            session.tick(position=np.array([0.0, 0.0, z]))
    first, _ = session.tick()
    assert np.linalg.norm(first) < 1.3
    for _ in range(600):
        force, why = session.tick()
    np.testing.assert_allclose(force, PUSH)
    assert why == ""


@pytest.mark.parametrize("fault", LATCHING)
def test_a_latching_fault_gives_zero_until_force_is_enabled_anew(fault):
    session = Session().ramped()
    force, why = session.tick(**LATCHING[fault])
    assert (force == 0).all() and why
    for _ in range(2000):
        force, why = session.tick()
        assert (force == 0).all()
    assert why
    session.enable = 2
    force, why = session.tick()
    assert 0 < np.linalg.norm(force) < 0.01
    assert why == "ramping in"


def test_over_speed_is_also_seen_in_the_positions_alone():
    session = Session().ramped()
    for k in range(40):
        force, why = session.tick(position=np.array([0.0015 * k, 0.0, 0.0]))
    assert (force == 0).all()
    assert "too fast" in why


def test_one_coarse_encoder_step_is_no_over_speed():
    session = Session().ramped()
    for k in range(500):
        force, why = session.tick(position=np.array([0.001 * ((k // 100) % 2), 0.0, 0.0]))
        assert why == ""
    np.testing.assert_allclose(force, PUSH)


def test_a_slow_device_is_not_taken_for_a_jumping_one():
    session = Session().ramped()
    for k in range(200):
        fresh = k % 10 == 0
        place = np.array([0.0004 * (k - k % 10), 0.0, 0.0])
        _, why = session.tick(position=place, fresh=fresh, age_s=0.001 * (k % 10))
        assert why == ""


def test_no_force_before_enabling_nor_while_uncalibrated():
    session = Session()
    session.enable = 0
    for _ in range(100):
        assert (session.tick()[0] == 0).all()
    session.enable = 1
    for _ in range(100):
        assert (session.tick(calibrated=False)[0] == 0).all()


def test_a_frozen_device_gets_no_more_than_the_force_of_its_last_pose():
    session = Session().ramped()
    for k in range(100):
        force, why = session.tick(fresh=False, age_s=0.001 * k)
        np.testing.assert_allclose(force, PUSH if k <= 20 else 0.0)
    assert "no fresh pose" in why


def test_force_fades_over_the_last_twentieth_beyond_the_workspace():
    session = Session().ramped()
    for z in np.linspace(0.0, 0.1025, 300):
        force, why = session.tick(position=np.array([0.0, 0.0, z]))
    np.testing.assert_allclose(np.linalg.norm(force), 1.0, rtol=1e-6)
    assert "fading" in why


def test_a_device_without_force_gets_none():
    spec = DeviceSpec(name="mouse", title="mouse")
    unit = SafetyFilter(SafetyOptions(), spec)
    for k in range(600):
        reading = RawPose(np.full(3, 5.0), np.zeros(3), 0.0, k, True, True, False)
        force, _ = unit.step(PUSH, reading, 1, DT)
        assert (force == 0).all()


@pytest.mark.parametrize("field", ["slew_n_per_s", "ramp_s", "max_force_n", "workspace_radius_m"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_options_are_refused(field, value):
    with pytest.raises(OptionError, match=field):
        SafetyOptions(**{field: value})
