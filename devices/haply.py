"""Haply Inverse3 through its Inverse service (WebSocket on this machine).

A service of 3.5 or later stands between a command and the motors: a global force scale, a damping filter, a
force gate, a mount with a scale, a basis. What it tells of them is read at every connection. The basis, the
mount and the damping are set for this session alone; commands are divided by the force scale, so that a
newton here is one at the hand, and the greatest force is what then can act; the force gate, the maker's guard
against oscillation, is left alone and declared. A frame that is mirrored or scaled is refused.

Sources: docs.haply.co, Inverse service 3.5 (WebSocket protocol, device configuration, basis, mount and
workspace, settings, HTTP, migration to 3.5). The meaning of the force gate's gain is not documented there.
Tested against emulators built from published protocols; no hardware tried.
"""

from __future__ import annotations

import http.client
import math
import time
import urllib.request
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.devices.base import Availability, Clock, DeviceSpec, host_clock
from palpate.devices.codecs import haply as codec
from palpate.devices.io_thread import ForcefulDevice, Reading, found
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.extras import install_words
from palpate.mechanics.options import Ranged, option

SPEC = DeviceSpec(
    name="haply",
    title="Haply Inverse3",
    actuated_axes=("x", "y", "z"),
    max_force_n=10.0,
    max_stiffness_n_per_m=1000.0,
    max_damping_n_s_per_m=5.0,
    max_speed_m_per_s=1.0,
    workspace_radius_m=0.15,
    buttons=3,
)
OPEN_S = 1.0
FAULT_SHOWN_S = 1.0
EVENTS_EVERY_S = 0.01
LEAST_PERIOD_S = 0.0005
HTTP_S = 0.5
LEAST_SCALE, MOST_SCALE = 0.01, 10.0
PROFILE = "palpate"
_NO_SERVICE = (
    "the Haply Inverse service does not answer at {uri}: install it from Haply's developer site, start it, "
    "and connect the Inverse3"
)


@dataclass(frozen=True)
class HaplyOptions(Ranged):
    """Where the service is and which device of it."""

    uri: str = option("ws://localhost:10001", "state and command socket", flag="--haply-uri")
    events_uri: str = option("ws://localhost:10020", "event socket; '' for none", flag="--haply-events-uri")
    device_id: str = option("", "which Inverse3; '' for the first", flag="--haply-device")
    answer_s: float = option(
        0.1,
        "silence after which it counts as gone",
        unit="s",
        flag="--haply-answer",
        low=0.002,
        high=10.0,
    )
    preset: str = option(
        "arm_front_centered",
        "the service's mount (3.5 or later): origin in the workspace's middle; '' keeps the one that it has",
        flag="--haply-preset",
    )


class HaplyWire:
    """The blocking side: one message out, exactly one state back, over `websockets`."""

    def __init__(self, options: HaplyOptions, clock: Clock) -> None:
        self.options = options
        self.spec = SPEC
        self._scale = 1.0
        self._clock = clock
        self._socket: Any = None
        self._events: Any = None
        self._open = ExitStack()

    def connect(self) -> None:
        """Open both sockets, read the inventory, introduce ourselves."""
        client = _client()
        uri = self.options.uri
        try:
            self._socket = self._enter(client, uri)
        except (OSError, TimeoutError, client_errors()) as error:
            raise DeviceError(_NO_SERVICE.format(uri=uri)) from error
        try:
            inventory = self._socket.recv(timeout=OPEN_S)
            first = codec.decode(inventory, self.options.device_id)
            if first is None:
                raise DeviceError(
                    f"the Inverse service has no Inverse3 {self.options.device_id}".rstrip()
                    + ": connect and power it, wait until its light is steady"
                )
            self.device_id = first.device_id
            self._key = codec.spelling(inventory)
            shown = codec.config(inventory, self.device_id)
            self._ask(codec.introduction(self.device_id, PROFILE, shown, self.options.preset))
            if shown is not None:
                shown = codec.config(self._ask(codec.full_state(self.device_id)), self.device_id) or shown
            self._settle(shown)
        except (OSError, TimeoutError, client_errors()) as error:
            self.disconnect()
            raise DeviceError(
                f"the Inverse service at {uri} does not speak as expected ({error}): update it"
            ) from error
        except DeviceError:
            self.disconnect()
            raise
        self._fault, self._fault_until_s = "", 0.0
        self._next_events_s = 0.0
        self._connect_events(client)

    def _ask(self, message: str) -> str | bytes:
        self._socket.send(message)
        return self._socket.recv(timeout=OPEN_S)

    def _settle(self, shown: codec.HaplyConfig | None) -> None:
        """What acts between a command and the hand, into the specification; refuses what cannot be undone."""
        base = self.options.uri.replace("ws", "http", 1).rstrip("/")
        version = codec.version(_get(f"{base}/version"))
        scale = codec.number(_get(f"{base}/settings/devices/force_scale"))
        words = [
            f"Inverse service {version}" if version else "the Inverse service does not report its version"
        ]
        if scale is None:
            words.append("its force scale is not reported and taken as 1")
        elif not LEAST_SCALE <= scale <= MOST_SCALE:
            raise DeviceError(
                f"the Inverse service scales forces by {scale:g}: set its devices/force_scale to 1"
            )
        elif scale != 1.0:
            words.append(f"its force scale of {scale:g} is undone; at most {_most(scale):g} N can act")
        self._scale = 1.0 if scale is None else scale
        damping = 0.0
        if shown is None:
            words.append("it does not report its filters and its mount")
        else:
            _refuse_mirrored_or_scaled(shown)
            words += _declared(shown)
            damping = shown.damping_n_s_per_m or 0.0
        self.spec = replace(
            SPEC,
            max_force_n=_most(self._scale),
            max_damping_n_s_per_m=max(0.0, SPEC.max_damping_n_s_per_m - damping),
            conditions=tuple(words),
            simulated=shown is not None and shown.simulated,
        )

    def _enter(self, client: Any, uri: str) -> Any:
        connection = client.connect(uri, compression=None, open_timeout=OPEN_S, close_timeout=0.2)
        return self._open.enter_context(connection)

    def _connect_events(self, client: Any) -> None:
        self._events = None
        if not self.options.events_uri:
            return
        try:
            self._events = self._enter(client, self.options.events_uri)
        except (OSError, TimeoutError, client_errors()):
            pass  # older services have no event socket; a state's own status says the rest

    def exchange(self, force_on_tool_n: np.ndarray | None, timeout_s: float) -> Reading | None:
        """A force or a probe out, its one state back. A service silent for `answer_s` counts as gone."""
        started = time.perf_counter()
        if force_on_tool_n is None:
            message = codec.probe(self.device_id)
        else:
            message = codec.force(self.device_id, tuple(force_on_tool_n / self._scale), self._key)
        self._socket.send(message)
        try:
            answer = self._socket.recv(timeout=self.options.answer_s)
        except TimeoutError as error:
            raise OSError(f"the Inverse service is silent for {self.options.answer_s} s") from error
        state = codec.decode(answer, self.device_id)
        self._watch_events()
        # the service answers in a fraction of a millisecond; asking faster than this only heats the processor
        time.sleep(max(0.0, LEAST_PERIOD_S - (time.perf_counter() - started)))
        if state is None:
            raise OSError("the Inverse3 was disconnected from the service")
        fault = state.fault or (self._fault if self._clock() < self._fault_until_s else "")
        return Reading(
            np.array(state.position_m),
            np.array(state.velocity_m_per_s),
            state.quaternion,
            state.buttons,
            state.calibrated,
            fault,
        )

    def _watch_events(self) -> None:
        now = self._clock()
        if self._events is None or now < self._next_events_s:
            return
        self._next_events_s = now + EVENTS_EVERY_S
        try:
            while True:
                fault = codec.event_fault(self._events.recv(timeout=0), self.device_id)
                if fault:
                    self._fault, self._fault_until_s = fault, now + FAULT_SHOWN_S
        except TimeoutError:
            return
        except (OSError, client_errors()):
            self._events = None

    def disconnect(self) -> None:
        """A zero force if that is still possible, then both sockets closed."""
        errors = (OSError, TimeoutError, client_errors())
        if self._socket is not None:
            try:
                if hasattr(self, "device_id"):
                    self._socket.send(codec.force(self.device_id, (0.0, 0.0, 0.0), self._key))
            except (*errors, AttributeError):
                pass  # the service is gone: its commands are one-shot, so the device is idle already
        try:
            self._open.close()
        except errors:
            pass
        self._socket = self._events = None


def _most(scale: float) -> float:
    """N that can act at the hand: the service takes no command beyond the device's own limit."""
    return SPEC.max_force_n * min(1.0, scale)


def _refuse_mirrored_or_scaled(shown: codec.HaplyConfig) -> None:
    if shown.basis not in (None, codec.BASIS):
        raise DeviceError(
            f"the Inverse service keeps its basis at {shown.basis}: set it to {codec.BASIS} "
            "(X right, Y forward, Z up)"
        )
    if not all(abs(s - 1.0) < 1e-6 for s in shown.mount_scale):
        raise DeviceError(
            f"the Inverse service's mount scales lengths by {shown.mount_scale}, so that work is not force "
            "times way: set the mount's scale to 1, or choose --haply-preset arm_front_centered"
        )


def _declared(shown: codec.HaplyConfig) -> list[str]:
    """In plain words, what stays between a command and the hand."""
    words = []
    if shown.preset is not None:
        words.append(f"mount preset {shown.preset}")
    if shown.mount_turn_rad > 1e-3:
        words.append(f"the mount is turned by {math.degrees(shown.mount_turn_rad):.0f} degrees")
    if shown.damping_n_s_per_m:
        words.append(f"its damping filter of {shown.damping_n_s_per_m:g} N s/m acts on the hand as well")
    if shown.force_gate is not None:
        words.append(
            f"its force gate (gain {shown.force_gate:g}) may weaken forces that oscillate: it stays on, "
            "as a safeguard"
        )
    if shown.gravity_compensation is not None and shown.gravity_compensation != 1.0:
        words.append(f"it carries {shown.gravity_compensation:g} of the arm's weight")
    if shown.simulated:
        words.append("a simulated device: no hand feels it")
    return words


def _get(address: str) -> bytes:
    """The body of an answer over HTTP, without a proxy; b'' where there is none."""
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(address, timeout=HTTP_S) as answer:
            return answer.read(65536)
    except (OSError, ValueError, http.client.HTTPException):
        return b""


def _client() -> Any:
    try:
        from websockets.sync import client
    except ImportError as error:
        raise DeviceError(f"the library websockets is missing: {install_words('haply')}") from error
    return client


def client_errors() -> type[Exception]:
    """The base of what `websockets` raises."""
    from websockets.exceptions import WebSocketException

    return WebSocketException


def make(options: HaplyOptions | None = None, *, clock: Clock = host_clock) -> ForcefulDevice:
    """An Inverse3, not yet open."""
    return ForcefulDevice(HaplyWire(options or HaplyOptions(), clock), clock=clock)


def find(options: HaplyOptions | None = None) -> list[Availability]:
    """Whether the service answers and has an Inverse3."""
    wire = HaplyWire(options or HaplyOptions(), host_clock)
    return found(wire, lambda: f"{wire.device_id} at {wire.options.uri}", wire.options.uri)
