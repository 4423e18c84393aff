"""One thread a device: drains what comes in, sends the newest force, reconnects; nobody else ever waits.

A driver supplies a `Wire` (blocking calls); `ThreadedDevice` makes a device of it. Rules that hold for
every wire:

* force goes out only after `enable_force`, and zero goes out before the wire is released, whatever happened;
* a force goes out for as long as its `send_force` allowed, then zero (the caller has stalled, which
  devices.safety cannot know);
* a reading with a fault, or not calibrated, disables force as well;
* a wire that raises counts as unplugged: force is disabled, states say `connected=False`, and the thread
  tries again, waiting longer each time; force then needs a new `enable_force`.
"""

from __future__ import annotations

import atexit
import threading
import weakref
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from palpate.devices.base import (
    LONGEST_HOLD_S,
    Availability,
    Clock,
    DeviceSpec,
    OpenInWith,
    finite_vector,
    host_clock,
)
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.tip_state import IDENTITY_QUATERNION, TipState

POLL_S = 0.001
FIRST_RETRY_S = 0.1
LONGEST_RETRY_S = 2.0
ZERO = np.zeros(3)
ZERO.setflags(write=False)


@dataclass(frozen=True)
class Reading:
    """What a wire read: SI, the device's frame. Fields as in TipState."""

    position_m: np.ndarray = field(default_factory=lambda: ZERO)
    velocity_m_per_s: np.ndarray = field(default_factory=lambda: ZERO)
    quaternion: tuple[float, float, float, float] = IDENTITY_QUATERNION
    buttons: int = 0
    calibrated: bool = True
    fault: str = ""


class Wire(Protocol):
    """The blocking side of a driver; only the device's own thread calls it. Any exception means unplugged."""

    spec: DeviceSpec

    def connect(self) -> None:
        """Open; raises DeviceError that says what is missing."""

    def exchange(self, force_on_tool_n: np.ndarray | None, timeout_s: float) -> Reading | None:
        """Send the force (None: force is off), drain the input, return the newest reading if there is one.

        Waits at most about `timeout_s` for input.
        """

    def disconnect(self) -> None:
        """Zero the force if that is still possible, release everything; never raises."""


def found(wire: Wire, where: Callable[[], str], sought: str = "") -> list[Availability]:
    """Whether a wire connects, as `palpate devices` lists it.

    where: asked while it is connected; sought: the place that is told where nothing is there.
    """
    title = wire.spec.title
    try:
        wire.connect()
    except (DeviceError, OSError) as error:
        why, _, remedy = _plain(error).partition(": ")
        return [Availability(replace(wire.spec, title=title), sought, why, remedy)]
    entry = Availability(wire.spec, where())
    wire.disconnect()
    return [entry]


@dataclass
class Rate:
    """Readings counted by the thread: `hz` and the spread of their spacing, over the last whole second."""

    hz: float = 0.0
    jitter_s: float = 0.0


class ThreadedDevice(OpenInWith):
    """A PositionSource over a Wire; `ForcefulDevice` adds the ForceSink."""

    def __init__(self, wire: Wire, *, clock: Clock = host_clock) -> None:
        self.wire = wire
        self.rate = Rate()
        self._clock = clock
        self._force: np.ndarray = ZERO
        self._force_until_s = float("-inf")
        self._force_enabled = False
        self._sent = False
        self._connected = False
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._spacings: list[float] = []
        self._state = TipState(clock(), -1, ZERO, connected=False, calibrated=False, fault="not open")

    @property
    def spec(self) -> DeviceSpec:
        """Of the kind of device; once it is open, of the one that is there."""
        return self.wire.spec

    def open(self) -> None:
        """Connect (raises DeviceError that says what is missing), then start the thread."""
        if self._thread is not None:
            return
        self.wire.connect()
        self._connected = True
        self._stop.clear()
        self._state = self._flagged(fault="")
        self._thread = threading.Thread(target=self._run, name=f"{self.spec.name} i/o", daemon=True)
        self._thread.start()
        # daemon threads die silently at exit: zero the force and release the hardware first
        reference = weakref.ref(self)

        def at_exit() -> None:
            device = reference()
            if device is not None:
                device.close()

        self._at_exit = at_exit
        atexit.register(self._at_exit)

    def read(self) -> TipState:
        """The newest state, at once."""
        return self._state

    def close(self) -> None:
        """Zero the force, stop the thread, release the device; harmless when repeated."""
        self._force_enabled = False
        if self._thread is None:
            return
        self._stop.set()
        self._thread.join(timeout=2.0)
        if self._thread.is_alive():
            raise DeviceError(
                f"{self.spec.title} does not answer: its thread hangs in a driver call; unplug and replug it"
            )
        self._thread = None
        atexit.unregister(self._at_exit)
        self._connected = False
        self._state = self._flagged(fault="closed")

    def _flagged(self, fault: str) -> TipState:
        """The last state with the device's flags of now; its time, sequence and place stay what they were."""
        return replace(
            self._state,
            velocity_m_per_s=ZERO,
            connected=self._connected,
            calibrated=self._state.calibrated and self._connected,
            force_enabled=self._force_enabled,
            fault=fault,
        )

    def _due_force(self) -> np.ndarray | None:
        if not self._force_enabled:
            # one zero after the last force: the device would hold it otherwise
            was, self._sent = self._sent, False
            return ZERO if was else None
        self._sent = True
        return self._force if self._clock() <= self._force_until_s else ZERO

    def _run(self) -> None:
        retry_s = FIRST_RETRY_S
        try:
            while not self._stop.is_set():
                if not self._connected:
                    if self._stop.wait(retry_s):
                        break
                    retry_s = min(2.0 * retry_s, LONGEST_RETRY_S)
                    self._reconnect()
                    continue
                try:
                    reading = self.wire.exchange(self._due_force(), POLL_S)
                except Exception as error:  # a driver's thread must outlive whatever its library raises
                    self._lose(error)
                    continue
                if reading is not None:
                    retry_s = FIRST_RETRY_S
                    self._publish(reading)
        finally:
            self._force_enabled = False
            self.wire.disconnect()

    def _reconnect(self) -> None:
        before = self.wire.spec
        try:
            self.wire.connect()
            if self.wire.spec != before:
                # the caller's limits were made for what it was
                self.wire.disconnect()
                raise DeviceError("it was reconnected with other limits or settings: start again")
        except Exception as error:  # still away: the state keeps saying so
            self._state = self._flagged(fault=_plain(error))
            return
        self._connected = True

    def _lose(self, error: Exception) -> None:
        self._force_enabled = self._sent = False
        self._force_until_s = float("-inf")
        self._connected = False
        self.wire.disconnect()
        self._state = self._flagged(fault=f"disconnected: {_plain(error)}")

    def _publish(self, reading: Reading) -> None:
        now = self._clock()
        if reading.fault or not reading.calibrated:
            self._force_enabled = False
        self._spacings.append(now - self._state.time_s)
        if sum(self._spacings) >= 1.0:
            spacings = np.array(self._spacings)
            self.rate = Rate(1.0 / max(spacings.mean(), 1e-9), float(spacings.std()))
            self._spacings.clear()
        self._state = TipState(
            now,
            self._state.sequence + 1,
            reading.position_m,
            reading.velocity_m_per_s,
            reading.quaternion,
            reading.buttons,
            connected=True,
            calibrated=reading.calibrated,
            force_enabled=self._force_enabled,
            fault=reading.fault,
        )


class ForcefulDevice(ThreadedDevice):
    """A ThreadedDevice whose wire has actuated axes: also a ForceSink."""

    def enable_force(self) -> None:
        """From now on forces are sent; raises DeviceError while away or not calibrated."""
        state = self._state
        if not (self._connected and state.connected):
            raise DeviceError(
                f"{self.spec.title} is not connected ({state.fault}): plug it in, then enable force"
            )
        if not state.calibrated:
            raise DeviceError(
                f"{self.spec.title} is not calibrated: move it to its end stops, then enable force"
            )
        if state.fault:
            raise DeviceError(f"{self.spec.title} has a fault ({state.fault}): mend it, then enable force")
        self._force, self._force_until_s = ZERO, float("-inf")
        self._force_enabled = True

    def disable_force(self) -> None:
        """The thread sends zero at its next turn, and nothing more."""
        self._force_enabled = False

    def send_force(self, force_on_tool_n: np.ndarray, hold_s: float = LONGEST_HOLD_S) -> None:
        """(3,) N on the tool, the device's frame, for at most `hold_s`; NaN counts as zero.

        Ignored until force is enabled."""
        force = finite_vector(force_on_tool_n)
        self._force = force if np.isfinite(force).all() else ZERO
        self._force_until_s = self._clock() + hold_s


def _plain(error: Exception) -> str:
    return str(error) or type(error).__name__
