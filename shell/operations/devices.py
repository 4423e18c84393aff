"""List the devices: what each can do, or why it is not available and what to do about it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from palpate.devices.base import Availability, DeviceSpec
from palpate.devices.io_thread import Rate, ThreadedDevice
from palpate.devices.registry import DEVICES, find_devices, make_device, options_of
from palpate.mechanics.errors import OptionError
from palpate.operations._declare import EachOf, argument, operation, option

HARDWARE = ("spacemouse", "pid-ffb", "haply", "forcedimension", "openhaptics")
LEAST_MEASURE_S = 1.0


@dataclass(frozen=True)
class FoundDevice:
    """Devices, each with its rate where that was measured."""

    devices: Sequence[tuple[Availability, Rate | None]]

    def lines(self) -> list[str]:
        """For a person."""
        there = [(device, rate) for device, rate in self.devices if device.present]
        absent = [device for device, _ in self.devices if not device.present]
        lines = (
            ["there:", *(line for device, rate in there for line in _present(device, rate))] if there else []
        )
        lines += ["not there:", *(line for device in absent for line in _absent(device))] if absent else []
        if there:
            first = there[0][0].spec.name
            lines += ["", f"to touch something with one: palpate touch --device {first}"]
        return lines

    def as_json(self) -> dict[str, Any]:
        """Keys with units."""
        return {"devices": [figures(device, rate) for device, rate in self.devices]}


@operation(common="", progress=False)
def devices(
    names: Annotated[
        Sequence[str],
        argument(f"only these (all by default): {', '.join(DEVICES)}", metavar="NAME", count="*"),
    ] = (),
    *,
    measure: Annotated[
        float | None,
        option("open the hardware that is there, force off, and measure its rate for this long", unit="s"),
    ] = None,
    options: Annotated[Mapping[str, Any], EachOf({name: options_of(name) for name in HARDWARE})],
) -> FoundDevice:
    """Every device that was asked for, with its rate, Hz, where that was measured."""
    if measure is not None and not measure >= LEAST_MEASURE_S:
        raise OptionError(f"--measure is {measure}; it must be at least {LEAST_MEASURE_S:g} s")
    found = find_devices(list(names) or None, options)
    rates = {}
    if measure is not None:
        chosen = dict.fromkeys(d.spec.name for d in found if d.present and d.spec.name in HARDWARE)
        rates = {name: _measured(name, options[name], measure) for name in chosen}
    return FoundDevice([(d, rates.get(d.spec.name) if d.present else None) for d in found])


def _measured(name: str, options: Any, seconds: float) -> Rate:
    with make_device(name, options=options) as device:
        assert isinstance(device, ThreadedDevice)
        time.sleep(seconds + 0.1)
        return device.rate


def abilities(spec: DeviceSpec) -> str:
    """What a device can do, in one line for a person."""
    words = [f"{len(spec.sensed_axes)} axes", "rate control" if spec.control == "rate" else "position"]
    if spec.has_force:
        words.append(f"force to {spec.max_force_n:g} N on {', '.join(spec.actuated_axes)}")
        words.append(f"{spec.max_stiffness_n_per_m:g} N/m")
    else:
        words.append("no force: it is shown as an arrow and a plot")
    words.append(f"{spec.rate_hz:g} Hz")
    return ", ".join(words)


def _headed(device: Availability, *lines: str) -> list[str]:
    where = f" ({device.where})" if device.where else ""
    return [
        f"  {device.spec.name:<15} {device.spec.title}{where}",
        *(" " * 18 + line for line in lines if line),
    ]


def _present(device: Availability, rate: Rate | None) -> list[str]:
    measured = f"measured: {rate.hz:.0f} Hz, jitter {1e6 * rate.jitter_s:.0f} us" if rate else ""
    return _headed(device, abilities(device.spec), *device.spec.conditions, measured)


def _absent(device: Availability) -> list[str]:
    return _headed(device, f"why:   {device.why_not}", f"to do: {device.remedy}")


def figures(device: Availability, rate: Rate | None) -> dict[str, object]:
    """A device for JSON, keys with units."""
    spec = device.spec
    return {
        "name": spec.name,
        "title": spec.title,
        "present": device.present,
        "where": device.where,
        "why_not": device.why_not,
        "remedy": device.remedy,
        "control": spec.control,
        "sensed_axes": spec.sensed_axes,
        "actuated_axes": spec.actuated_axes,
        "max_force_n": spec.max_force_n,
        "max_stiffness_n_per_m": spec.max_stiffness_n_per_m,
        "max_damping_n_s_per_m": spec.max_damping_n_s_per_m,
        "workspace_radius_m": spec.workspace_radius_m,
        "rate_hz": spec.rate_hz,
        "buttons": spec.buttons,
        "conditions": spec.conditions,
        "simulated": spec.simulated,
        "measured_hz": rate.hz if rate else None,
        "measured_jitter_s": rate.jitter_s if rate else None,
    }
