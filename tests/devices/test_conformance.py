"""What every driver with hardware behind it must do, each against its emulator."""

from __future__ import annotations

import signal
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import numpy as np
import pytest

from palpate.devices.base import DeviceSpec, ForceSink, PositionSource, host_clock
from palpate.devices.safety import RawPose, SafetyOptions
from palpate.mechanics.errors import DeviceError

from ..support.waiting import PATIENCE_S
from .benches import FORCEFUL, MAKERS, Bench, eventually
from .filtering import SafetyFilter

PLACE = np.array([0.02, 0.01, 0.03])
PUSH = np.array([1.0, -0.5, 2.0])


@pytest.fixture(params=list(MAKERS))
def bench(request: pytest.FixtureRequest, tmp_path: Path) -> Bench:
    made = MAKERS[request.param](tmp_path)
    yield made
    made.hang(False)
    made.close()


@pytest.fixture(params=FORCEFUL)
def forceful(request: pytest.FixtureRequest, tmp_path: Path) -> Bench:
    made = MAKERS[request.param](tmp_path)
    yield made
    made.hang(False)
    made.close()


def on_axes(bench: Bench, vector: np.ndarray) -> np.ndarray:
    """The part of a force that the device has axes for."""
    return np.array([v if a in bench.axes else 0.0 for v, a in zip(vector, "xyz", strict=True)])


def ready(bench: Bench) -> None:
    """Open, with a first reading."""
    bench.device.open()
    bench.move(PLACE)
    assert eventually(lambda: bench.device.read().sequence >= 0 and bench.device.read().connected)


class Pusher:
    """A caller that sends the same force at 1 kHz, as the servo does."""

    def __init__(self, device: ForceSink, force: np.ndarray) -> None:
        self.device, self.force = device, force
        self.stopped = threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)

    def _run(self) -> None:
        while not self.stopped.wait(0.001):
            self.device.send_force(self.force)

    def __enter__(self) -> Pusher:
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stopped.set()
        self.thread.join()


def pushes(bench: Bench) -> np.ndarray:
    """The force that is felt; enabled anew where a stall of this machine has taken it."""
    if bench.device.read().connected and not bench.device.read().force_enabled:
        bench.device.enable_force()
    return bench.felt()


def test_is_what_it_says(bench: Bench) -> None:
    device = bench.device
    assert isinstance(device, PositionSource)
    assert isinstance(device, ForceSink) == device.spec.has_force
    assert isinstance(device.spec, DeviceSpec) and device.spec.rate_hz > 0


def test_state_follows_the_handle(bench: Bench) -> None:
    ready(bench)
    device = bench.device
    if device.spec.control == "rate":
        assert eventually(lambda: np.dot(device.read().velocity_m_per_s, PLACE) > 0)
        assert not device.read().position_m.any()
        return
    sensed = np.array(
        [
            v if a in device.spec.sensed_axes and a in (bench.axes or "xyz") else 0
            for v, a in zip(PLACE, "xyz", strict=True)
        ]
    )
    assert eventually(lambda: np.allclose(device.read().position_m, sensed, atol=1e-5))


def test_age_and_sequence(bench: Bench) -> None:
    before = host_clock()
    ready(bench)
    states = [bench.device.read()]
    for k in range(50):
        bench.move(PLACE * (1 + 0.01 * k))
        last = states[-1].sequence
        assert eventually(lambda last=last: bench.device.read().sequence > last)
        states.append(bench.device.read())
        assert states[-1].time_s <= host_clock()
    sequences, times = [s.sequence for s in states], [s.time_s for s in states]
    assert sequences == sorted(set(sequences))
    assert times == sorted(times) and times[0] >= before


def test_never_blocks_while_the_hardware_hangs(bench: Bench) -> None:
    ready(bench)
    bench.hang(True)
    done = threading.Event()

    def use() -> None:
        for _ in range(100):
            bench.device.read()
            if isinstance(bench.device, ForceSink):
                bench.device.send_force(PUSH)
        done.set()

    threading.Thread(target=use, daemon=True).start()
    assert done.wait(PATIENCE_S), "read or send_force waited for hardware that hangs"


def test_force_only_after_enable(forceful: Bench) -> None:
    ready(forceful)
    with Pusher(forceful.device, PUSH):
        seen = forceful.device.read().sequence
        assert eventually(lambda: forceful.device.read().sequence > seen + 30)
        assert not forceful.felt().any() and not forceful.device.read().force_enabled
        forceful.device.enable_force()
        expected = on_axes(forceful, PUSH)
        assert eventually(lambda: np.allclose(pushes(forceful), expected, atol=1e-3))
        assert eventually(lambda: forceful.device.read().force_enabled)
        forceful.device.disable_force()
        assert eventually(lambda: not forceful.felt().any())


def test_enable_needs_a_device(forceful: Bench) -> None:
    with pytest.raises(DeviceError, match="not connected"):
        forceful.device.enable_force()


def test_a_caller_that_stalls_gets_zero(forceful: Bench) -> None:
    ready(forceful)
    forceful.device.enable_force()
    with Pusher(forceful.device, PUSH):
        assert eventually(lambda: pushes(forceful).any())
    assert eventually(lambda: not forceful.felt().any())
    assert forceful.device.read().connected


def test_nan_is_zero(forceful: Bench) -> None:
    ready(forceful)
    forceful.device.enable_force()
    with Pusher(forceful.device, PUSH):
        assert eventually(lambda: pushes(forceful).any())
    with Pusher(forceful.device, np.array([np.nan, 1.0, 1.0])):
        assert eventually(lambda: not forceful.felt().any())
    with pytest.raises(DeviceError, match="takes"):
        forceful.device.send_force(np.zeros(2))


@pytest.mark.parametrize("how", ["close", "exception", "interrupt"])
def test_zero_at_the_end(forceful: Bench, how: str) -> None:
    device = forceful.device
    with Pusher(device, PUSH):
        try:
            with device:
                forceful.move(PLACE)
                assert eventually(lambda: device.read().connected and device.read().sequence >= 0)
                device.enable_force()
                assert eventually(lambda: pushes(forceful).any())
                if how == "exception":
                    raise ValueError("a bug in the caller")
                if how == "interrupt":
                    signal.raise_signal(signal.SIGINT)
        except (ValueError, KeyboardInterrupt):
            pass
        assert forceful.zeroed()
        assert not device.read().connected
    device.close()


def test_unplugging_and_coming_back(bench: Bench) -> None:
    ready(bench)
    device = bench.device
    forceful = isinstance(device, ForceSink)
    if forceful:
        device.enable_force()
    with Pusher(device, PUSH) if forceful else threading.Lock():
        if forceful:
            assert eventually(lambda: pushes(bench).any())
        last = device.read().sequence
        bench.unplug()
        assert eventually(lambda: not device.read().connected)
        gone = device.read()
        assert gone.fault and not gone.force_enabled and not gone.calibrated and gone.sequence >= last
        assert eventually(lambda: not bench.felt().any())
        bench.replug()

        def back() -> bool:
            bench.move(PLACE)
            return device.read().connected

        assert eventually(back)
        seen = device.read().sequence
        assert seen > last
        if forceful:
            assert eventually(lambda: (bench.move(PLACE), device.read().sequence > seen + 30)[1])
            assert not bench.felt().any(), "force returned without being enabled again"
            device.enable_force()
            assert eventually(lambda: pushes(bench).any())


def test_ramp_in_after_enable(forceful: Bench) -> None:
    """Device and safety filter together, as the servo runs them: the force comes up over half a second."""
    ready(forceful)
    device = forceful.device
    device.enable_force()
    spec = device.spec
    safety = SafetyFilter(SafetyOptions(ramp_s=0.5), spec)
    pushes = []
    state = device.read()
    for tick in range(600):
        raw = RawPose(state.position_m, state.velocity_m_per_s, 0.0, tick, True, True, False)
        force, _ = safety.step(PUSH, raw, 1, 0.001)
        device.send_force(force)
        pushes.append(force)
    sizes = np.linalg.norm(pushes, axis=1)
    assert sizes[0] < 0.01 * np.linalg.norm(PUSH)
    assert (np.diff(sizes) >= -1e-12).all() and np.diff(sizes).max() < 0.01
    assert sizes[-1] == pytest.approx(np.linalg.norm(PUSH))


def test_closing_twice_and_opening_again(bench: Bench) -> None:
    ready(bench)
    bench.device.close()
    bench.device.close()
    ready(bench)
    assert bench.device.read().connected


def test_absent_device_says_so(bench: Bench) -> None:
    bench.unplug()
    with pytest.raises(DeviceError) as refusal:
        bench.device.open()
    assert ":" in str(refusal.value), "what is wrong, then what to do"


def test_force_is_zeroed_when_the_program_just_ends() -> None:
    """An exit without close(): the thread is a daemon, so zeroing is left to the exit handler."""
    program = textwrap.dedent(
        """
        import sys, time
        import numpy as np
        sys.path.insert(0, sys.argv[1])
        from fake_hid import FakeHid, StickUnit
        from palpate.devices.pid_ffb import make
        unit = StickUnit()
        device = make(hid=FakeHid(unit))
        device.open()
        unit.move(0.1)
        while device.read().sequence < 0:
            time.sleep(0.001)
        device.enable_force()
        while not any(unit.force_n()):
            device.send_force(np.array([1.0, 0.0, 0.0]))
            time.sleep(0.001)
        import atexit
        # handlers run last in, first out: registered before the device's own, this one would see its result
        atexit._run_exitfuncs()
        print(unit.force_n(), unit.writes[-1].hex())
        """
    )
    folder = str(Path(__file__).parent)
    command = [sys.executable, "-c", program, folder]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.stdout.split("\n")[0] == "(0.0, 0.0) 0c04", done.stderr
