"""Hostile bytes of devices: what a codec makes of damaged messages, reports and report descriptors."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from palpate.devices.codecs import haply, pid, spacemouse
from palpate.mechanics.errors import DeviceError

from .mutations import MUTATIONS

MESSAGES = 200
"""A seed."""
_ME = "049D"
_VECTOR = {"x": 0.01, "y": -0.02, "z": 0.03}
_DEVICE = {
    "device_id": _ME,
    "state": {
        "cursor_position": _VECTOR, "cursor_velocity": _VECTOR, "current_cursor_force": {"vector": _VECTOR},
    },
    "status": {"ready": True, "power_supply": True, "calibrated": True},
    "config": {
        "preset": "arm_front", "basis": {"permutation": "XYZ"},
        "gravity_compensation": {"scaling_factor": 1.0},
        "mount": {"transform": {"scale": {"x": 1.0}, "rotation": {"w": 1.0}, "position": _VECTOR}},
        "filters": {"damping": {"scalar": 0.1}, "force_gate": {"gain": 0.3}},
    },
}  # fmt: skip
_GRIP = {"device_id": "61576", "state": {"orientation": {"w": 0.0, "x": 1.0}, "buttons": {"a": True}}}
STATE = json.dumps({"inverse3": [_DEVICE], "wireless_verse_grip": [_GRIP]}).encode()
EVENT = json.dumps({"name": "device-disconnected", "data": {"device_id": _ME}}).encode()
STICK = bytes.fromhex(
    "05010904a1018501050919012940750195401500250181020501093009317510950216018026ff7f81021932293775109506"
    "16018026ff7f8102050f0992a1028502099f09a009a409a509a67501950515002501810275019503150025018103c00921a1"
    "0285010922750895011501252891020925a1020926092709300940094175089501150125059100c009500954095109a77510"
    "9504150026ff7f9102095275089501150026ff009102095375089501150026ff0091020955a1020501093009317501950215"
    "0025019102c0050f095675019501150025019102750195051500250191030957a102050a09010902751095021500279f8c00"
    "009102c0050f0958a102050a0901090275109502150026ff7f9102c0050fc00973a102850509227508950115012528910209"
    "707510950116018026ff7f9102c00977a102850a0922750895011501252891020978a1020979097a097b7508950115012503"
    "9100c0097c75089501150026ff009102c00990a102850b092275089501150125289102c00995a102850c0996a10209970998"
    "0999099a099b099c7501950615002501910275019502150025019103c0c0097da102850d097e75089501150026ff009102c0"
    "09aba10285110925a102092609270930094009417508950115012505b100c00501093b75109501150026ff01b102050fc009"
    "89a102851209227508950115012528b102098ba102098c098d098e7508950115012503b100c009ac75109501150026ff7fb1"
    "02c0c0"
)
"""The report descriptor of a force-feedback stick laid out as OpenFFBoard's."""


def tried(seed: int, count: int = MESSAGES) -> int:
    """Hand `count` damaged messages to the codecs; returns 0. Raises what a codec raises beyond DeviceError,
    and ValueError where it hands on what is no number."""
    random = np.random.default_rng([31, seed])
    for _ in range(count):
        sound, decode = _CODECS[int(random.integers(len(_CODECS)))]
        data = sound
        for _ in range(int(random.integers(1, 4))):
            data = MUTATIONS[int(random.integers(len(MUTATIONS)))](data, random) or b"\0"
        try:
            _check_numbers(decode(data, random))
        except DeviceError:
            continue
    return 0


def _stick(data: bytes, random: np.random.Generator) -> Any:
    layout = pid.PidLayout.from_bytes(data)
    reports = [random.bytes(int(random.integers(0, min(layout.longest_input, 100) + 2))) for _ in range(4)]
    seen = [(layout.axes(report), layout.fault(report)) for report in reports]
    return seen, layout.set_effect(1, 90.0, 100), layout.magnitude(1, -0.5), layout.operate(1, pid.START)


_CODECS: tuple[tuple[bytes, Callable[[bytes, np.random.Generator], Any]], ...] = (
    (STATE, lambda data, _: haply.decode(data, _ME)),
    (STATE, lambda data, _: haply.config(data, _ME)),
    (STATE, lambda data, _: (haply.version(data), haply.spelling(data), bool(haply.number(data)))),
    (EVENT, lambda data, _: haply.event_fault(data, _ME)),
    (bytes(range(1, 14)), lambda data, _: spacemouse.decode(data, spacemouse.Deflection())),
    (STICK, _stick),
    (STICK, _stick),
)


def _check_numbers(value: Any) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"a codec hands on {value}")
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = vars(value).values()
    if isinstance(value, tuple | list | type({}.values())):
        for each in value:
            _check_numbers(each)
