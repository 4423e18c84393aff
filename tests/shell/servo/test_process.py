"""The servo as a process of its own, with a device over real sockets: what a hand feels when things die."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from benchmarks._elastic_plane import PlaneSource
from palpate.devices.haply import HaplyOptions
from palpate.devices.registry import DeviceChoice
from palpate.mechanics.errors import DeviceError, PalpateError
from palpate.servo import Recorder, SafetyOptions, Servo, ServoOptions
from palpate.servo.started import StartedServo

from ...conftest import REPOSITORY
from ...devices.fake_inverse import FakeInverse
from ...support.waiting import PATIENCE_S, eventually

pytest.importorskip("websockets")

# The emulator shares a machine with noisy neighbours, which stall it longer than a service is ever silent. A
# late pose or a lost link rightly takes the force away, which is not what is looked for here.
ANSWER_S, STALE_S = 10.0, 2.0


@pytest.fixture(autouse=True)
def with_the_benchmarks_planes(monkeypatch):
    """The servo process makes what these tests feel, which lies in the clone, not in what is installed."""
    monkeypatch.setenv("PYTHONPATH", str(REPOSITORY))


def choice(fake: FakeInverse) -> DeviceChoice:
    states, events = fake.ports
    uris = {"uri": f"ws://localhost:{states}", "events_uri": f"ws://localhost:{events}"}
    return DeviceChoice("haply", {"options": HaplyOptions(**uris, answer_s=ANSWER_S)})


def pressing(fake: FakeInverse) -> bool:
    return fake.force_n()[2] > 0.3


def pressing_after_enabling(servo: Servo, fake: FakeInverse) -> bool:
    """As a person does: enable, and once more where the device was not back yet."""
    for _ in range(240):
        servo.enable()
        if eventually(lambda: pressing(fake), PATIENCE_S / 240):
            return True
    return False


def goes_on_without_force(fake: FakeInverse) -> bool:
    """Whether the next hundred messages of the driver ask for no force."""
    seen = len(fake.messages)
    assert eventually(lambda: len(fake.messages) > seen + 100)
    return not any(any(force.values()) for message in fake.messages[seen:] for force in commanded(message))


def commanded(message: dict) -> list[dict]:
    commands = [device.get("commands", {}) for device in message.get("inverse3", [])]
    return [c["set_cursor_force"]["vector"] for c in commands if "set_cursor_force" in c]


@pytest.fixture
def fake():
    device = FakeInverse()
    # 1 mm into the plane with a 5 mm tip
    device.position = [0.0, 0.0, 0.004]
    yield device
    device.stop()


@pytest.fixture
def servo(fake):
    options = ServoOptions(safety=SafetyOptions(ramp_s=0.1, stale_s=STALE_S))
    with Servo(PlaneSource(500.0), device=choice(fake), options=options) as session:
        yield session.start()


def test_a_session_feels_follows_commands_and_ends_at_zero(fake, servo, tmp_path):
    assert any("--stale is 2" in word and "default 0.02" in word for word in servo.words), "what is loosened"
    assert any("--stale is 2" in word for word in servo.report().as_dict()["words"])
    assert ServoOptions().loosened == ()
    assert eventually(lambda: servo.snapshot() is not None)
    recorder = Recorder(servo)
    assert eventually(lambda: servo.report().ticks > 100)
    snapshot = servo.snapshot()
    np.testing.assert_allclose(snapshot.forces_n[0], [0, 0, 0.5], atol=1e-9)
    assert snapshot.touching[0] and snapshot.reason and not snapshot.command_n.any()
    assert fake.force_n() == (0.0, 0.0, 0.0), "no force before it is enabled"

    assert pressing_after_enabling(servo, fake)
    assert eventually(lambda: fake.force_n()[2] > 0.45)
    np.testing.assert_allclose(servo.snapshot().depths[0], 0.001)

    servo.set_modulus(80e3)
    # on a busy machine the reading may have grown old, which takes the force until it is enabled anew
    assert any(
        pressing_after_enabling(servo, fake) and eventually(lambda: fake.force_n()[2] > 0.7, PATIENCE_S / 60)
        for _ in range(60)
    ), "a new modulus is felt at once"
    servo.set_source(PlaneSource(300.0))
    assert eventually(lambda: 0.2 < fake.force_n()[2] < 0.35), "a new object is felt"
    with pytest.raises(PalpateError, match="no command"):
        servo._command("dance", None)

    servo.disable()
    assert eventually(lambda: fake.force_n() == (0.0, 0.0, 0.0))
    recording = recorder.write(tmp_path / "session.csv")
    assert recording.exists()
    assert servo.stop() == 0
    rows, head = servo.history()
    assert (np.diff(rows["tick"]) >= 1).all()
    assert head == servo.report().ticks
    assert rows["tick"][-1] == servo.report().ticks + servo.report().missed_ticks - 1
    assert eventually(lambda: fake.force_n() == (0.0, 0.0, 0.0))
    report = servo.report()
    assert report.compute.number == report.ticks
    assert report.peak_force_n > 0.7


def test_a_killed_servo_leaves_the_device_at_zero(fake, servo):
    assert pressing_after_enabling(servo, fake)
    os.kill(servo.process_id, signal.SIGKILL)
    assert eventually(lambda: not servo.alive)
    assert eventually(lambda: fake.force_n() == (0.0, 0.0, 0.0))
    sent = len(fake.messages)
    with pytest.raises(DeviceError):
        servo.set_modulus(1e4)
    assert len(fake.messages) == sent and fake.force_n() == (0.0, 0.0, 0.0), "nobody is left to ask for force"


@pytest.mark.slow
def test_a_stopped_process_leaves_the_device_at_zero_and_can_go_on(fake, servo):
    assert pressing_after_enabling(servo, fake)
    os.kill(servo.process_id, signal.SIGSTOP)
    assert eventually(lambda: fake.force_n() == (0.0, 0.0, 0.0))
    time.sleep(0.3)  # at least 300 deadlines go by
    assert eventually(lambda: fake.force_n() == (0.0, 0.0, 0.0))
    missed = servo.report().missed_ticks
    os.kill(servo.process_id, signal.SIGCONT)
    assert pressing_after_enabling(servo, fake), "a driver that lost touch meanwhile wants it anew"
    assert servo.report().missed_ticks >= missed + 200, "skipped deadlines are counted, not made up for"


def test_an_unplugged_device_needs_a_new_enabling(fake, servo):
    assert pressing_after_enabling(servo, fake)
    fake.event("device-disconnected")
    fake.status["calibrated"] = False
    assert eventually(lambda: fake.force_n() == (0.0, 0.0, 0.0))
    fake.status["calibrated"] = True
    assert goes_on_without_force(fake) and fake.force_n() == (0.0, 0.0, 0.0)
    assert pressing_after_enabling(servo, fake)


PARENT = """
import sys, time
from palpate.devices.haply import HaplyOptions
from palpate.devices.registry import DeviceChoice
from palpate.servo import SafetyOptions, Servo, ServoOptions
from benchmarks._elastic_plane import PlaneSource

options = HaplyOptions(uri=sys.argv[1], events_uri=sys.argv[2], answer_s=10.0)
servo = Servo(PlaneSource(500.0), device=DeviceChoice("haply", {"options": options}),
              options=ServoOptions(on_orphan=sys.argv[3], safety=SafetyOptions(ramp_s=0.1, stale_s=2.0)))
servo.start()
print(servo.process_id, flush=True)
while True:
    servo.enable()
    time.sleep(3.0)
"""


def process_runs(process_id: int) -> bool:
    try:
        os.kill(process_id, 0)
    except ProcessLookupError:
        return False
    try:
        with open(f"/proc/{process_id}/stat", encoding="ascii") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("on_orphan", ["stop", "continue"])
def test_a_killed_window(fake, on_orphan):
    states, events = fake.ports
    parent = subprocess.Popen(
        [
            sys.executable,
            "-c",
            PARENT,
            f"ws://localhost:{states}",
            f"ws://localhost:{events}",
            on_orphan,
        ],
        stdout=subprocess.PIPE,
    )
    assert parent.stdout is not None
    process_id = int(parent.stdout.readline())
    assert eventually(lambda: pressing(fake))
    parent.kill()
    parent.wait()
    if on_orphan == "stop":
        assert eventually(lambda: not process_runs(process_id))
    else:
        sent = len(fake.messages)
        assert eventually(lambda: len(fake.messages) > sent + 100) and process_runs(process_id)
        assert eventually(lambda: pressing(fake)), "the hand goes on feeling without a window"
        os.kill(process_id, signal.SIGTERM)
        assert eventually(lambda: not process_runs(process_id))
    assert eventually(lambda: fake.force_n() == (0.0, 0.0, 0.0))


FORKING = """
import os, sys, time
from palpate.servo import Servo
from benchmarks._elastic_plane import PlaneSource

servo = Servo(PlaneSource(500.0))
if sys.argv[1] == "loading":
    servo._listen = lambda: None
    servo._await = lambda *_: (print(servo.process_id, flush=True), time.sleep(600.0))
servo.start()
if os.fork() == 0:
    time.sleep(600.0)  # it holds the other end of the servo's input
    os._exit(0)
print(servo.process_id, flush=True)
time.sleep(600.0)
"""


@pytest.mark.parametrize("when", ["loading", "touching"])
def test_a_servo_whose_parent_was_killed_ends_though_its_input_does_not(when):
    parent = subprocess.Popen(
        [sys.executable, "-c", FORKING, when], stdout=subprocess.PIPE, start_new_session=True
    )
    assert parent.stdout is not None
    process_id = int(parent.stdout.readline())
    assert process_runs(process_id)
    os.kill(parent.pid, signal.SIGKILL)
    try:
        assert eventually(lambda: not process_runs(process_id))
    finally:
        os.killpg(parent.pid, signal.SIGKILL)  # and the one that it forked
        parent.wait()


def test_a_servo_that_outlives_its_window_ends_with_its_force(fake):
    """Nobody is left who could enable it again."""
    states, events = fake.ports
    uris = [f"ws://localhost:{port}" for port in (states, events)]
    parent = subprocess.Popen([sys.executable, "-c", PARENT, *uris, "continue"], stdout=subprocess.PIPE)
    assert parent.stdout is not None
    process_id = int(parent.stdout.readline())
    assert eventually(lambda: pressing(fake))
    parent.kill()
    parent.wait()
    fake.event("device-disconnected")
    fake.status["calibrated"] = False
    assert eventually(lambda: not process_runs(process_id))
    assert eventually(lambda: fake.force_n() == (0.0, 0.0, 0.0))


def test_what_stops_the_servo_from_starting_is_told(fake):
    fake.devices = []
    with Servo(PlaneSource(), device=choice(fake)) as servo, pytest.raises(PalpateError, match="Inverse3"):
        servo.start()


def test_a_model_that_is_not_there_is_told():
    with Servo("nowhere/model", options=ServoOptions()) as servo:
        with pytest.raises(PalpateError, match="nowhere/model"):
            servo.start()


def test_a_servo_that_waits_for_its_job_runs_it_once_all_is_compiled():
    hand = DeviceChoice("simulated", {})
    with StartedServo(("tick",)) as started:
        with Servo(PlaneSource(500.0), device=hand, started=started) as servo:
            asked = []
            servo.start(compiled=lambda: asked.append(servo.report().ticks))
            assert asked == [0], "it ticks after that"
            assert servo.process_id == started.process.pid
            assert eventually(lambda: servo.report().ticks > 10)
        assert started.process.returncode == 0


def test_a_servo_that_never_gets_a_job_is_ended():
    with StartedServo() as started:
        assert os.path.exists(started.block.path) and started.process.poll() is None
    assert started.process.poll() is not None
    assert not os.path.exists(started.block.path)


BEATING = """
import sys, time
from palpate.devices.haply import HaplyOptions
from palpate.devices.registry import DeviceChoice
from palpate.servo import SafetyOptions, Servo, ServoOptions
from benchmarks._elastic_plane import PlaneSource

options = HaplyOptions(uri=sys.argv[1], events_uri=sys.argv[2], answer_s=10.0)
with Servo(PlaneSource(500.0), device=DeviceChoice("haply", {"options": options}),
           options=ServoOptions(silence_s=0.3, safety=SafetyOptions(ramp_s=0.1, stale_s=2.0))) as servo:
    servo.start()
    servo.enable()
    print(servo.process_id, flush=True)
    while True:
        servo.wait(3.0)
        servo.enable()
"""


def test_a_stopped_window_takes_the_force_with_it(fake):
    states, events = fake.ports
    parent = subprocess.Popen(
        [sys.executable, "-c", BEATING, f"ws://localhost:{states}", f"ws://localhost:{events}"],
        stdout=subprocess.PIPE,
    )
    assert parent.stdout is not None
    process_id = int(parent.stdout.readline())
    try:
        assert eventually(lambda: pressing(fake))
        os.kill(parent.pid, signal.SIGSTOP)
        # of a stopped parent's silence the servo knows by its own clock, while it goes on; a pose that came
        # late on a busy machine takes the force before that, and gives it back
        assert eventually(lambda: goes_on_without_force(fake)) and process_runs(process_id)
        os.kill(parent.pid, signal.SIGCONT)
        assert eventually(lambda: pressing(fake)), "a window that goes on is felt again"
    finally:
        parent.kill()
        parent.wait()
    assert eventually(lambda: not process_runs(process_id))


def test_a_device_that_fails_ends_the_session_with_its_reason(fake):
    with Servo(PlaneSource(500.0), device=DeviceChoice("broken", {})) as servo:
        servo._job = replace(servo._job, device=Breaking())
        servo.start()
        assert not servo.wait(PATIENCE_S)
        assert "the device failed: hand lost" in servo.failure
        assert servo.stop() == 2


class Breaking:
    """A DeviceChoice of a device that gives a few readings and then fails."""

    def make(self):
        from palpate.devices.virtual_hand import SimulatedHand

        class Hand(SimulatedHand):
            def read(self):
                state = super().read()
                if state.sequence > 20:
                    raise RuntimeError("hand lost")
                return state

        return Hand()
