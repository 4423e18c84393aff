"""What a device is: small protocols, the specification with its limits, and whether one is there.

A device gives positions, or takes forces, or both; what it cannot do it does not have. `read` and
`send_force` never block: whatever waits for hardware runs in the device's own thread (devices.io_thread). The
safety filter (devices.safety) is applied by the caller, last, before `send_force`.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol, Self, runtime_checkable

import numpy as np

from palpate.mechanics.errors import DeviceError
from palpate.mechanics.tip_state import TipState

Clock = Callable[[], float]
"""Seconds, monotonic; `host_clock` for real devices, a fake one in tests and headless runs."""

host_clock: Clock = time.perf_counter

LONGEST_HOLD_S = 0.02
"""No force outlives the call that sent it by more: whoever sends has stalled."""


@dataclass(frozen=True)
class DeviceSpec:
    """What a device can do; SI units, device frame: x right, y away from the person, z up.

    control: 'position' (states carry position_m) or 'rate' (a deflection: states carry velocity_m_per_s and a
    position that stays zero; devices.mapper integrates it). sensed_axes: of x, y, z, rx, ry, rz.
    actuated_axes: of x, y, z; empty where there is no force. max_stiffness_n_per_m, max_damping_n_s_per_m:
    what it renders stably at 1 kHz. 0 stands for 'none' in every limit of a device without force.
    conditions: what the maker's software does between a command and the hand, in plain words, as far as it
    tells; limits here are in newtons at the hand. simulated: there is no hand behind it.
    """

    name: str
    title: str
    control: Literal["position", "rate"] = "position"
    sensed_axes: tuple[str, ...] = ("x", "y", "z")
    actuated_axes: tuple[str, ...] = ()
    max_force_n: float = 0.0
    max_stiffness_n_per_m: float = 0.0
    max_damping_n_s_per_m: float = 0.0
    max_speed_m_per_s: float = 1.0
    workspace_radius_m: float = 0.1
    rate_hz: float = 1000.0
    buttons: int = 0
    conditions: tuple[str, ...] = ()
    simulated: bool = False

    @property
    def has_force(self) -> bool:
        """Whether any axis is actuated."""
        return bool(self.actuated_axes) and self.max_force_n > 0


@runtime_checkable
class PositionSource(Protocol):
    """Gives the newest state of its tip. Used as a context manager: `with make_device('mouse') as device`."""

    spec: DeviceSpec

    def open(self) -> None:
        """Start it; raises DeviceError that says what is missing."""

    def read(self) -> TipState:
        """The newest state, at once; `time_s` is the clock's time at which the reading arrived."""

    def close(self) -> None:
        """Zero the force, stop, release; harmless when repeated."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...


@runtime_checkable
class ForceSink(Protocol):
    """Takes forces. Nothing is sent before `enable_force`, nor after unplugging until it is called again."""

    spec: DeviceSpec

    def enable_force(self) -> None:
        """From now on forces are sent; raises DeviceError where the device is not there or not calibrated."""

    def disable_force(self) -> None:
        """Zero at once, and nothing more is sent."""

    def send_force(self, force_on_tool_n: np.ndarray, hold_s: float = LONGEST_HOLD_S) -> None:
        """(3,) N on the tool, the device's frame; handed over at once, sent by the device's thread.

        It acts until the next one, and no longer than `hold_s`: then zero is sent."""


class OpenInWith(ABC):
    """Base of the devices: a `with` statement opens and closes them."""

    @abstractmethod
    def open(self) -> None:
        """As `PositionSource.open`."""

    @abstractmethod
    def close(self) -> None:
        """As `PositionSource.close`."""

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


@dataclass(frozen=True)
class Availability:
    """One line of `palpate devices`: a device that is there, or why it is not and what to do about it.

    where: a path, address or serial number. why_not, remedy: plain words, '' where it is there.
    """

    spec: DeviceSpec
    where: str = ""
    why_not: str = ""
    remedy: str = ""

    @property
    def present(self) -> bool:
        """Whether it is there."""
        return not self.why_not


def finite_vector(force_n: np.ndarray) -> np.ndarray:
    """(3,) float copy; raises DeviceError where it is no 3-vector (values that are not finite pass)."""
    vector = np.array(force_n, dtype=float)
    if vector.shape != (3,):
        raise DeviceError(f"a force of shape {vector.shape} was sent; a device takes (3,) N on the tool")
    return vector
