"""A fake Haply Inverse service: the documented protocol over real WebSockets on a port of its own.

On connecting it sends an inventory, then exactly one state for each message. A force is one-shot: it lasts
until the next command or 10 ms of silence.
"""

from __future__ import annotations

import json
import threading
import time

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import serve

IDLE_S = 0.01


class FakeInverse:
    """`key`: 'vector' or 'values', as newer and older services spell it."""

    def __init__(self, key: str = "vector", port: int = 0, event_port: int = 0) -> None:
        self.key = key
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
        self.server = serve(self._talk, "localhost", port, compression=None)
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
        return tuple(self.commanded_n) if time.perf_counter() - self._force_s < IDLE_S else (0.0, 0.0, 0.0)

    def _vector(self, values: list[float]) -> dict:
        return dict(zip("xyz", values, strict=True))

    def _message(self) -> str:
        state = {
            "cursor_position": self._vector(self.position),
            "cursor_velocity": self._vector(self.velocity),
            "current_cursor_force": {self.key: self._vector(list(self.force_n()))},
        }
        devices = [
            {"device_id": d, "config": {}, "state": state, "status": self.status} for d in self.devices
        ]
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
                for device in message.get("inverse3", []):
                    commanded = device["commands"].get("set_cursor_force")
                    if commanded is not None:
                        force = commanded[self.key]  # the other spelling is an error to this service
                        self.commanded_n = [force["x"], force["y"], force["z"]]
                        self._force_s = time.perf_counter()
                while self.silent.is_set():
                    time.sleep(0.002)
                socket.send(self._message())
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
