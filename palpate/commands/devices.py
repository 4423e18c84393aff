"""List the devices: what is there and what it can do, and for the rest why not and what to do about it."""

from __future__ import annotations

import argparse

from devices.base import Availability, DeviceSpec
from devices.registry import DEVICES, find_devices
from palpate.arguments import add_json, emit_json, say

SUMMARY = "which devices are there, and for the others why not"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """`NAME...` and `--json`."""
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        help=f"only these (all by default): {', '.join(DEVICES)}",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Look, and tell."""
    found = find_devices(arguments.names or None)
    for device in found:
        say(arguments, *_lines(device))
    emit_json({"devices": [_plain(device) for device in found]}, arguments.json)
    return 0


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


def _lines(device: Availability) -> list[str]:
    mark = "yes" if device.present else "no "
    where = f" ({device.where})" if device.where else ""
    lines = [f"{mark} {device.name:<15} {device.title}{where}"]
    if device.present:
        lines.append(f"    {abilities(device.spec)}")
    else:
        lines.append(f"    why not: {device.why_not}")
        lines.append(f"    to do:   {device.remedy}")
    return lines


def _plain(device: Availability) -> dict[str, object]:
    spec = device.spec
    return {
        "name": device.name,
        "title": device.title,
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
    }
