"""SpaceMouse and force-feedback drivers over hidapi as it really behaves."""

from __future__ import annotations

import struct
import sys
import types

import numpy as np
import pytest

from palpate.devices import hid_port, pid_ffb, spacemouse
from palpate.devices.io_thread import ZERO
from palpate.mechanics.errors import DeviceError

from .benches import eventually
from .fake_hid import OPENFFBOARD_IDS, FakeHid, SpaceMouseUnit, StickUnit


class Clock:
    """Seconds that only move when told."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def stick() -> tuple[pid_ffb.PidWire, StickUnit, Clock]:
    """A connected wire, no thread, on a fake clock shared with the emulator."""
    unit, clock = StickUnit(), Clock()
    unit.clock = clock
    wire = pid_ffb.PidWire(pid_ffb.PidOptions(), clock, FakeHid(unit))
    wire.connect()
    return wire, unit, clock


def test_documented_start_sequence(stick) -> None:
    _, unit, _ = stick
    # reset, so that what a killed program left takes no room; then actuators on
    assert unit.writes[:2] == [bytes.fromhex("0c08"), bytes.fromhex("0c01")]
    kinds = [w[0] for w in unit.writes]
    assert kinds == [0x0C, 0x0C, 0x0D, 0x01, 0x05, 0x01, 0x05]
    assert [e["direction"] for e in unit.effects.values()] == [9000, 18000]


def test_dead_mans_switch(stick) -> None:
    """Effects are short and restarted: a program that dies leaves no force behind."""
    wire, unit, clock = stick
    for _ in range(200):
        wire.exchange(np.array([2.0, 0.0, 0.0]), 0.001)
        assert unit.force_n()[0] == pytest.approx(2.0, abs=1e-3)
        clock.now += 0.001
    clock.now += 0.051  # nobody writes any more
    assert unit.force_n() == (0.0, 0.0)
    assert all(0 < e["duration_ms"] <= 50 for e in unit.effects.values())
    starts = [w for w in unit.writes if w[0] == OPENFFBOARD_IDS["operation"]]
    assert len(starts) == 20  # 200 ms, both axes, every 20 ms


def test_one_short_write_an_axis_a_tick(stick) -> None:
    wire, unit, clock = stick
    wire.exchange(np.array([1.0, 1.0, 0.0]), 0.001)
    clock.now += 0.001
    unit.writes.clear()
    wire.exchange(np.array([1.0, 1.0, 0.0]), 0.001)
    assert [(w[0], len(w)) for w in unit.writes] == [(0x05, 4), (0x05, 4)]


def test_newtons_are_calibrated_and_limited(stick) -> None:
    wire, unit, _ = stick
    wire.exchange(np.array([100.0, 0.0, 0.0]), 0.001)
    assert unit.force_n()[0] == pytest.approx(8.0, rel=1e-3)
    half = pid_ffb.PidWire(pid_ffb.PidOptions(full_scale_n=4.0), Clock(), FakeHid(StickUnit()))
    assert half.spec.max_force_n == 4.0


def test_force_and_position_share_a_frame(stick) -> None:
    """Pushed along +y of the device frame, away from the person: HID's y is negative for both."""
    wire, unit, _ = stick
    wire.exchange(np.array([0.0, 3.0, 0.0]), 0.001)
    assert unit.force_n() == pytest.approx((0.0, -3.0), abs=1e-3)
    unit.move(0.0, -1.0)
    assert wire.exchange(ZERO, 0.001).position_m == pytest.approx([0.0, 0.05, 0.0])


def test_safety_switch_disables_force() -> None:
    unit = StickUnit()
    device = pid_ffb.make(hid=FakeHid(unit))
    with device:
        unit.move(0.0)
        assert eventually(lambda: device.read().connected and device.read().sequence >= 0)
        device.enable_force()
        unit.tell_state(0b10010)
        assert eventually(lambda: "safety switch" in device.read().fault)
        assert not device.read().force_enabled


def test_full_device_is_refused() -> None:
    unit = StickUnit()
    unit.room = 1
    with pytest.raises(DeviceError, match="no room"):
        pid_ffb.make(hid=FakeHid(unit)).open()


def test_input_is_drained_to_the_newest() -> None:
    """The kernel keeps the oldest reports: a driver that took one a turn would lag behind the hand."""
    unit, clock = StickUnit(), Clock()
    wire = pid_ffb.PidWire(pid_ffb.PidOptions(), clock, FakeHid(unit))
    wire.connect()
    for k in range(60):
        unit.move(k / 100)
    reading = wire.exchange(None, 0.001)
    assert reading.position_m[0] == pytest.approx(0.59 * 0.05, abs=1e-5)


def test_velocity_is_the_handles() -> None:
    unit, clock = StickUnit(), Clock()
    wire = pid_ffb.PidWire(pid_ffb.PidOptions(), clock, FakeHid(unit))
    wire.connect()
    for k in range(100):
        unit.move(k / 200)
        reading = wire.exchange(None, 0.001)
        clock.now += 0.001
    assert reading.velocity_m_per_s[0] == pytest.approx(0.05 / 200 / 0.001, rel=0.01)


def _mouse() -> tuple[spacemouse.SpacemouseWire, SpaceMouseUnit, Clock]:
    unit, clock = SpaceMouseUnit(), Clock()
    wire = spacemouse.SpacemouseWire(
        spacemouse.SpacemouseOptions(full_speed_m_per_s=0.1), clock, FakeHid(unit)
    )
    wire.connect()
    return wire, unit, clock


def test_deflection_is_a_speed_and_rest_is_rest() -> None:
    wire, unit, clock = _mouse()
    assert unit.led is True
    unit.deflect(x=350)
    assert wire.exchange(None, 0.001).velocity_m_per_s == pytest.approx([0.1, 0, 0])
    unit.deflect()
    assert not wire.exchange(None, 0.001).velocity_m_per_s.any()
    assert wire.exchange(None, 0.001) is None  # nothing new yet
    clock.now += 0.02
    assert not wire.exchange(None, 0.001).velocity_m_per_s.any()  # silent, attached: at rest, and fresh
    wire.disconnect()
    assert unit.led is False


def test_a_lost_release_does_not_creep_on() -> None:
    wire, unit, clock = _mouse()
    unit.deflect(z=-350)
    assert wire.exchange(None, 0.001).velocity_m_per_s[2] == pytest.approx(0.1)
    clock.now += 0.1
    assert wire.exchange(None, 0.001).velocity_m_per_s[2] > 0
    clock.now += 0.15
    assert wire.exchange(None, 0.001).velocity_m_per_s[2] == 0


def test_other_devices_of_the_maker_are_left_alone() -> None:
    unit = SpaceMouseUnit()
    unit.vendor_id, unit.product_id = 0x046D, 0xC52B  # a Logitech receiver
    found = spacemouse.find(hid=FakeHid(unit))
    assert not found[0].present and "plugged in" in found[0].why_not


def test_a_stick_without_force_says_why() -> None:
    unit = StickUnit()
    unit.descriptor = bytes.fromhex("05010904a10109301581257f750895018102c0")
    found = pid_ffb.find(hid=FakeHid(unit))[0]
    assert not found.present and "no set effect" in found.why_not


def test_permission_gives_a_rule_to_paste(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    unit = SpaceMouseUnit()
    unit.path = str(tmp_path / "hidraw3")
    (tmp_path / "hidraw3").touch()
    monkeypatch.setattr(hid_port.os, "access", lambda *_: False)
    found = spacemouse.find(hid=FakeHid(unit))[0]
    assert not found.present and "permission" in found.why_not
    assert 'KERNEL=="hidraw*", ATTRS{idVendor}=="256f", TAG+="uaccess"' in found.remedy

    def refuse(*_: object) -> None:
        raise OSError("open failed")

    hid = FakeHid(unit)
    unit_handle = type(hid.device())
    monkeypatch.setattr(unit_handle, "open_path", refuse)
    with pytest.raises(DeviceError, match="no permission"):
        spacemouse.make(hid=hid).open()


def test_the_other_package_called_hid_is_recognised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hidraw", types.ModuleType("hidraw"))
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(DeviceError, match="uninstall hid"):
        hid_port.load()
    found = spacemouse.find()[0]
    assert not found.present and "hidapi" in found.remedy


def test_the_real_library_is_there_and_right() -> None:
    module = hid_port.load()
    assert module.__name__ == ("hidraw" if sys.platform.startswith("linux") else "hid")
    assert isinstance(module.enumerate(), list)


def test_refused_write_is_an_error() -> None:
    unit = SpaceMouseUnit()
    port = hid_port.HidPort(unit.path, unit.vendor_id, module=FakeHid(unit))
    port.write(b"\x04\x01")
    unit.plugged = False
    with pytest.raises(OSError, match="unplugged"):
        port.write(b"\x04\x01")


def test_layout_of_the_emulator_is_not_the_drivers(stick) -> None:
    """The emulator unpacks by struct what the driver packed by descriptor."""
    wire, unit, _ = stick
    wire.exchange(np.array([-4.0, 0.0, 0.0]), 0.001)
    assert unit.writes[-4] == struct.pack("<BBh", 0x05, 1, -16384)
