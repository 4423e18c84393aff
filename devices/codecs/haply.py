"""Haply Inverse service: JSON messages to states and commands back (docs.haply.co, inverse service,
WebSocket).

On connecting the service sends an inventory, then exactly one state for each message of ours. Commands are
one-shot: silence returns the device to idle. Newer services spell a vector's key `vector`, older ones
`values`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mechanics.errors import DeviceError
from mechanics.state import IDENTITY_QUATERNION

GRIPS = ("wireless_verse_grip", "verse_grip")
GRIP_BUTTONS = ("a", "b", "c")


@dataclass(frozen=True)
class HaplyState:
    """One state of one Inverse3: m, m/s, N; quaternion (w, x, y, z) and buttons are of its grip."""

    device_id: str
    position_m: tuple[float, float, float]
    velocity_m_per_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    force_n: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = IDENTITY_QUATERNION
    buttons: int = 0
    calibrated: bool = True
    fault: str = ""


def decode(text: str | bytes, device_id: str = "") -> HaplyState | None:
    """The state of one device (the first for ''); None where the message holds no such state.

    Raises DeviceError for a message that is no JSON object or whose numbers are no numbers.
    """
    try:
        message = json.loads(text)
        devices = message.get("inverse3") or []
        chosen = [d for d in devices if not device_id or d.get("device_id") == device_id]
        if not chosen or "state" not in chosen[0] or "cursor_position" not in chosen[0]["state"]:
            return None
        return _state(message, chosen[0])
    except (ValueError, TypeError, AttributeError, KeyError) as error:
        raise DeviceError(
            f"the Inverse service sent a message that cannot be read ({error}): update it"
        ) from error


def _state(message: Mapping[str, Any], device: Mapping[str, Any]) -> HaplyState:
    state, status = device["state"], device.get("status") or {}
    fault = ""
    if not status.get("power_supply", True):
        fault = "the Inverse3 has no power"
    elif not status.get("ready", True):
        fault = "the Inverse3 is not ready"
    quaternion, buttons = _grip(message)
    return HaplyState(
        str(device.get("device_id", "")),
        _vector(state["cursor_position"]),
        _vector(state.get("cursor_velocity") or {}),
        _vector(state.get("current_cursor_force") or {}),
        quaternion,
        buttons,
        bool(status.get("calibrated", True)),
        fault,
    )


def _vector(value: Mapping[str, Any]) -> tuple[float, float, float]:
    """x, y, z of a vector, bare or under either spelling."""
    value = value.get("vector") or value.get("values") or value
    return (float(value.get("x", 0.0)), float(value.get("y", 0.0)), float(value.get("z", 0.0)))


def _grip(message: Mapping[str, Any]) -> tuple[tuple[float, float, float, float], int]:
    for kind in GRIPS:
        for grip in message.get(kind) or []:
            state = grip.get("state") or {}
            q = state.get("orientation") or {}
            w, x, y, z = (float(q.get(k, d)) for k, d in zip("wxyz", IDENTITY_QUATERNION, strict=True))
            pressed = state.get("buttons") or {}
            return (w, x, y, z), sum(bool(pressed.get(b)) << i for i, b in enumerate(GRIP_BUTTONS))
    return IDENTITY_QUATERNION, 0


def spelling(text: str | bytes) -> str:
    """'vector' or 'values': how the service that sent this writes vectors; 'vector' if it does not show."""
    return "values" if '"values"' in (text if isinstance(text, str) else text.decode()) else "vector"


def probe(device_id: str) -> str:
    """Ask for a state without commanding a force."""
    return _command(device_id, {"probe_position": {}})


def force(device_id: str, force_n: tuple[float, float, float], key: str = "vector") -> str:
    """Command a force on the tool, one-shot."""
    x, y, z = (float(v) for v in force_n)
    return _command(device_id, {"set_cursor_force": {key: {"x": x, "y": y, "z": z}}})


def _command(device_id: str, commands: dict[str, Any]) -> str:
    return json.dumps({"inverse3": [{"device_id": device_id, "commands": commands}]}, separators=(",", ":"))


def introduction(device_id: str, profile: str) -> str:
    """The first message: names this program's profile and probes."""
    body = {
        "session": {"configure": {"profile": {"name": profile}}},
        "inverse3": [{"device_id": device_id, "commands": {"probe_position": {}}}],
    }
    return json.dumps(body, separators=(",", ":"))


EVENT_FAULTS = {
    "disconnected": "the Inverse3 was disconnected",
    "busy": "another program holds the Inverse3",
    "device-safety-triggered": "the Inverse3's own safety stopped it: let go, then enable force again",
    "calibration-failed": "the Inverse3 could not calibrate: move it to its rest and replug it",
}


def event_fault(text: str | bytes, device_id: str = "") -> str:
    """What an event (port 10020) means for our device: a fault in plain words, '' where it is harmless.

    Events carry a `name` such as 'device-disconnected' and, in `data`, the device that they are about.
    """
    try:
        message = json.loads(text)
    except ValueError:
        return ""
    if not isinstance(message, dict):
        return ""
    inner = message.get("data")
    data = inner if isinstance(inner, dict) else message
    about = str(data.get("device_id") or "")
    if device_id and about and about != device_id:
        return ""
    name = str(message.get("name") or message.get("event") or "")
    return next((words for key, words in EVENT_FAULTS.items() if name.endswith(key)), "")
