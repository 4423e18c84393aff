"""3Dconnexion SpaceMouse through hidapi: six axes of deflection, no force; a rate device.

Tested against emulators built from published protocols; no hardware tried.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.devices.base import Availability, Clock, DeviceSpec, host_clock
from palpate.devices.codecs import spacemouse as codec
from palpate.devices.hid_port import HidPort, enumerate_devices, load, opened, permitted
from palpate.devices.io_thread import Reading, ThreadedDevice
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.options import option

SPEC = DeviceSpec(
    name="spacemouse",
    title="3Dconnexion SpaceMouse",
    control="rate",
    sensed_axes=("x", "y", "z", "rx", "ry", "rz"),
    max_speed_m_per_s=0.2,
    rate_hz=62.0,
    buttons=2,
)
REPORT_BYTES = 64
QUIET_S = 0.01
RELEASED_S = 0.2
"""A cap that is held deflected reports every 8 ms; this long without a report counts as let go."""


@dataclass(frozen=True)
class SpacemouseOptions:
    """full_speed_m_per_s: the tip's speed at full deflection (before the mapper's scale)."""

    full_speed_m_per_s: float = option(
        0.05, "tip speed at full deflection of a SpaceMouse", unit="m/s", flag="--spacemouse-speed"
    )


class SpacemouseWire:
    """The blocking side: hidapi. `hid` may be a stand-in with hidapi's interface."""

    spec = SPEC

    def __init__(self, options: SpacemouseOptions, clock: Clock, hid: Any = None) -> None:
        self.options = options
        self._clock = clock
        self._hid = hid
        self._port: HidPort | None = None

    def connect(self) -> None:
        """Open the first SpaceMouse that is there and light its ring."""
        entries = enumerate_devices(_is_spacemouse, module=self._hid)
        if not entries:
            raise DeviceError("no SpaceMouse is plugged in: plug one in, or choose another --device")
        entry = entries[0]
        self._port = HidPort(entry["path"].decode(), entry["vendor_id"], module=self._hid)
        self._deflection = codec.Deflection()
        self._report_s = self._reading_s = self._clock()
        self._set_led(True)

    def _set_led(self, on: bool) -> None:
        try:
            opened(self._port).write(codec.led(on))
        except OSError:
            pass  # several models have no ring to light

    def exchange(self, force_on_tool_n: np.ndarray | None, timeout_s: float) -> Reading | None:
        """The newest deflection as a velocity; a device that is silent and still attached is at rest."""
        reports = opened(self._port).drain(REPORT_BYTES, max(1, round(timeout_s * 1000)))
        now = self._clock()
        for report in reports:
            self._deflection = codec.decode(report, self._deflection)
        if reports:
            self._report_s = now
        elif now - self._reading_s < QUIET_S:
            return None
        elif now - self._report_s > RELEASED_S and not self._deflection.at_rest:
            # the report that said 'released' was lost: a tip must not creep on for ever
            self._deflection = codec.Deflection(
                buttons=self._deflection.buttons, battery_percent=self._deflection.battery_percent
            )
        self._reading_s = now
        return Reading(
            velocity_m_per_s=self.options.full_speed_m_per_s * np.array(self._deflection.translation),
            buttons=self._deflection.buttons,
        )

    def disconnect(self) -> None:
        """Darken the ring and close."""
        if self._port is not None:
            self._set_led(False)
            self._port.close()
            self._port = None


def make(
    options: SpacemouseOptions | None = None, *, clock: Clock = host_clock, hid: Any = None
) -> ThreadedDevice:
    """A SpaceMouse, not yet open."""
    return ThreadedDevice(SpacemouseWire(options or SpacemouseOptions(), clock, hid), clock=clock)


def _is_spacemouse(entry: dict[str, Any]) -> bool:
    return entry["product_id"] in codec.PRODUCTS.get(entry["vendor_id"], ())


def find(options: SpacemouseOptions | None = None, *, hid: Any = None) -> list[Availability]:
    """Every SpaceMouse that is plugged in, or why there is none."""
    try:
        entries = enumerate_devices(_is_spacemouse, module=hid or load())
    except DeviceError as error:
        return [Availability(SPEC, why_not=str(error), remedy="pip install hidapi")]
    if not entries:
        return [Availability(SPEC, why_not="none is plugged in", remedy="plug one in")]
    return [permitted(entry, SPEC) for entry in entries]
