"""Haply Inverse service: JSON messages to states and commands back (docs.haply.co, inverse service,
WebSocket).

On connecting the service sends an inventory, then exactly one state for each message of ours. Commands are
one-shot: silence returns the device to idle. Newer services spell a vector's key `vector`, older ones
`values`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from palpate.mechanics.errors import DeviceError
from palpate.mechanics.tip_state import IDENTITY_QUATERNION

BASIS = "XYZ"
GRIPS = ("wireless_verse_grip", "verse_grip")
GRIP_BUTTONS = ("a", "b", "c")
_UNREADABLE = (ValueError, TypeError, AttributeError, KeyError, OverflowError, RecursionError)
"""What reading a message raises that is none of the service's, or is nested by thousands."""


@dataclass(frozen=True)
class HaplyConfig:
    """What a service of 3.5 or later tells of the way from a command to the hand; None: it does not tell.

    preset, basis: names. mount_scale, mount_position, mount_turn: of the mount's transform; the turn is the
    angle of its rotation, rad. damping_n_s_per_m: the greatest of the filter's; force_gate: its gain.
    """

    preset: str | None = None
    basis: str | None = None
    mount_position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mount_turn_rad: float = 0.0
    mount_scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    damping_n_s_per_m: float | None = None
    force_gate: float | None = None
    gravity_compensation: float | None = None
    simulated: bool = False


def config(text: str | bytes, device_id: str) -> HaplyConfig | None:
    """The configuration of one device in an inventory or full state; None where the message holds none.

    Raises DeviceError where it holds one that cannot be read: forces must not pass through the unknown.
    """
    try:
        devices = json.loads(text).get("inverse3") or []
        found = next((d.get("config") for d in devices if d.get("device_id") == device_id), None)
        return _config(found) if found else None
    except _UNREADABLE as error:
        raise DeviceError(
            f"the Inverse service's configuration cannot be read ({error}): update this program"
        ) from error


def _config(table: Mapping[str, Any]) -> HaplyConfig:
    filters, mount = table.get("filters") or {}, table.get("mount") or {}
    mount = mount.get("transform") or mount
    damping, gate, gravity = (
        filters.get("damping"),
        filters.get("force_gate"),
        table.get("gravity_compensation"),
    )
    rotation = mount.get("rotation") or {}
    w = min(1.0, abs(_finite(rotation.get("w", 1.0))))
    scale = mount.get("scale") or {}
    return HaplyConfig(
        _name(table.get("preset"), "preset"),
        _name(table.get("basis"), "permutation"),
        _vector(mount.get("position") or {}),
        2.0 * math.acos(w),
        (_finite(scale.get("x", 1.0)), _finite(scale.get("y", 1.0)), _finite(scale.get("z", 1.0))),
        None if damping is None else max(map(_finite, _numbers(damping)), default=0.0),
        None if gate is None else _finite(gate.get("gain", 0.0)),
        None
        if gravity is None
        else gravity.get("enabled", True) * _finite(gravity.get("scaling_factor", 1.0)),
        _is_simulated(table),
    )


def _name(value: Any, key: str) -> str | None:
    """A name, bare or in a table under `key`."""
    value = value.get(key) if isinstance(value, Mapping) else value
    return None if value is None else str(value)


def _numbers(value: Any) -> list[float]:
    """Every number in a table, however deep."""
    if isinstance(value, Mapping):
        return [number for inner in value.values() for number in _numbers(inner)]
    return [float(value)] if isinstance(value, int | float) and not isinstance(value, bool) else []


def _is_simulated(table: Mapping[str, Any]) -> bool:
    """A flag or a word: the documentation names the feature (3.5), not the field."""
    words = [table.get(k) for k in ("type", "sub_type", "port", "streaming_mode", "device_type")]
    words.append((table.get("device_info") or {}).get("device_type"))
    return any(table.get(k) is True for k in ("simulated", "is_simulated", "virtual")) or any(
        isinstance(word, str) and ("simul" in word.lower() or "virtual" in word.lower()) for word in words
    )


def number(text: str | bytes) -> float | None:
    """The number of an answer about one setting: bare, or under `data` and `value`; None where it is none."""
    try:
        answer = json.loads(text)
        for key in ("data", "value"):
            answer = answer.get(key, answer) if isinstance(answer, Mapping) else answer
        numbers = _numbers({"": answer})
    except (ValueError, OverflowError, RecursionError):
        return None
    return numbers[0] if len(numbers) == 1 else None


def version(text: str | bytes) -> str:
    """Of the service, from the answer to GET /version; '' where it does not tell."""
    try:
        answer = json.loads(text)
        answer = answer.get("data") or answer
        return str(answer.get("git_tag") or answer.get("project_version") or "")
    except (ValueError, AttributeError, RecursionError):
        return ""


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
    except _UNREADABLE as error:
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
    return _finite(value.get("x", 0.0)), _finite(value.get("y", 0.0)), _finite(value.get("z", 0.0))


def _finite(value: Any) -> float:
    """A number; raises ValueError or TypeError for anything else, NaN and infinity too."""
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{number} is no finite number")
    return number


def _grip(message: Mapping[str, Any]) -> tuple[tuple[float, float, float, float], int]:
    for kind in GRIPS:
        for grip in message.get(kind) or []:
            state = grip.get("state") or {}
            q = state.get("orientation") or {}
            w, x, y, z = (_finite(q.get(k, d)) for k, d in zip("wxyz", IDENTITY_QUATERNION, strict=True))
            pressed = state.get("buttons") or {}
            return (w, x, y, z), sum(bool(pressed.get(b)) << i for i, b in enumerate(GRIP_BUTTONS))
    return IDENTITY_QUATERNION, 0


def spelling(text: str | bytes) -> str:
    """'vector' or 'values': how the service that sent this writes vectors; 'vector' if it does not show."""
    return (
        "values"
        if '"values"' in (text if isinstance(text, str) else text.decode(errors="replace"))
        else "vector"
    )


def probe(device_id: str) -> str:
    """Ask for a state without commanding a force."""
    return _command(device_id, {"probe_position": {}})


def force(device_id: str, force_n: tuple[float, float, float], key: str = "vector") -> str:
    """Command a force on the tool, one-shot."""
    x, y, z = (float(v) for v in force_n)
    return _command(device_id, {"set_cursor_force": {key: {"x": x, "y": y, "z": z}}})


def _command(device_id: str, commands: dict[str, Any]) -> str:
    return json.dumps({"inverse3": [{"device_id": device_id, "commands": commands}]}, separators=(",", ":"))


def introduction(device_id: str, profile: str, shown: HaplyConfig | None = None, preset: str = "") -> str:
    """The first message: names this program's profile, asks for its frame and filters, probes.

    Only what the inventory has `shown` is asked for, in this session alone: the basis X right, Y forward,
    Z up; the mount by `preset`, or, for '', as it is; no damping by the service.
    """
    session: dict[str, Any] = {"profile": {"name": profile}}
    device: dict[str, Any] = {}
    if shown is not None:
        if shown.basis is not None:
            session["basis"] = {"permutation": BASIS}
        if shown.preset is not None and preset:
            device["preset"] = {"preset": preset}
        if shown.damping_n_s_per_m:
            device["damping"] = {"scalar": 0.0}
    about: dict[str, Any] = {"device_id": device_id, "commands": {"probe_position": {}}}
    if device:
        about["configure"] = device
    return json.dumps({"session": {"configure": session}, "inverse3": [about]}, separators=(",", ":"))


def full_state(device_id: str) -> str:
    """Ask for a state that holds the configuration as well."""
    about = {"device_id": device_id, "commands": {"probe_position": {}}}
    return json.dumps(
        {"session": {"force_render_full_state": {}}, "inverse3": [about]}, separators=(",", ":")
    )


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
    except (ValueError, RecursionError):
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
