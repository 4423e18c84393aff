"""The tick with a fake clock: deadlines absolute, misses counted, faults zeroed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numba import njit

from benchmarks._elastic_plane import ElasticPlane
from palpate.devices.safety import SafetyOptions, reason_words, safety_parameters
from palpate.devices.virtual_hand import SPEC
from palpate.render.passivity import DISSIPATED, PassivityOptions, passivity_parameters
from palpate.render.scene import TouchScene, in_the_air
from palpate.render.support import SupportParameters, no_support
from palpate.servo import loop as loops
from palpate.servo.layout import BEAT, DEADLINE, ENABLE, LATE, MISSED, STATUS, STOP, TICKS, total_bytes, views
from palpate.servo.loop import ServoLoop, make_program, one_tick, run_tick
from palpate.servo.report import report, ring_rows, snapshot
from palpate.servo.tick import (
    IN_CALIBRATED,
    IN_CONNECTED,
    IN_ENABLED,
    IN_FAULT,
    IN_FORCE_MAP,
    IN_POSITION,
    IN_QUATERNION,
    IN_SEQUENCE,
    IN_TIME,
    IN_TIP,
    IN_WIDTH,
    IN_WORK,
    OUT_FORCE,
    OUT_HOLD,
    TickParameters,
    account,
    put_pose,
    tick_arrays,
)

from ...support.waiting import PATIENCE_S

PERIOD = 1_000_000
START = 10**9


class FakeServo:
    """One tick at a time, at times that the test chooses; the device is well unless told otherwise."""

    def __init__(self, offsets=((0.0, 0.0, 0.0),), support=None, stiffness=500.0) -> None:
        self.shared = views(bytearray(total_bytes()))
        self.arrays = tick_arrays(self.shared, np.array(offsets), np.zeros(3))
        parameters = TickParameters(
            PERIOD,
            200_000,
            safety_parameters(SafetyOptions(), SPEC),
            passivity_parameters(PassivityOptions(), max_damping_n_s_per_m=10.0),
        )
        scene = TouchScene(ElasticPlane(stiffness), support or no_support())
        self.program = make_program(scene, self.arrays, parameters)
        self.arrays.shared.counts[DEADLINE] = START
        self.arrays.shared.control[ENABLE] = 1
        self.sequence = 0
        self.work_j, self.place = 0.0, None
        self.ended = 0

    def pose(self, position, time_s, **cells) -> None:
        """The hand is at `position`; the last command was held on the way."""
        self.sequence += 1
        if np.abs(position).max() < 100.0:
            if self.place is not None:
                held = self.arrays.outbox[OUT_FORCE : OUT_FORCE + 3]
                self.work_j += float(held @ (np.asarray(position) - self.place))
            self.place = np.array(position, dtype=float)
        pose = np.zeros(IN_WIDTH)
        pose[[IN_CONNECTED, IN_CALIBRATED, IN_ENABLED, IN_QUATERNION]] = 1.0
        pose[[IN_FORCE_MAP, IN_FORCE_MAP + 4, IN_FORCE_MAP + 8]] = 1.0
        pose[IN_TIME], pose[IN_SEQUENCE], pose[IN_WORK] = time_s, self.sequence, self.work_j
        pose[IN_POSITION : IN_POSITION + 3] = pose[IN_TIP : IN_TIP + 3] = position
        for name, value in cells.items():
            cell = {"fault": IN_FAULT, "enabled": IN_ENABLED, "connected": IN_CONNECTED}[name]
            pose[cell] = value
        put_pose(self.arrays, pose)

    def due(self, late_ns: int = 0) -> int:
        """ns, when the next tick starts: never before the last one ended."""
        return max(int(self.arrays.shared.counts[DEADLINE]) + late_ns, self.ended)

    def tick(self, late_ns: int = 0, compute_ns: int = 10_000) -> np.ndarray:
        deadline, started = int(self.arrays.shared.counts[DEADLINE]), self.due(late_ns)
        run_tick(self.program, self.arrays, started, deadline)
        self.ended = started + compute_ns
        account(self.arrays, self.program.parameters, deadline, started, self.ended)
        return self.arrays.outbox[OUT_FORCE : OUT_FORCE + 3].copy()

    def press(self, depth_m: float, ticks: int, **cells) -> np.ndarray:
        for _ in range(ticks):
            self.pose([0.0, 0.0, 0.005 - depth_m], self.arrays.shared.counts[DEADLINE] * 1e-9, **cells)
            force = self.tick()
        return force

    def press_in(self, depth_m: float) -> np.ndarray:
        """As a hand does: in the air until force is up, then in, so that the energy is there to be had."""
        self.press(-0.001, 600)
        for depth in np.linspace(0.0, depth_m, 100):
            force = self.press(depth, 1)
        return force

    @property
    def reasons(self) -> str:
        return reason_words(int(snapshotted_reasons(self)))


def snapshotted_reasons(servo: FakeServo) -> float:
    rows, _ = ring_rows(servo.shared, 0)
    return rows["reasons"][-1]


def test_a_rendered_force_reaches_the_device_after_the_ramp():
    servo = FakeServo()
    np.testing.assert_allclose(servo.press(0.002, 600), [0.0, 0.0, 1.0], rtol=1e-9)
    seen = snapshot(servo.shared)
    assert seen.touching[0] and seen.reason == ""
    np.testing.assert_allclose([seen.depths[0], seen.stiffness[0]], [0.002, 500.0])
    np.testing.assert_allclose(seen.command_n, seen.forces_n[0])


def test_deadlines_are_absolute_and_do_not_drift_with_lateness():
    servo = FakeServo()
    for k in range(1000):
        assert servo.arrays.shared.counts[DEADLINE] == START + k * PERIOD
        servo.tick(late_ns=(k * 37_001) % 300_000)
    counts = servo.arrays.shared.counts
    assert counts[TICKS] == 1000 and counts[MISSED] == 0
    assert counts[LATE] == sum((k * 37_001) % 300_000 > 200_000 for k in range(1000))


def test_a_stall_is_counted_as_missed_ticks_and_the_loop_stays_in_phase():
    servo = FakeServo()
    servo.tick()
    servo.tick(late_ns=7_400_000)
    assert servo.arrays.shared.counts[MISSED] == 6
    assert (servo.arrays.shared.counts[DEADLINE] - START) % PERIOD == 0
    rows, _ = ring_rows(servo.shared, 0)
    servo.tick()
    after, head = ring_rows(servo.shared, len(rows))
    assert head == 3 and after["tick"][0] - rows["tick"][-1] == 7
    done = report(servo.shared, PERIOD, (), 0.0, 0.0)
    assert (done.ticks, done.missed_ticks, done.lateness.number) == (3, 6, 3)


def test_a_hand_that_moved_during_a_late_tick_moved_no_faster_and_did_not_jump():
    """0.5 m/s for 40 ms without a tick: 20 mm in one reading."""
    servo = FakeServo()
    for _ in range(200):
        late = 40_000_000 if servo.sequence % 10 == 9 else 0
        now = servo.due(late)
        servo.pose([0.5 * (now - START) * 1e-9 - 0.5, 0.0, 0.1], now * 1e-9)
        servo.tick(late_ns=late)
    assert "too fast" not in servo.reasons and "jumped" not in servo.reasons
    np.testing.assert_allclose(servo.arrays.safety.speed, 0.5, rtol=1e-6)
    np.testing.assert_allclose(servo.arrays.passivity.velocity, [0.5, 0.0, 0.0], rtol=1e-6)


def test_a_force_comes_with_the_time_for_which_it_may_act():
    servo = FakeServo(stiffness=2000.0)
    servo.press_in(0.002)
    stored = 0.5 * 2000.0 * 0.002**2
    pressed = servo.arrays.outbox[OUT_HOLD]
    for depth in 0.002 - 0.0001 * np.arange(8):
        force = servo.press(depth, 1)[2]
    released = servo.arrays.outbox[OUT_HOLD]
    assert 0.0015 <= released < pressed <= 0.02
    # at 0.1 m/s out: what it can give until then is not more than is left
    left = stored + 1e-4 - servo.work_j
    assert force * 0.1 * released < left


def test_a_device_that_stops_talking_gets_zero_after_20_ms():
    servo = FakeServo()
    servo.press_in(0.002)
    servo.press(0.002, 50)
    forces = np.array([servo.tick() for _ in range(40)])
    assert (forces[:19, 2] == forces[0, 2]).all() and forces[0, 2] > 0.99
    assert (forces[21:] == 0).all()
    assert "no fresh pose" in servo.reasons


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_pose_that_is_no_number_gets_zero_and_contact_comes_back_ramped(bad):
    servo = FakeServo()
    servo.press(0.002, 600)
    servo.pose([0.0, bad, 0.003], servo.arrays.shared.counts[DEADLINE] * 1e-9)
    assert (servo.tick() == 0).all()
    assert 0 < servo.press(0.002, 1)[2] < 0.01
    np.testing.assert_allclose(servo.press(0.002, 600)[2], 1.0)


def test_a_fault_zeroes_until_enabled_anew():
    servo = FakeServo()
    servo.press(0.002, 600)
    assert (servo.press(0.002, 1, fault=1.0) == 0).all()
    assert (servo.press(0.002, 1000) == 0).all()
    servo.arrays.shared.control[ENABLE] = 2
    np.testing.assert_allclose(servo.press(0.002, 600)[2], 1.0)


def test_a_clock_that_jumps_back_zeroes_the_force():
    servo = FakeServo()
    servo.press(0.002, 600)
    servo.pose([0.0, 0.0, 0.003], servo.arrays.shared.counts[DEADLINE] * 1e-9 + 3600.0)
    assert (servo.tick() == 0).all()
    assert "clock" in servo.reasons
    assert (servo.press(0.002, 100) == 0).all()


def test_a_held_clutch_feels_nothing():
    servo = FakeServo()
    servo.press(0.002, 600)
    assert servo.press(0.002, 5, enabled=0.0)[2] == 0.0


def test_tips_follow_the_tools_orientation():
    servo = FakeServo(offsets=((0.0, 0.0, 0.0), (0.01, 0.0, 0.0)))
    half = np.sqrt(0.5)
    servo.pose([0.0, 0.0, 0.02], 1.0)
    servo.arrays.inbox[IN_QUATERNION : IN_QUATERNION + 4] = [half, 0.0, half, 0.0]
    servo.tick()
    # a quarter turn about y takes +x to -z
    np.testing.assert_allclose(snapshot(servo.shared).tips, [[0, 0, 0.02], [0, 0, 0.01]], atol=1e-12)


def test_two_tips_add_up():
    servo = FakeServo(offsets=((0.0, 0.0, 0.0), (0.01, 0.0, 0.0)))
    np.testing.assert_allclose(servo.press(0.001, 700)[2], 1.0, rtol=1e-9)


def test_the_support_is_felt_as_a_plane_with_friction():
    support = SupportParameters(np.array([0.0, 0.0, -0.02]), np.array([0.0, 0.0, 1.0]), 1500.0, 2.0, 0.2)
    servo = FakeServo(support=support, stiffness=1e-9)
    force = servo.press_in(0.022)
    np.testing.assert_allclose(force[2], 1500.0 * 0.002, rtol=1e-6)


def test_the_ring_holds_the_last_seconds_and_tells_where_to_go_on():
    servo = FakeServo()
    for _ in range(10_000):
        servo.tick()
    rows, head = ring_rows(servo.shared, 0)
    assert head == 10_000 and 7000 <= len(rows) <= 8192
    assert rows["tick"][-1] == 9999 and (np.diff(rows["tick"]) == 1).all()
    servo.tick()
    more, head = ring_rows(servo.shared, head)
    assert len(more) == 1 and head == 10_001


@njit
def _one_compiled_tick(kernel, model, state, support, arrays, parameters, now_ns):
    one_tick(kernel, model, state, support, arrays, parameters, now_ns, now_ns)


def test_the_loop_of_other_platforms_does_the_same_ticks(monkeypatch):
    compiled, portable = FakeServo(), FakeServo()
    monkeypatch.setattr(loops, "sleep_until", lambda deadline_ns: None)
    for k in range(700):
        now = START + k * PERIOD
        for servo in (compiled, portable):
            servo.pose([0.0, 0.0, 0.005 - 0.002 * np.sin(k / 100.0)], now * 1e-9)
        monkeypatch.setattr(loops, "time", SimpleNamespace(perf_counter_ns=lambda now=now: now))
        loops.portable_tick(portable.program, portable.arrays)
        program = compiled.program
        _one_compiled_tick(
            program.kernel,
            program.scene.renderer.parameters,
            program.state,
            program.scene.support,
            compiled.arrays,
            program.parameters,
            now,
        )
        assert (portable.arrays.outbox[OUT_FORCE:] == compiled.arrays.outbox[OUT_FORCE:]).all()
    assert portable.arrays.outbox[OUT_FORCE + 2] != 0
    assert portable.shared.counts[TICKS] == 700 and portable.shared.counts[MISSED] == 0


def test_the_loop_of_other_platforms_runs_swaps_and_stops(monkeypatch):
    monkeypatch.setattr(loops, "COMPILED", False)
    servo = FakeServo()
    loop = ServoLoop(servo.program, servo.arrays)
    assert loop.wake_descriptor == -1
    loop.start()
    try:
        assert loop.ticked.wait(PATIENCE_S)
        stiffer = servo.program._replace(scene=in_the_air(ElasticPlane(800.0)))
        assert loop.swap(stiffer, timeout_s=PATIENCE_S) and loop.program is stiffer
        before = int(servo.shared.counts[TICKS])
        loop.ticked.clear()
        assert loop.ticked.wait(PATIENCE_S)
        assert servo.shared.counts[TICKS] >= before
    finally:
        servo.shared.control[STOP] = 1
        assert loop.join(PATIENCE_S)
    assert servo.shared.counts[STATUS] == 0


@pytest.mark.parametrize("huge", [1e200, 1e308, -1e154])
def test_one_huge_reading_poisons_nothing(huge):
    servo, fresh = FakeServo(), FakeServo()
    servo.press(0.002, 600)
    for place in ([huge, 0.0, 0.003], [huge, huge, huge]):
        servo.pose(place, servo.arrays.shared.counts[DEADLINE] * 1e-9)
        assert (servo.tick() == 0).all()
    assert np.isfinite(servo.arrays.passivity.velocity).all()
    assert np.isfinite(servo.arrays.passivity.energies).all()
    assert np.isfinite(servo.arrays.safety.speed).all()
    servo.arrays.shared.control[ENABLE] = 2
    servo.press(-0.001, 50)
    fresh.press(-0.001, 50)
    np.testing.assert_allclose(servo.press(0.002, 600), fresh.press(0.002, 600), atol=1e-9)
    for k in range(300):
        servo.press(0.002 - 0.001 * np.cos(0.2 * k), 1)
    # the reference follower's damper acts again: it takes back what held forces owe
    assert servo.arrays.passivity.energies[DISSIPATED] > 0.0


def test_a_jump_in_contact_leaves_no_debt_when_enabled_anew():
    servo = FakeServo()
    servo.press(0.002, 600)
    assert (servo.press(-0.5, 5) == 0).all(), "latched"
    servo.arrays.shared.control[ENABLE] = 2
    servo.press(-0.001, 10)
    np.testing.assert_allclose(servo.press(0.002, 600), [0.0, 0.0, 1.0], rtol=1e-6)
    seen = report(servo.shared, PERIOD, (), 0.0, 0.0)
    assert seen.energy_given_back_j < 1e-4, "a leap of the pose is no work of the hand"


def test_a_force_that_is_none_leaves_the_books_clean():
    servo = FakeServo()
    servo.press(0.002, 600)
    servo.program = servo.program._replace(scene=in_the_air(ElasticPlane(1e300)))
    for _ in range(3):
        assert (servo.press(0.0021, 1) == 0).all()
    servo.program = servo.program._replace(scene=in_the_air(ElasticPlane(500.0)))
    np.testing.assert_allclose(servo.press(0.002, 600), [0.0, 0.0, 1.0], rtol=1e-6)
    assert np.isfinite(servo.arrays.passivity.energies).all()
    assert np.isfinite(report(servo.shared, PERIOD, (), 0.0, 0.0).peak_rendered_n)


def test_a_parent_that_falls_silent_takes_the_force_with_it():
    servo = FakeServo()
    servo.program = servo.program._replace(parameters=servo.program.parameters._replace(silence_s=0.1))
    control = servo.arrays.shared.control
    for _ in range(20):
        control[BEAT] += 1
        force = servo.press(0.002, 50)
    np.testing.assert_allclose(force, [0.0, 0.0, 1.0], rtol=1e-6)
    still = [servo.press(0.002, 1)[2] for _ in range(120)]
    assert min(still[:49]) > 0.99 and not any(still[60:]), "100 ms after the last beat, and a tick"
    assert "does not answer" in servo.reasons
    control[BEAT] += 1
    assert 0 < servo.press(0.002, 1)[2] < 0.01, "ramps in anew"


def test_a_thousand_swaps_while_touching_keep_the_force_within_clamp_and_slew():
    servo, random = FakeServo(stiffness=20_000.0), np.random.default_rng(5)
    servo.press_in(0.002)
    planes = [in_the_air(ElasticPlane(k)) for k in (200.0, 500.0, 3000.0, 20_000.0)]
    forces = [servo.press(0.002, 1) for _ in range(600)]
    for _ in range(1000):
        scene = planes[random.integers(len(planes))]
        servo.program = servo.program._replace(scene=scene)
        forces += [servo.press(0.002, 1) for _ in range(random.integers(1, 4))]
    sizes = np.array(forces)[:, 2]
    safety = servo.program.parameters.safety
    assert sizes.max() <= safety.max_force_n and sizes[600:].min() > 0
    assert np.diff(sizes).max() <= safety.slew_n_per_s * 1e-3 * (1 + 1e-9)
    assert len(np.unique(sizes[600:].round(6))) > 4, "the planes are felt"
