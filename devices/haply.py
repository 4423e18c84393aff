"""Haply Inverse3 through its Inverse service (WebSocket on this machine).

Tested against emulators built from published protocols; no hardware tried.
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np

from devices.base import Availability, Clock, DeviceSpec, host_clock
from devices.codecs import haply as codec
from devices.io_thread import ForcefulDevice, Reading, found
from mechanics.errors import DeviceError
from mechanics.options import option

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
_NO_SERVICE = (
    "the Haply Inverse service does not answer at {uri}: install it from Haply's developer site, start it, "
    "and connect the Inverse3"
)


@dataclass(frozen=True)
class HaplyOptions:
    """Where the service is and which device of it."""

    uri: str = option("ws://localhost:10001", "state and command socket", flag="--haply-uri")
    events_uri: str = option("ws://localhost:10020", "event socket; '' for none", flag="--haply-events-uri")
    device_id: str = option("", "which Inverse3; '' for the first", flag="--haply-device")
    answer_s: float = option(0.1, "silence after which it counts as gone", unit="s", flag="--haply-answer")


class HaplyWire:
    """The blocking side: one message out, exactly one state back, over `websockets`."""

    spec = SPEC

    def __init__(self, options: HaplyOptions, clock: Clock) -> None:
        self.options = options
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
            self._socket.send(codec.introduction(self.device_id, "palpate"))
            self._socket.recv(timeout=OPEN_S)
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
            message = codec.force(self.device_id, tuple(force_on_tool_n), self._key)
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
            raise OSError("the Inverse3 left the service")
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


def _client() -> Any:
    try:
        from websockets.sync import client
    except ImportError as error:
        raise DeviceError("the library websockets is missing: pip install websockets") from error
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
