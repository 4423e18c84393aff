"""An emulated unit behind a real kernel: /dev/uhid makes an HID device of it that hidapi opens as any other.

Event numbers and layouts are those of the kernel's include/uapi/linux/uhid.h.
"""

from __future__ import annotations

import errno
import os
import select
import struct
import threading
import time
from pathlib import Path

from ..fake_hid import Unit

DESTROY, OUTPUT, GET_REPORT, GET_REPORT_REPLY, CREATE2, INPUT2, SET_REPORT, SET_REPORT_REPLY = (
    *(1, 6, 9, 10),
    *(11, 12, 13, 14),
)
EVENT_BYTES, DATA_BYTES = 4380, 4096
BUS_USB = 3
APPEARS_S = 30.0


class KernelUnit:
    """Takes over a unit's `emit`, `unplug`, `replug`; what the kernel sends reaches `output`, `feature`."""

    def __init__(self, unit: Unit) -> None:
        self.unit = unit
        self.failure: Exception | None = None
        self._file = os.open("/dev/uhid", os.O_RDWR | os.O_CLOEXEC)
        self._created = False
        self._ended = threading.Event()
        self._serving = threading.Lock()
        unit.emit, unit.unplug, unit.replug = self.emit, self.unplug, self.replug
        self._create()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        self._wait_for_node()

    def _write(self, kind: int, body: bytes = b"") -> None:
        os.write(self._file, struct.pack("<I", kind) + body)

    def _create(self) -> None:
        unit, descriptor = self.unit, self.unit.descriptor
        body = struct.pack("<128s64s64s", unit.product_string.encode(), b"palpate/uhid", b"")
        body += struct.pack("<HHIIII", len(descriptor), BUS_USB, unit.vendor_id, unit.product_id, 1, 0)
        self._write(CREATE2, body + descriptor.ljust(DATA_BYTES, b"\0"))
        self._created = True

    def _wait_for_node(self) -> None:
        """The kernel makes the node in a work queue of its own."""
        wanted = f"{self.unit.vendor_id:08X}:{self.unit.product_id:08X}"
        end = time.monotonic() + APPEARS_S
        while time.monotonic() < end:
            for entry in Path("/sys/class/hidraw").glob("*/device/uevent"):
                node = Path("/dev") / entry.parts[-3]
                if wanted in entry.read_text() and node.exists():
                    return
            time.sleep(0.01)
        raise TimeoutError(f"the kernel made no hidraw node for {wanted}")

    def emit(self, report: bytes) -> None:
        """An input report."""
        if self._created:
            self._write(INPUT2, struct.pack("<H", len(report)) + report.ljust(DATA_BYTES, b"\0"))

    def unplug(self) -> None:
        """The device goes away."""
        self.unit.plugged = False
        if self._created:
            self._created = False
            self._write(DESTROY)

    def replug(self) -> None:
        """It comes back as a new one."""
        type(self.unit).replug(self.unit)
        self._create()
        self._wait_for_node()

    def _serve(self) -> None:
        while not self._ended.is_set():
            if self.unit.hang.is_set() or not select.select([self._file], [], [], 0.05)[0]:
                self._ended.wait(0.001)
                continue
            with self._serving:
                event = os.read(self._file, EVENT_BYTES)
                try:
                    self._answer(struct.unpack_from("<I", event)[0], event[4:])
                except (AssertionError, KeyError, struct.error) as error:
                    self.failure = error

    def settle(self) -> None:
        """Until nothing that was written lies in the kernel's queue any more."""
        while True:
            with self._serving:
                if not select.select([self._file], [], [], 0.0)[0]:
                    return
            time.sleep(0.001)

    def _answer(self, kind: int, body: bytes) -> None:
        if kind == OUTPUT:
            (size,) = struct.unpack_from("<H", body, DATA_BYTES)
            self.unit.writes.append(body[:size])
            self.unit.output(body[:size])
        elif kind == GET_REPORT:
            number, report_id = struct.unpack_from("<IB", body)
            try:
                data, error = self.unit.feature(report_id, None), 0
            except OSError:
                data, error = b"", errno.EIO
            reply = struct.pack("<IHH", number, error, len(data)) + data.ljust(DATA_BYTES, b"\0")
            self._write(GET_REPORT_REPLY, reply)
        elif kind == SET_REPORT:
            number, report_id, _, size = struct.unpack_from("<IBBH", body)
            try:
                self.unit.feature(report_id, body[8 : 8 + size])
                error = 0
            except OSError:
                error = errno.EIO
            self._write(SET_REPORT_REPLY, struct.pack("<IH", number, error))

    def close(self) -> None:
        """The device is gone; raises what the unit could not make sense of."""
        self._ended.set()
        self._thread.join()
        self.unplug()
        os.close(self._file)
        if self.failure is not None:
            raise self.failure
