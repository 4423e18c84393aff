"""Force-feedback reports are laid out by the descriptor: the documented bytes for one device, not for
others."""

from __future__ import annotations

import struct

import pytest

from palpate.devices.codecs import pid
from palpate.devices.codecs.hid_descriptor import parse
from palpate.devices.codecs.pid import PidLayout
from palpate.mechanics.errors import DeviceError

from .fake_hid import OPENFFBOARD_IDS, OTHER_IDS, stick_descriptor

BOARD = PidLayout.from_bytes(stick_descriptor(OPENFFBOARD_IDS))


def test_sizes_are_the_documented_ones() -> None:
    sizes = BOARD.descriptor
    assert (sizes.report_bytes("input", 1), sizes.report_bytes("input", 2)) == (24, 1)
    assert [sizes.report_bytes("output", i) for i in (0x01, 0x05, 0x0A, 0x0C, 0x0D)] == [21, 3, 3, 1, 1]
    assert (sizes.report_bytes("feature", 0x11), sizes.report_bytes("feature", 0x12)) == (3, 4)


def test_documented_sequence() -> None:
    assert BOARD.create_constant() == bytes.fromhex("11010000")
    assert BOARD.block_load() == (0x12, 5)
    assert BOARD.loaded_block(bytes.fromhex("1203010000")) == 3
    assert BOARD.control(pid.ENABLE_ACTUATORS) == bytes.fromhex("0c01")
    assert BOARD.control(pid.STOP_ALL) == bytes.fromhex("0c04")
    assert BOARD.magnitude(2, 1.0) == bytes.fromhex("0502ff7f")
    assert BOARD.magnitude(2, -0.5) == struct.pack("<BBh", 5, 2, round(-0.5 * 32767))
    assert BOARD.operate(2, pid.START)[:3] == bytes.fromhex("0a0201")
    assert BOARD.operate(2, pid.STOP)[:3] == bytes.fromhex("0a0203")


def test_set_effect_is_finite_and_in_its_direction() -> None:
    report = BOARD.set_effect(1, 90.0, 50)
    block, kind, duration, repeat, sample, delay, gain, button, axes, x, y, _, _ = struct.unpack(
        "<BB4HBBBHHHH", report[1:]
    )
    assert (report[0], block, kind, duration, gain, button) == (1, 1, 1, 50, 255, 255)
    assert axes == 4 and x == 9000  # direction used, 90.00 degrees
    assert struct.unpack_from("<H", BOARD.set_effect(1, 180.0, 50), 14) == (18000,)
    for forever in (0, 0xFFFF, 32767, -1):
        with pytest.raises(DeviceError, match="outlive"):
            BOARD.set_effect(1, 90.0, forever)


def test_ids_come_from_the_descriptor() -> None:
    other = PidLayout.from_bytes(stick_descriptor(OTHER_IDS, axes=1, control_bits=False))
    assert other.force_axes == ("x",) and BOARD.force_axes == ("x", "y")
    assert other.create_constant()[0] == OTHER_IDS["create"]
    assert other.magnitude(1, 0.0)[0] == OTHER_IDS["constant"]
    assert other.control(pid.ENABLE_ACTUATORS) == bytes((OTHER_IDS["control"], 1))
    assert other.control(pid.STOP_ALL) == bytes((OTHER_IDS["control"], 3))  # an array counts its usages
    axes = other.axes(struct.pack("<BQ8h", OTHER_IDS["axes"], 5, 32767, *[0] * 7))
    assert axes == pid.StickReading(1.0, None, 5)


def test_positions_and_buttons() -> None:
    report = struct.pack("<BQ8h", 1, 1 << 63 | 2, -32767, 16384, *[0] * 6)
    axes = BOARD.axes(report)
    assert axes.x == -1.0 and axes.y == pytest.approx(0.5, abs=1e-4)
    assert axes.buttons == 1 << 63 | 2
    assert BOARD.axes(bytes((2, 0))) is None


def test_state_report_faults() -> None:
    assert BOARD.fault(bytes((2, 0b10110))) == ""
    assert "power" in BOARD.fault(bytes((2, 0b00110)))
    assert "safety switch" in BOARD.fault(bytes((2, 0b10010)))
    assert "off" in BOARD.fault(bytes((2, 0b10100)))
    assert BOARD.fault(struct.pack("<BQ8h", 1, 0, *[0] * 8)) is None


def test_full_pool_and_missing_force_are_refused() -> None:
    with pytest.raises(DeviceError, match="no room"):
        BOARD.loaded_block(bytes.fromhex("1200020000"))
    with pytest.raises(DeviceError, match="refused"):
        BOARD.loaded_block(bytes.fromhex("1200030000"))
    gamepad = bytes.fromhex("05010905a1010509190129101500250175019510 8102 c0".replace(" ", ""))
    with pytest.raises(DeviceError, match="no set effect"):
        PidLayout.from_bytes(gamepad)


def test_broken_descriptors_are_refused() -> None:
    whole = stick_descriptor(OPENFFBOARD_IDS)
    with pytest.raises(DeviceError, match="cut off"):
        parse(whole + b"\x27\x00")
    with pytest.raises(DeviceError, match="not open"):
        parse(whole + b"\xc0")
    with pytest.raises(DeviceError, match="empty stack"):
        parse(b"\xb4")


def test_short_report_is_refused_not_misread() -> None:
    with pytest.raises(DeviceError, match="shorter"):
        BOARD.axes(b"\x01\x00\x00")
