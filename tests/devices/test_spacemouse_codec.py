"""The documented bytes of a SpaceMouse mean what the sources say."""

from __future__ import annotations

import pytest

from palpate.devices.codecs import spacemouse as codec

REST = codec.Deflection()


def test_documented_bytes() -> None:
    assert codec.decode(bytes.fromhex("01000000000000"), REST) == REST
    turned = codec.decode(bytes.fromhex("020000e2ff0000"), REST)
    assert turned.rotation == pytest.approx(
        (0.0, 30 / 350, 0.0)
    )  # Ry = -30 about the device's +y, towards us
    assert turned.translation == (0.0, 0.0, 0.0)
    pressed = codec.decode(bytes.fromhex("030100"), REST)
    assert pressed.buttons == 1
    assert codec.decode(bytes.fromhex("030000"), pressed).buttons == 0


def test_long_report_is_told_by_its_length() -> None:
    report = bytes.fromhex("01" + "5e01" + "a2fe" + "0000" + "0000" + "0000" + "5e01")
    both = codec.decode(report, REST)
    assert both.translation == pytest.approx((1.0, 1.0, 0.0))  # y: -350 of the device is away from us
    assert both.rotation == pytest.approx((0.0, 0.0, -1.0))


def test_split_reports_complete_each_other() -> None:
    first = codec.decode(bytes.fromhex("01af0000000000"), REST)
    second = codec.decode(bytes.fromhex("02000000000000"), first)
    assert second.translation == pytest.approx((0.5, 0.0, 0.0))


def test_frame_is_right_handed() -> None:
    """The signs are those of a rotation: mirrored axes would turn every touch around."""
    axes = [codec.decode(bytes.fromhex(h), REST).translation for h in ("015e0100000000", "0100005e010000")]
    third = codec.decode(bytes.fromhex("01000000005e01"), REST).translation
    (a, b, c), (d, e, f) = axes
    cross = (b * f - c * e, c * d - a * f, a * e - b * d)
    assert cross == pytest.approx(third)


@pytest.mark.parametrize("report", [b"", b"\x01", b"\x01\x02", b"\x02\x00\x00", b"\x63" * 7, b"\x03"])
def test_unknown_or_short_reports_change_nothing(report: bytes) -> None:
    last = codec.decode(bytes.fromhex("01af0000000000"), REST)
    assert codec.decode(report, last) == last


def test_battery_and_led() -> None:
    assert codec.decode(bytes((0x17, 84, 0)), REST).battery_percent == 84
    assert (codec.led(True), codec.led(False)) == (b"\x04\x01", b"\x04\x00")


def test_deflection_never_exceeds_full_scale() -> None:
    assert codec.decode(bytes.fromhex("01ff7f01800000"), REST).translation == (1.0, 1.0, 0.0)
