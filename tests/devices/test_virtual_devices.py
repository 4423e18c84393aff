"""The simulated hand, the mouse's channel and the replay: devices without hardware."""

from __future__ import annotations

import pickle
import threading

import numpy as np
import pytest

from palpate.devices.base import ForceSink, PositionSource
from palpate.devices.channel import PoseChannel
from palpate.devices.impedance import HandImpedance
from palpate.devices.intention import FreeExploration, HandPath, minimum_jerk
from palpate.devices.mouse import WINDOW_SILENT_S, MouseDevice
from palpate.devices.registry import DEVICES, DeviceChoice, find_devices, make_device
from palpate.devices.replay import ReplayDevice, ReplayOptions
from palpate.devices.virtual_hand import SimulatedHand, SimulatedOptions
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.recording.recording import Recording

STILL = SimulatedOptions(tremor_m=0.0)


class Clock:
    def __init__(self) -> None:
        self.now = 5.0

    def __call__(self) -> float:
        return self.now


def _rest(height_m: float = 0.0) -> HandPath:
    """A hand that stays where it is."""
    return HandPath(np.zeros(1), np.array([[0.0, 0.0, height_m]]))


def run(hand: SimulatedHand, clock: Clock, seconds: float, force=lambda x: np.zeros(3)) -> list:
    states = []
    for _ in range(round(seconds * 1000)):
        clock.now += 0.001
        states.append(hand.read())
        hand.send_force(force(states[-1].position_m))
    return states


def test_hand_yields_to_a_force_by_its_stiffness() -> None:
    clock = Clock()
    with SimulatedHand(STILL, _rest(), clock=clock) as hand:
        hand.enable_force()
        end = run(hand, clock, 3.0, lambda x: np.array([0.0, 0.0, 3.0]))[-1]
    assert end.position_m == pytest.approx([0, 0, 3.0 / STILL.stiffness_n_per_m], rel=1e-6)


def test_hand_swings_at_its_natural_frequency() -> None:
    """Undamped, the exact step keeps energy and period: no numerical damping hides a loop's instability."""
    impedance = HandImpedance(0.2, 0.0, 500.0)
    x, v, rest = np.array([0.01, 0, 0]), np.zeros(3), np.zeros(3)
    xs = []
    for _ in range(10000):
        x, v = impedance.step(x, v, rest, rest, np.zeros(3))
        xs.append(x[0])
    energy = 0.5 * 0.2 * v @ v + 0.5 * 500 * x @ x
    assert energy == pytest.approx(0.5 * 500 * 1e-4, rel=1e-9)
    crossings = np.flatnonzero(np.diff(np.sign(xs)) > 0)
    period = np.diff(crossings).mean() * 1e-3
    assert period == pytest.approx(2 * np.pi * np.sqrt(0.2 / 500), rel=1e-3)


def test_free_mass_obeys_newton() -> None:
    impedance = HandImpedance(0.5, 0.0, 0.0)
    x, v = np.zeros(3), np.zeros(3)
    for _ in range(1000):
        x, v = impedance.step(x, v, np.zeros(3), np.zeros(3), np.array([1.0, 0, 0]))
    assert v[0] == pytest.approx(2.0) and x[0] == pytest.approx(1.0, rel=1e-6)


def test_force_only_after_enable_and_gone_after_disable() -> None:
    clock = Clock()
    with SimulatedHand(STILL, _rest(), clock=clock) as hand:
        assert isinstance(hand, PositionSource) and isinstance(hand, ForceSink)
        assert not np.any(run(hand, clock, 0.2, lambda x: np.ones(3))[-1].position_m)
        hand.enable_force()
        assert run(hand, clock, 0.2, lambda x: np.ones(3))[-1].position_m[0] > 0
        hand.disable_force()
        assert run(hand, clock, 3.0, lambda x: np.ones(3))[-1].position_m == pytest.approx(
            np.zeros(3), abs=1e-9
        )
        hand.enable_force()
        hand.send_force(np.full(3, np.nan))
        clock.now += 0.01
        assert np.isfinite(hand.read().position_m).all()


def test_same_seed_same_session_bit_for_bit() -> None:
    def session(seed: int) -> np.ndarray:
        clock = Clock()
        with SimulatedHand(clock=clock, seed=seed) as hand:
            hand.enable_force()
            push = lambda x: 300 * max(0.0, 0.06 - np.linalg.norm(x)) * x / np.linalg.norm(x)  # noqa: E731
            return np.array([s.position_m for s in run(hand, clock, 5.0, push)])

    assert (session(3) == session(3)).all()
    assert not (session(3) == session(4)).all()


def test_exploration_presses_to_the_force_it_means_and_comes_back() -> None:
    clock = Clock()
    explorer = FreeExploration(np.zeros(3), 0.1, target_force_n=1.0, seed=1)
    forces = []

    def ball(x: np.ndarray) -> np.ndarray:
        force = 400 * max(0.0, 0.06 - np.linalg.norm(x)) * x / np.linalg.norm(x)
        forces.append(np.linalg.norm(force))
        return force

    with SimulatedHand(STILL, explorer, clock=clock) as hand:
        hand.enable_force()
        states = run(hand, clock, 30.0, ball)
    touching = np.array(forces) > 0
    presses = np.flatnonzero(np.diff(touching.astype(int)) == 1)
    assert len(presses) >= 4
    assert 0.9 < max(forces) < 1.6
    heights = [s.position_m[2] for s in states]
    assert min(heights) > 0, "directions stay within the given spread of 'up'"


@pytest.mark.parametrize("radius_m", [0.02, 0.09, 0.5])
def test_an_exploring_hand_never_hurries(radius_m: float) -> None:
    """Whatever the next direction: its 128th turn once went at 2.1 m/s, faster than its own device allows."""
    explorer = FreeExploration(np.zeros(3), radius_m, speed_m_per_s=1.0, hold_s=0.0, seed=0)
    times = np.arange(0.0, 300.0, 0.004)
    places = np.array([explorer.place(t, np.zeros(3), np.zeros(3)) for t in times])
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / 0.004
    assert speeds.max() < 2.01, "out at twice its own pace"
    around = np.abs(np.linalg.norm(places[:-1], axis=1) - radius_m) < 1e-9
    assert 0.1 < speeds[around].max() <= 1.01


def test_path_reaches_its_waypoints_without_a_jerk() -> None:
    path = HandPath([0.0, 1.0, 2.0], [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0]])
    assert path.place(1.0, None, None) == pytest.approx([0.1, 0, 0])
    assert path.place(9.0, None, None) == pytest.approx([0.1, 0.1, 0])
    assert minimum_jerk(0.5) == pytest.approx(0.5)
    steps = np.diff([path.place(t, None, None) for t in np.linspace(0, 2, 2001)], axis=0)
    assert np.linalg.norm(steps, axis=1).max() == pytest.approx(1.875 * 0.1 / 1000, rel=1e-3)
    with pytest.raises(DeviceError, match="increase"):
        HandPath([0.0, 0.0], np.zeros((2, 3)))


def test_a_pause_is_not_replayed() -> None:
    clock = Clock()
    with SimulatedHand(STILL, HandPath([0.0, 10.0], [[0, 0, 0], [1, 0, 0]], even=True), clock=clock) as hand:
        clock.now += 0.5
        late = hand.read()
        clock.now += 5.0
        later = hand.read()
    assert later.position_m[0] - late.position_m[0] < 0.051
    assert later.time_s == pytest.approx(clock.now)


def test_a_hand_goes_on_during_a_stall_with_the_force_that_it_feels_until_that_expires() -> None:
    clock = Clock()
    free = SimulatedOptions(mass_kg=0.5, damping_n_s_per_m=0.0, stiffness_n_per_m=0.0, tremor_m=0.0)
    with SimulatedHand(free, _rest(), clock=clock) as hand:
        hand.enable_force()
        hand.send_force(np.array([2.0, 0.0, 0.0]), hold_s=0.01)
        clock.now += 0.3
        after = hand.read()
    # 2 N on 0.5 kg for 10 ms, then 290 ms of free flight
    assert after.velocity_m_per_s == pytest.approx([0.04, 0.0, 0.0])
    assert after.position_m[0] == pytest.approx(0.5 * 4.0 * 0.01**2 + 0.04 * 0.29)
    assert hand.work_j == pytest.approx(0.5 * 0.5 * 0.04**2)


def test_channel_carries_the_newest_and_survives_torn_writes() -> None:
    with_file = PoseChannel.create()
    reader = PoseChannel(with_file.path)
    assert reader.read() is None
    with_file.write(1.0, (1, 2, 3), 5)
    assert reader.read().position_m == (1.0, 2.0, 3.0) and reader.read().buttons == 5
    with_file._memory[12:14] = b"xx"  # half of another record
    assert reader.read().position_m == (1.0, 2.0, 3.0)
    with_file.write(2.0, (4, 5, 6))
    assert reader.read().sequence == 2
    with_file.close()
    assert not with_file.path.exists()
    reader.close()


def test_channel_never_mixes_records_under_load() -> None:
    writer = PoseChannel.create()
    reader = PoseChannel(writer.path)
    stop = threading.Event()

    def write() -> None:
        k = 0
        while not stop.is_set():
            k += 1
            writer.write(float(k), (k, k, k), k % 8)

    thread = threading.Thread(target=write)
    thread.start()
    last = 0
    for _ in range(20000):
        pose = reader.read()
        if pose is not None:
            assert len({pose.time_s, *pose.position_m}) == 1 and pose.sequence >= last
            last = pose.sequence
    stop.set()
    thread.join()
    writer.close()
    reader.close()


def test_mouse_follows_smoothly_and_goes_stale_with_its_window() -> None:
    clock = Clock()
    channel = PoseChannel.create()
    with MouseDevice(channel.path, clock=clock) as mouse:
        assert not mouse.read().connected
        channel.write(clock.now, (0, 0, 0))
        assert mouse.read().connected
        path = []
        for k in range(400):
            clock.now += 0.001
            if k % 16 == 0:  # 60 frames a second
                channel.write(clock.now, (0.02 if k > 100 else 0.0, 0, 0), 1)
            path.append(mouse.read())
        xs = np.array([s.position_m[0] for s in path])
        assert xs[-1] == pytest.approx(0.02, abs=1e-4) and xs.max() <= 0.02 + 1e-9
        assert np.abs(np.diff(xs)).max() < 0.001, "the tip does not jump with the frame"
        assert path[-1].buttons == 1
        assert [s.sequence for s in path] == sorted({s.sequence for s in path})
        clock.now += 2 * WINDOW_SILENT_S
        assert not mouse.read().connected and clock.now - mouse.read().time_s > 0.02
    channel.close()
    with pytest.raises(DeviceError, match="window"):
        MouseDevice(clock=clock).open()
    with pytest.raises(DeviceError, match="gone"):
        MouseDevice(channel.path, clock=clock).open()


@pytest.mark.parametrize("frames_per_s", [60.0, 8.0, 2.0])
def test_slow_pictures_make_late_motion_and_no_steps(frames_per_s: float) -> None:
    """A place moved at 40 mm/s, told rarely: the tip goes no faster, between any two ticks."""
    clock = Clock()
    channel = PoseChannel.create()
    with MouseDevice(channel.path, clock=clock) as mouse:
        start, xs, told = clock.now, [], -1
        while clock.now < start + 4.0:
            if int((clock.now - start) * frames_per_s + 1e-6) > told:
                told += 1
                channel.write(clock.now, (0.04 * (clock.now - start), 0, 0), 1)
            clock.now += 0.001
            xs.append(mouse.read().position_m[0])
    channel.close()
    steps = np.diff(xs)
    assert steps.max() < 1.05 * 0.04e-3 and steps[len(steps) // 2 :].min() > 0.9 * 0.04e-3
    assert np.abs(np.diff(steps)).max() < 0.25 * 0.04e-3, "and its speed changes smoothly"
    assert xs[-1] == pytest.approx(0.16, abs=0.04 * (0.05 + 2.0 / frames_per_s))


def _recording() -> Recording:
    t = np.arange(200) * 1e-3
    position = np.column_stack([0.1 * t, 0 * t, np.round(0.05 * t / 3e-5) * 3e-5])
    return Recording(t + 7.0, position, np.zeros((200, 3)), 1000.0, 0.004)


def test_replay_gives_the_sample_of_its_time() -> None:
    clock, recording = Clock(), _recording()
    with ReplayDevice(recording, clock=clock) as device:
        for k in range(200):
            state = device.read()
            assert state.sequence == k and (state.position_m == recording.position[k]).all()
            clock.now += 0.001
        assert device.read().sequence == 199
    middle = device.recording.t[100] - 7.0
    device = ReplayDevice(recording, ReplayOptions(start_s=middle, loop=True), clock=clock)
    with device:
        assert device.read().sequence == 100
        assert device.read().velocity_m_per_s == pytest.approx([0.1, 0, 0.05], abs=0.005)
        last = -1
        for _ in range(500):
            sequence = device.read().sequence
            assert sequence >= last
            last = sequence
            clock.now += 0.001
        assert last > 200  # it began again
    with pytest.raises(DeviceError, match="outside"):
        ReplayDevice(recording, ReplayOptions(start_s=99.0))


def test_registry() -> None:
    with pytest.raises(DeviceError, match="mouse, spacemouse"):
        make_device("dataglove")
    choice = DeviceChoice("simulated", {"intention": _rest(0.1), "seed": 2})
    again = pickle.loads(pickle.dumps(choice))
    with again.make() as device:
        assert device.read().position_m[2] == pytest.approx(0.1, abs=1e-3)
    found = find_devices()
    assert {a.spec.name for a in found} == set(DEVICES)
    for line in found:
        assert line.present or (line.why_not and line.remedy)
