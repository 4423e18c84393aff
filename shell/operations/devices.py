"""List the devices: what is there and what it can do, and for the rest why not and what to do about it."""

from __future__ import annotations

import time
from dataclasses import KW_ONLY, dataclass
from typing import Any

from palpate.devices.base import Availability, DeviceSpec
from palpate.devices.io_thread import Rate, ThreadedDevice
from palpate.devices.registry import DEVICES, find_devices, make_device, options_of
from palpate.mechanics.errors import OptionError
from palpate.operations._declare import Call, operand, operation
from palpate.output import Output

HARDWARE = ("spacemouse", "pid-ffb", "haply", "forcedimension", "openhaptics")
LEAST_MEASURE_S = 1.0


@dataclass(frozen=True)
class DevicesOperands:
    """Which, and whether they are measured."""

    names: list[str] = operand(
        (), f"only these (all by default): {', '.join(DEVICES)}", metavar="NAME", positional=True, count="*"
    )
    _: KW_ONLY
    measure: float | None = operand(
        None, "open the hardware that is there, force off, and measure its rate for this long", unit="s"
    )


def _answer(found: list[tuple[Availability, Rate | None]], asked: DevicesOperands, out: Output) -> int:
    there = [(device, rate) for device, rate in found if device.present]
    if there:
        out.say("there:", *(line for device, rate in there for line in _present(device, rate)))
    if len(there) < len(found):
        out.say("not there:", *(line for d, _ in found if not d.present for line in _absent(d)))
    if there:
        out.say("", f"to touch something with one: palpate touch --device {there[0][0].spec.name}")
    out.json({"devices": [figures(device, rate) for device, rate in found]})
    return 0


@operation(DevicesOperands, *map(options_of, HARDWARE), often="", answer=_answer, progress=False)
def devices(asked: DevicesOperands, call: Call) -> list[tuple[Availability, Rate | None]]:
    """Every device that was asked for, with its rate, Hz, where that was measured."""
    if asked.measure is not None and not asked.measure >= LEAST_MEASURE_S:
        raise OptionError(f"--measure is {asked.measure}; it must be at least {LEAST_MEASURE_S:g} s")
    options: dict[str, Any] = {name: call.of(options_of(name)) for name in HARDWARE}
    found = find_devices(asked.names or None, options)
    rates = {}
    if asked.measure is not None:
        chosen = dict.fromkeys(d.spec.name for d in found if d.present and d.spec.name in HARDWARE)
        rates = {name: _measured(name, options[name], asked.measure) for name in chosen}
    return [(device, rates.get(device.spec.name) if device.present else None) for device in found]


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
