"""hidapi behind three calls, and the words for what goes wrong with it.

The hidapi wheel (0.15.0) has two modules. On Linux `hidraw` (the kernel's) is right: `hid` (libusb)
detaches the kernel's driver. Elsewhere there is only `hid`. PyPI's other package called `hid` installs the
same name.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

from palpate.devices.base import Availability, DeviceSpec
from palpate.mechanics.errors import DeviceError

DRAIN_LIMIT = 256
"""More than the kernel queues (about 63): one drain ends even when a device floods."""


def load() -> ModuleType:
    """The hidapi module for this system; raises DeviceError with what to install."""
    name = "hidraw" if sys.platform.startswith("linux") else "hid"
    try:
        module = importlib.import_module(name)
    except ImportError as error:
        raise DeviceError("the library hidapi is missing: pip install hidapi") from error
    if not hasattr(module, "device") or not hasattr(module, "enumerate"):
        raise DeviceError(
            f"the module '{name}' is not hidapi's: another package has taken its name; "
            "pip uninstall hid && pip install --force-reinstall hidapi"
        )
    return module


def udev_rule(vendor_id: int) -> str:
    """What to paste so that the person at the screen may open a vendor's HID devices on Linux."""
    rule = f'KERNEL=="hidraw*", ATTRS{{idVendor}}=="{vendor_id:04x}", TAG+="uaccess"'
    return (
        f"echo '{rule}' | sudo tee /etc/udev/rules.d/70-palpate-{vendor_id:04x}.rules && "
        "sudo udevadm control --reload && sudo udevadm trigger, then replug it"
    )


def may_open(path: str) -> bool:
    """Whether this user may read and write a device's node (always true where paths are no files)."""
    return not os.path.exists(path) or os.access(path, os.R_OK | os.W_OK)


class HidPort:
    """One open HID device; every failure is an OSError or DeviceError."""

    def __init__(self, path: str, vendor_id: int, *, module: Any = None) -> None:
        hid = module or load()
        self._device = hid.device()
        try:
            self._device.open_path(path.encode())
        except OSError as error:
            if not may_open(path):
                raise DeviceError(f"no permission for {path}: {udev_rule(vendor_id)}") from error
            raise DeviceError(
                f"{path} cannot be opened: is another program using it, or was it unplugged?"
            ) from error
        self._device.set_nonblocking(1)

    def drain(self, size: int, timeout_ms: int) -> list[bytes]:
        """Every report that waits, oldest first; waits up to `timeout_ms` for a first. OSError: unplugged."""
        first = self._device.read(size, timeout_ms) if timeout_ms > 0 else self._device.read(size)
        reports = []
        while first:
            reports.append(bytes(first))
            if len(reports) >= DRAIN_LIMIT:
                break
            first = self._device.read(size)
        return reports

    def write(self, report: bytes) -> None:
        """Send an output report, its id first. hidapi returns -1 instead of raising: made an OSError here."""
        if self._device.write(report) < 0:
            raise OSError(f"writing report 0x{report[0]:02x} failed: the device was unplugged or refused it")

    def set_feature(self, report: bytes) -> None:
        """Send a feature report, its id first."""
        if self._device.send_feature_report(report) < 0:
            raise OSError(f"feature report 0x{report[0]:02x} was refused")

    def get_feature(self, report_id: int, size: int) -> bytes:
        """A feature report, its id first, `size` bytes with the id."""
        data = bytes(self._device.get_feature_report(report_id, size))
        if not data:
            raise OSError(f"feature report 0x{report_id:02x} was not given")
        return data

    def descriptor(self) -> bytes:
        """The report descriptor."""
        return bytes(self._device.get_report_descriptor())

    def close(self) -> None:
        """Release it; never raises."""
        self._device.close()


def permitted(entry: dict[str, Any], spec: DeviceSpec) -> Availability:
    """hidapi's entry as `palpate devices` lists it: there, where this user may read and write it."""
    path, spec = entry["path"].decode(), replace(spec, title=entry.get("product_string") or spec.title)
    if may_open(path):
        return Availability(spec, path)
    return Availability(spec, path, f"no permission for {path}", udev_rule(entry["vendor_id"]))


def opened(port: HidPort | None) -> HidPort:
    """The port, where it is open; raises DeviceError where `connect` has not been called."""
    if port is None:
        raise DeviceError("the device is not open: call open() or use it in a with statement")
    return port


def enumerate_devices(
    wanted: Callable[[dict[str, Any]], bool], *, module: Any = None
) -> list[dict[str, Any]]:
    """hidapi's entries that `wanted` accepts, one a path (a device may list a node once for each usage)."""
    found: dict[str, dict[str, Any]] = {}
    for entry in (module or load()).enumerate():
        if wanted(entry):
            found.setdefault(entry["path"].decode(errors="replace"), entry)
    return [found[path] for path in sorted(found)]
