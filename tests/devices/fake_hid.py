"""hidapi 0.15.0 on Linux, as it behaves when run, with emulated devices behind it.

`read` blocks unless non-blocking or timed, and gives [] for nothing; the kernel keeps the oldest 63 reports;
unplugged, `read` raises OSError and `write` returns -1 without raising.
"""

from __future__ import annotations

import struct
import threading
import time
from collections import deque

KERNEL_QUEUE = 63


class Unit:
    """An emulated device: subclasses say what it is and what reports do to it."""

    vendor_id, product_id, usage_page, usage = 0, 0, 1, 8
    product_string = "unit"
    descriptor = b""

    def __init__(self, path: str = "/nonexistent/hidraw0") -> None:
        self.path = path
        self.plugged = True
        self.queue: deque[bytes] = deque()
        self.arrived = threading.Condition()
        self.writes: list[bytes] = []
        self.hang = threading.Event()

    def emit(self, report: bytes) -> None:
        """An input report; lost when the kernel's queue is full."""
        with self.arrived:
            if len(self.queue) < KERNEL_QUEUE:
                self.queue.append(report)
            self.arrived.notify_all()

    def unplug(self) -> None:
        with self.arrived:
            self.plugged = False
            self.queue.clear()
            self.arrived.notify_all()

    def replug(self) -> None:
        self.plugged = True

    def output(self, report: bytes) -> None:
        """What an output report does; subclasses override."""

    def feature(self, report_id: int, data: bytes | None) -> bytes:
        """A feature report set (data) or asked for (None)."""
        raise OSError("no such feature")


class FakeHid:
    """Stands in for the module `hidraw`."""

    def __init__(self, *units: Unit) -> None:
        self.units = list(units)

    def enumerate(self, vendor_id: int = 0, product_id: int = 0) -> list[dict]:
        return [
            {
                "path": u.path.encode(),
                "vendor_id": u.vendor_id,
                "product_id": u.product_id,
                "usage_page": u.usage_page,
                "usage": u.usage,
                "product_string": u.product_string,
            }
            for u in self.units
            if u.plugged
        ]

    def device(self) -> _Handle:
        return _Handle(self)


class _Handle:
    def __init__(self, hid: FakeHid) -> None:
        self._hid = hid
        self._unit: Unit | None = None
        self._nonblocking = False

    def open_path(self, path: bytes) -> None:
        for unit in self._hid.units:
            if unit.path.encode() == path and unit.plugged:
                self._unit = unit
                return
        raise OSError("open failed")

    def set_nonblocking(self, value: int) -> int:
        self._nonblocking = bool(value)
        return 0

    def read(self, size: int, timeout_ms: int = 0) -> list[int]:
        unit = self._unit
        if unit is None:
            raise ValueError("not open")
        while unit.hang.is_set():
            time.sleep(0.001)
        with unit.arrived:
            if not unit.queue and unit.plugged and (timeout_ms > 0 or not self._nonblocking):
                unit.arrived.wait(timeout_ms / 1000 if timeout_ms > 0 else None)
            if not unit.plugged:
                raise OSError("read error")
            return list(unit.queue.popleft()[:size]) if unit.queue else []

    def write(self, data: bytes) -> int:
        unit = self._unit
        if unit is None:
            raise ValueError("not open")
        if not unit.plugged:
            return -1
        unit.writes.append(bytes(data))
        unit.output(bytes(data))
        return len(data)

    def send_feature_report(self, data: bytes) -> int:
        if not self._unit.plugged:
            return -1
        self._unit.feature(data[0], bytes(data))
        return len(data)

    def get_feature_report(self, report_id: int, size: int) -> list[int]:
        return list(self._unit.feature(report_id, None)[:size])

    def get_report_descriptor(self, max_length: int = 4096) -> list[int]:
        return list(self._unit.descriptor[:max_length])

    def close(self) -> None:
        self._unit = None


class _Builder:
    """Writes a report descriptor item by item (HID 1.11)."""

    def __init__(self) -> None:
        self.data = bytearray()

    def item(self, prefix: int, value: int | None = None, signed: bool = False) -> _Builder:
        if value is None:
            self.data.append(prefix)
            return self
        for code, size in ((1, 1), (2, 2), (3, 4)):
            fits = (
                -(1 << 8 * size - 1) <= value < (1 << 8 * size - 1) if signed else 0 <= value < 1 << 8 * size
            )
            if fits:
                self.data.append(prefix | code)
                self.data += int(value).to_bytes(size, "little", signed=signed)
                return self
        raise ValueError(value)

    def page(self, n: int) -> _Builder:
        return self.item(0x04, n)

    def usage(self, *n: int) -> _Builder:
        for one in n:
            self.item(0x08, one)
        return self

    def usages(self, low: int, high: int) -> _Builder:
        return self.item(0x18, low).item(0x28, high)

    def collection(self, kind: int) -> _Builder:
        return self.item(0xA0, kind)

    def end(self) -> _Builder:
        return self.item(0xC0)

    def report(self, n: int) -> _Builder:
        return self.item(0x84, n)

    def shape(self, size: int, count: int, low: int, high: int) -> _Builder:
        return self.item(0x74, size).item(0x94, count).item(0x14, low, True).item(0x24, high, True)

    def input(self, flags: int = 2) -> _Builder:
        return self.item(0x80, flags)

    def output(self, flags: int = 2) -> _Builder:
        return self.item(0x90, flags)

    def feature(self, flags: int = 2) -> _Builder:
        return self.item(0xB0, flags)


def spacemouse_descriptor() -> bytes:
    """Translations, rotations and buttons in reports of their own, a light."""
    b = _Builder()
    b.page(0x01).usage(0x08).collection(1)
    for report, axes in ((1, (0x30, 0x31, 0x32)), (2, (0x33, 0x34, 0x35))):
        b.report(report).page(0x01).usage(*axes).shape(16, 3, -350, 350).input()
    b.report(3).page(0x09).usages(1, 2).shape(1, 2, 0, 1).input().shape(1, 14, 0, 1).input(3)
    b.report(4).page(0x08).usage(0x4B).shape(1, 1, 0, 1).output().shape(1, 7, 0, 1).output(3)
    return bytes(b.end().data)


class SpaceMouseUnit(Unit):
    """A SpaceMouse Compact (split reports, 7 bytes each)."""

    vendor_id, product_id, product_string = 0x256F, 0xC635, "SpaceMouse Compact"

    def __init__(self) -> None:
        super().__init__()
        self.descriptor = spacemouse_descriptor()
        self.led: bool | None = None

    def output(self, report: bytes) -> None:
        if report[0] == 4:
            self.led = bool(report[1])

    def deflect(self, x: int = 0, y: int = 0, z: int = 0) -> None:
        self.emit(struct.pack("<B3h", 1, x, y, z))
        self.emit(struct.pack("<B3h", 2, 0, 0, 0))


def stick_descriptor(ids: dict[str, int], *, axes: int = 2, control_bits: bool = True) -> bytes:
    """A force-feedback stick with the two-axis layout of OpenFFBoard; `ids` names each report's id.

    axes=1 makes a wheel: one actuated axis, no y. control_bits: device control as single bits, else an array.
    """
    b = _Builder()
    b.page(0x01).usage(0x04).collection(1)
    b.report(ids["axes"])
    b.page(0x09).usages(1, 64).shape(1, 64, 0, 1).input()
    b.page(0x01).usage(*((0x30, 0x31) if axes == 2 else (0x30,)))
    b.shape(16, axes, -32767, 32767).input()
    b.usages(0x32, 0x32 + 7 - axes).shape(16, 8 - axes, -32767, 32767).input()
    b.page(0x0F)
    b.usage(0x92).collection(2).report(ids["state"])
    b.usage(0x9F, 0xA0, 0xA4, 0xA5, 0xA6).shape(1, 5, 0, 1).input()
    b.shape(1, 3, 0, 1).input(3).end()
    b.usage(0x21).collection(2).report(ids["effect"])
    b.usage(0x22).shape(8, 1, 1, 40).output()
    b.usage(0x25).collection(2).usage(0x26, 0x27, 0x30, 0x40, 0x41).shape(8, 1, 1, 5).output(0).end()
    b.usage(0x50, 0x54, 0x51, 0xA7).shape(16, 4, 0, 32767).output()
    b.usage(0x52).shape(8, 1, 0, 255).output()
    b.usage(0x53).shape(8, 1, 0, 255).output()
    b.usage(0x55).collection(2).page(0x01).usage(*((0x30, 0x31) if axes == 2 else (0x30,)))
    b.shape(1, axes, 0, 1).output().end()
    b.page(0x0F).usage(0x56).shape(1, 1, 0, 1).output()
    b.shape(1, 7 - axes, 0, 1).output(3)
    b.usage(0x57).collection(2).page(0x0A).usage(*range(1, axes + 1))
    b.shape(16, axes, 0, 35999).output().end()
    b.page(0x0F).usage(0x58).collection(2).page(0x0A).usage(1, 2).shape(16, 2, 0, 32767).output().end()
    b.page(0x0F).end()
    b.usage(0x73).collection(2).report(ids["constant"])
    b.usage(0x22).shape(8, 1, 1, 40).output()
    b.usage(0x70).shape(16, 1, -32767, 32767).output().end()
    b.usage(0x77).collection(2).report(ids["operation"])
    b.usage(0x22).shape(8, 1, 1, 40).output()
    b.usage(0x78).collection(2).usage(0x79, 0x7A, 0x7B).shape(8, 1, 1, 3).output(0).end()
    b.usage(0x7C).shape(8, 1, 0, 255).output().end()
    b.usage(0x90).collection(2).report(ids["free"]).usage(0x22).shape(8, 1, 1, 40).output().end()
    b.usage(0x95).collection(2).report(ids["control"])
    b.usage(0x96).collection(2).usage(0x97, 0x98, 0x99, 0x9A, 0x9B, 0x9C)
    if control_bits:
        b.shape(1, 6, 0, 1).output().shape(1, 2, 0, 1).output(3).end().end()
    else:
        b.shape(8, 1, 1, 6).output(0).end().end()
    b.usage(0x7D).collection(2).report(ids["gain"]).usage(0x7E).shape(8, 1, 0, 255).output().end()
    b.usage(0xAB).collection(2).report(ids["create"])
    b.usage(0x25).collection(2).usage(0x26, 0x27, 0x30, 0x40, 0x41).shape(8, 1, 1, 5).feature(0).end()
    b.page(0x01).usage(0x3B).shape(16, 1, 0, 511).feature().page(0x0F).end()
    b.usage(0x89).collection(2).report(ids["load"])
    b.usage(0x22).shape(8, 1, 1, 40).feature()
    b.usage(0x8B).collection(2).usage(0x8C, 0x8D, 0x8E).shape(8, 1, 1, 3).feature(0).end()
    b.usage(0xAC).shape(16, 1, 0, 32767).feature().end()
    return bytes(b.end().data)


OPENFFBOARD_IDS = {
    "axes": 0x01,
    "state": 0x02,
    "effect": 0x01,
    "constant": 0x05,
    "operation": 0x0A,
    "free": 0x0B,
    "control": 0x0C,
    "gain": 0x0D,
    "create": 0x11,
    "load": 0x12,
}
OTHER_IDS = {
    "axes": 0x21,
    "state": 0x07,
    "effect": 0x31,
    "constant": 0x15,
    "operation": 0x1A,
    "free": 0x1B,
    "control": 0x0B,
    "gain": 0x1D,
    "create": 0x05,
    "load": 0x06,
}


class StickUnit(Unit):
    """A two-axis stick (or one-axis wheel) that plays constant effects by struct layouts of its own.

    Effects end by themselves after their duration, as the class definition says; `clock` may be faked.
    """

    vendor_id, product_id, usage_page, usage = 0x1209, 0xFFB0, 1, 4
    product_string = "FFBoard"
    full_scale_n = 8.0

    def __init__(
        self, ids: dict[str, int] = OPENFFBOARD_IDS, *, axes: int = 2, control_bits: bool = True
    ) -> None:
        super().__init__()
        self.ids, self.axes, self.control_bits = ids, axes, control_bits
        self.descriptor = stick_descriptor(ids, axes=axes, control_bits=control_bits)
        self.clock = time.perf_counter
        self.reset()

    def reset(self) -> None:
        self.effects: dict[int, dict] = {}
        self.actuators = False
        self.created = 0
        self.room = 40

    def replug(self) -> None:
        self.reset()
        super().replug()

    def feature(self, report_id: int, data: bytes | None) -> bytes:
        if data is not None and report_id == self.ids["create"]:
            assert data[1] == 1 and len(data) == 4  # constant force
            self.created = next(k for k in range(1, self.room + 2) if k not in self.effects)
            if self.created <= self.room:
                self.effects[self.created] = {"magnitude": 0, "until": float("-inf"), "duration_ms": 0}
            return b""
        if data is None and report_id == self.ids["load"]:
            status = 1 if self.created in self.effects else 2
            return struct.pack("<BBBH", report_id, self.created, status, 0)
        raise OSError("unknown feature report")

    def output(self, report: bytes) -> None:
        kind, body = report[0], report[1:]
        if kind == self.ids["effect"] and len(body) > 10:
            layout = "<BB4HBBB" + f"{self.axes}H2H"
            assert len(body) == struct.calcsize(layout)
            block, effect, duration, _, _, _, gain, _, axis_bits, *rest = struct.unpack(layout, body)
            assert effect == 1 and gain == 255 and axis_bits >> self.axes & 1  # direction is used
            self.effects[block].update(duration_ms=duration, direction=rest[0])
        elif kind == self.ids["constant"]:
            block, magnitude = struct.unpack("<Bh", body)
            self.effects[block]["magnitude"] = magnitude
        elif kind == self.ids["operation"]:
            block, operation, loops = struct.unpack("<BBB", body)
            effect = self.effects[block]
            duration = float("inf") if effect["duration_ms"] in (0, 0xFFFF) else effect["duration_ms"] / 1000
            if operation == 1:
                effect["until"] = self.clock() + duration * loops
            elif operation == 3:
                effect["until"] = float("-inf")
        elif kind == self.ids["free"]:
            del self.effects[body[0]]
        elif kind == self.ids["control"]:
            if body[0] == 1:
                self.actuators = True
            elif body[0] == (8 if self.control_bits else 4):
                self.effects.clear()
            elif body[0] == (4 if self.control_bits else 3):
                for effect in self.effects.values():
                    effect["until"] = float("-inf")
        elif kind != self.ids["gain"]:
            raise AssertionError(f"unknown report {report.hex()}")

    def force_n(self) -> tuple[float, float]:
        """What the handle feels along HID's x and y."""
        x = y = 0.0
        for effect in self.effects.values():
            if self.plugged and self.actuators and self.clock() < effect["until"]:
                size = effect["magnitude"] / 32767 * self.full_scale_n
                if effect["direction"] == 9000:
                    x += size
                elif effect["direction"] == 18000:
                    y += size
                else:
                    raise AssertionError(effect)
        return x, y

    def move(self, x: float, y: float = 0.0, buttons: int = 0) -> None:
        """Positions as shares of the travel, HID's axes."""
        values = [round(32767 * x)] + ([round(32767 * y)] if self.axes == 2 else [])
        values += [0] * (8 - len(values))
        self.emit(struct.pack("<BQ8h", self.ids["axes"], buttons, *values))

    def tell_state(self, bits: int) -> None:
        """bits: paused, actuators enabled, safety switch, override, power, from the least."""
        self.emit(bytes((self.ids["state"], bits)))
