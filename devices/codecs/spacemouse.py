"""3Dconnexion SpaceMouse over HID: input reports to deflection and buttons; the LED's output report.

Facts: PySpaceMouse `devices.toml`, spacenavd `src/dev.c`. Axes are int16 little-endian within +-350. Older
devices split a pose into report 1 (translation) and report 2 (rotation), 7 bytes each; newer ones send all
six in a report 1 of 13 bytes: told apart by length. Button report 3, battery 0x17. The device's own axes
are x right, y towards the person, z down; `Deflection` is right-handed with y away from the person and z
up.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace

FULL_SCALE = 350.0
PRODUCTS: dict[int, tuple[int, ...]] = {
    0x046D: (0xC603, 0xC605, 0xC606, 0xC621, 0xC623, 0xC625, 0xC626, 0xC627, 0xC628, 0xC629, 0xC62B),
    0x256F: (0xC62E, 0xC62F, 0xC631, 0xC632, 0xC633, 0xC635, 0xC636, 0xC638, 0xC63A, 0xC652),
}
"""Vendor id: product ids. 0x046d is Logitech, which also makes mice: a vendor id alone says nothing."""


@dataclass(frozen=True)
class Deflection:
    """translation, rotation: shares of full deflection, -1 to 1; x right, y away, z up. buttons: a mask."""

    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    buttons: int = 0
    battery_percent: int | None = None

    @property
    def at_rest(self) -> bool:
        """No axis is deflected."""
        return not any(self.translation) and not any(self.rotation)


def decode(report: bytes, last: Deflection) -> Deflection:
    """`last` updated by one input report; a report that is not known, or too short, changes nothing."""
    if len(report) >= 13 and report[0] == 1:
        return replace(last, translation=_axes(report[1:7]), rotation=_axes(report[7:13]))
    if len(report) >= 7 and report[0] == 1:
        return replace(last, translation=_axes(report[1:7]))
    if len(report) >= 7 and report[0] == 2:
        return replace(last, rotation=_axes(report[1:7]))
    if len(report) >= 2 and report[0] == 3:
        return replace(last, buttons=int.from_bytes(report[1:7], "little"))
    if len(report) >= 2 and report[0] == 0x17:
        return replace(last, battery_percent=report[1])
    return last


def _axes(data: bytes) -> tuple[float, float, float]:
    x, y, z = struct.unpack("<3h", data)
    return _share(x), _share(-y), _share(-z)


def _share(value: int) -> float:
    return min(max(value / FULL_SCALE, -1.0), 1.0)


def led(on: bool) -> bytes:
    """The output report that lights or darkens the ring."""
    return bytes((4, 1 if on else 0))
