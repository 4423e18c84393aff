"""A fake Haply Inverse service: the documented protocol over real WebSockets on a port of its own.

On connecting it sends an inventory, then exactly one state for each message. A force is one-shot: it lasts
until the next command or 10 ms of silence. `Chain` makes it a service of 3.5: a force scale, a damping
filter, a mount and a basis stand between a command and the hand, told in the inventory and over HTTP on the
same port.
"""

from __future__ import annotations

import json
import threading
import time
from dataclasses import dataclass, field
from http import HTTPStatus

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import serve

IDLE_S = 0.01
PERIOD_S = 0.001  # as a device; without it driver and service would talk as fast as the machine can
MOST_N = 10.0


@dataclass
class Chain:
    """What a service of 3.5 does with a command. stubborn: it ignores what a session asks for."""

    version: str = "3.5.0"
    force_scale: object = 1.0
    envelope: bool = False
    preset: str = "defaults"
    basis: str = "XYZ"
    mount_scale: float = 1.0
    damping: float = 0.0
    stubborn: bool = False
    more: dict = field(default_factory=dict)

    def config(self) -> dict:
        one = dict.fromkeys("xyz", self.mount_scale)
        return {
            "type": "inverse3",
            "port": "COM12",
            "device_info": {"major_version": 7, "device_type": 4},
            "gravity_compensation": {"enabled": True, "scaling_factor": 1.0},
            "preset": self.preset,
            "basis": {"permutation": self.basis},
            "mount": {
                "position": {"x": 0, "y": 0, "z": 0},
                "rotation": {"w": 1, "x": 0, "y": 0, "z": 0},
                "scale": one,
            },
            "filters": {"force_gate": {"gain": 0.3}, "damping": {"scalar": self.damping}},
        } | self.more

    def configure(self, session: dict, device: dict) -> None:
        if self.stubborn:
            return
        self.basis = session.get("basis", {}).get("permutation", self.basis)
        if "preset" in device:
            self.preset, self.mount_scale = device["preset"]["preset"], 1.0
        self.damping = device.get("damping", {}).get("scalar", self.damping)

    def answer(self, path: str) -> str | None:
        if path == "/version":
            return json.dumps({"git_tag": self.version, "project_version": self.version + ".0"})
        if path == "/settings/devices/force_scale" and self.force_scale is not None:
            return json.dumps({"ok": True, "data": self.force_scale} if self.envelope else self.force_scale)
        return None


class FakeInverse:
    """`key`: 'vector' or 'values', as newer and older services spell it; chain: None before 3.5."""

    def __init__(
        self, key: str = "vector", port: int = 0, event_port: int = 0, chain: Chain | None = None
    ) -> None:
        self.key = key
        self.chain = chain
        self.position = [0.0, 0.0, 0.0]
        self.velocity = [0.0, 0.0, 0.0]
        self.buttons = {"a": False, "b": False, "c": False}
        self.status = {
            "calibrated": True,
            "in_use": False,
            "power_supply": True,
            "ready": True,
            "started": True,
        }
        self.devices = ["049D"]
        self.messages: list[dict] = []
        self.silent = threading.Event()
        self.commanded_n = [0.0, 0.0, 0.0]
        self._force_s = float("-inf")
        self._sockets: set = set()
        self._events: set = set()
        self.server = serve(
            self._talk, "localhost", port, compression=None, process_request=self._http if chain else None
        )
        self.event_server = serve(self._tell, "localhost", event_port, compression=None)
        self._threads = [
            threading.Thread(target=s.serve_forever, daemon=True) for s in (self.server, self.event_server)
        ]
        for thread in self._threads:
            thread.start()

    @property
    def ports(self) -> tuple[int, int]:
        return tuple(s.socket.getsockname()[1] for s in (self.server, self.event_server))

    def force_n(self) -> tuple[float, float, float]:
        """What the hand feels now."""
        if time.perf_counter() - self._force_s >= IDLE_S:
            return (0.0, 0.0, 0.0)
        if self.chain is None:
            return tuple(self.commanded_n)
        scale, b = float(self.chain.force_scale or 1.0), self.chain.damping
        return tuple(
            scale * min(max(f, -MOST_N), MOST_N) - b * v
            for f, v in zip(self.commanded_n, self.velocity, strict=True)
        )

    def _http(self, connection, request):
        if request.headers.get("Upgrade"):
            return None
        text = self.chain.answer(request.path)
        status = HTTPStatus.NOT_FOUND if text is None else HTTPStatus.OK
        return connection.respond(status, text or "")

    def _vector(self, values: list[float]) -> dict:
        return dict(zip("xyz", values, strict=True))

    def _message(self, full: bool = True) -> str:
        scale = self.chain.mount_scale if self.chain else 1.0
        state = {
            "cursor_position": self._vector([scale * v for v in self.position]),
            "cursor_velocity": self._vector(self.velocity),
            "current_cursor_force": {self.key: self._vector(list(self.force_n()))},
        }
        told = {"config": self.chain.config() if self.chain else {}} if full else {}
        devices = [{"device_id": d, **told, "state": state, "status": self.status} for d in self.devices]
        grip = {"device_id": "61576", "state": {"orientation": {"w": 0.0, "x": 1.0, "y": 0.0, "z": 0.0}}}
        grip["state"]["buttons"] = self.buttons
        return json.dumps({"inverse3": devices, "wireless_verse_grip": [grip]})

    def _talk(self, socket) -> None:
        self._sockets.add(socket)
        try:
            socket.send(self._message())
            for text in socket:
                message = json.loads(text)
                self.messages.append(message)
                session = message.get("session", {})
                for device in message.get("inverse3", []):
                    if self.chain:
                        self.chain.configure(session.get("configure", {}), device.get("configure", {}))
                    commanded = device["commands"].get("set_cursor_force")
                    if commanded is not None:
                        force = commanded[self.key]  # the other spelling is an error to this service
                        self.commanded_n = [force["x"], force["y"], force["z"]]
                        self._force_s = time.perf_counter()
                time.sleep(PERIOD_S)
                while self.silent.is_set():
                    time.sleep(0.002)
                socket.send(self._message("force_render_full_state" in session))
        except (ConnectionClosed, KeyError):
            pass
        finally:
            self._sockets.discard(socket)

    def _tell(self, socket) -> None:
        self._events.add(socket)
        try:
            for _ in socket:
                pass
        except ConnectionClosed:
            pass
        finally:
            self._events.discard(socket)

    def event(self, name: str, device_id: str = "049D") -> None:
        """Tell every listener on the event socket."""
        for socket in list(self._events):
            socket.send(
                json.dumps({"name": name, "data": {"device_family": "inverse3", "device_id": device_id}})
            )

    def stop(self) -> None:
        """The service ends: sockets close."""
        for socket in list(self._sockets) + list(self._events):
            socket.close_socket()
        for server in (self.server, self.event_server):
            server.shutdown()
        for thread in self._threads:
            thread.join()
