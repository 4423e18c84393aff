"""Every device by name: one entry a device, its module loaded only when asked for."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from palpate.devices.base import Availability, Clock, DeviceSpec, PositionSource, host_clock
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.names import unknown

DEVICES: dict[str, tuple[str, str, str]] = {
    "mouse": ("palpate.devices.mouse", "MouseDevice", "MouseOptions"),
    "spacemouse": ("palpate.devices.spacemouse", "make", "SpacemouseOptions"),
    "pid-ffb": ("palpate.devices.pid_ffb", "make", "PidOptions"),
    "haply": ("palpate.devices.haply", "make", "HaplyOptions"),
    "forcedimension": ("palpate.devices.forcedimension", "make", "ForceDimensionOptions"),
    "openhaptics": ("palpate.devices.openhaptics", "make", "OpenHapticsOptions"),
    "simulated": ("palpate.devices.virtual_hand", "SimulatedHand", "SimulatedOptions"),
    "replay": ("palpate.devices.replay", "ReplayDevice", "ReplayOptions"),
}
"""name: (module, what makes one there, its options). A module also has `find(options=None)`."""


@dataclass(frozen=True)
class DeviceChoice:
    """A device by name and the keywords of its maker: can be pickled, so that the servo process builds it."""

    name: str
    options: Mapping[str, Any] = field(default_factory=dict)

    def make(self, clock: Clock = host_clock) -> PositionSource:
        """The device, not yet open."""
        return make_device(self.name, clock=clock, **self.options)


def _module(name: str) -> Any:
    if name not in DEVICES:
        raise DeviceError(unknown(name, "device", DEVICES, " (see 'palpate devices')"))
    return importlib.import_module(DEVICES[name][0])


def make_device(name: str, *, clock: Clock = host_clock, **options: Any) -> PositionSource:
    """A device by name, not yet open; raises DeviceError for a name that is not known."""
    module = _module(name)
    return getattr(module, DEVICES[name][1])(clock=clock, **options)


def spec_of(name: str) -> DeviceSpec:
    """What a kind of device can do, before any is open; raises DeviceError for a name that is not known."""
    return _module(name).SPEC


def options_of(name: str) -> type:
    """The options dataclass of a kind of device; raises DeviceError for a name that is not known."""
    return getattr(_module(name), DEVICES[name][2])


def find_devices(
    names: list[str] | None = None, options: Mapping[str, Any] | None = None
) -> list[Availability]:
    """What is there, and for the rest why not, in the registry's order; options: of a kind, by its name."""
    found: list[Availability] = []
    for name in names or DEVICES:
        found += _module(name).find((options or {}).get(name))
    return found
