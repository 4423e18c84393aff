"""Force-feedback sticks and wheels (USB HID PID) through hidapi: one or two axes of position and force.

Each actuated axis gets one constant force of finite duration, started again before it ends: when the program
dies, so does the force. Forces in newtons need the device's full-scale force, which no descriptor states:
measure it once with a spring scale at the handle and give it as an option.
Tested against emulators built from published protocols; no hardware tried.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from palpate.devices.base import Availability, Clock, DeviceSpec, host_clock
from palpate.devices.codecs import pid
from palpate.devices.codecs.pid import PidLayout
from palpate.devices.hid_port import HidPort, enumerate_devices, load, opened, permitted
from palpate.devices.io_thread import ForcefulDevice, Reading
from palpate.mechanics.errors import DeviceError
from palpate.mechanics.options import Ranged, option

SPEC = DeviceSpec(
    name="pid-ffb",
    title="USB force-feedback stick or wheel",
    sensed_axes=("x", "y"),
    actuated_axes=("x", "y"),
    max_force_n=8.0,
    max_stiffness_n_per_m=300.0,
    max_damping_n_s_per_m=2.0,
    max_speed_m_per_s=2.0,
    workspace_radius_m=0.05,
    buttons=8,
)
NOT_MEASURED = "{:g} N at full scale is taken, not measured: give --ffb-full-scale for true newtons"
EFFECT_MS = 50
RESTART_S = 0.02
QUIET_S = 0.01
DIRECTION_DEGREES = {"x": 90.0, "y": 180.0}
_JOYSTICK_USAGES = ((1, 4), (1, 5), (1, 8), (2, 2))
LONGEST_GAP_S = 0.1


@dataclass(frozen=True)
class PidOptions(Ranged):
    """What turns shares of full scale into metres and newtons at the handle."""

    full_scale_n: float = option(
        8.0, "measured force at full scale", unit="N", flag="--ffb-full-scale", low=0.01, high=200.0
    )
    stroke_m: float = option(
        0.05, "travel of the handle from the middle to an end", unit="m", flag="--ffb-stroke", low=0.001
    )
    device_path: str = option("", "which device, as 'palpate devices' lists it", flag="--ffb-path")


class PidWire:
    """The blocking side. Device frame: x right, y away from the person (HID's +y comes towards), z up."""

    def __init__(self, options: PidOptions, clock: Clock, hid: Any = None) -> None:
        self.options = options
        measured = options.full_scale_n != PidOptions().full_scale_n
        self.spec = replace(
            SPEC,
            max_force_n=min(options.full_scale_n, SPEC.max_force_n),
            workspace_radius_m=options.stroke_m,
            conditions=() if measured else (NOT_MEASURED.format(options.full_scale_n),),
        )
        self._clock = clock
        self._hid = hid
        self._port: HidPort | None = None
        self._velocity = VelocityEstimate()

    def connect(self) -> None:
        """Open, parse the descriptor, create one constant force an axis, switch the actuators on."""
        entries = [e for e in _candidates(self._hid) if self.options.device_path in ("", e["path"].decode())]
        if not entries:
            raise DeviceError(
                "no force-feedback stick or wheel is plugged in: plug one in, or choose another --device"
            )
        port, self._layout = self._first_with_force(entries)
        try:
            self._create_effects(port)
        except BaseException:
            port.close()
            raise
        self._port = port

    def _first_with_force(self, entries: list[dict[str, Any]]) -> tuple[HidPort, PidLayout]:
        """The first device whose descriptor takes constant forces, open; raises DeviceError for none."""
        why = ""
        for entry in entries:
            port = HidPort(entry["path"].decode(), entry["vendor_id"], module=self._hid)
            try:
                return port, PidLayout.from_bytes(port.descriptor())
            except DeviceError as error:
                port.close()
                why = f"{entry.get('product_string') or 'the joystick'} has no force feedback: {error}"
        raise DeviceError(why)

    def _create_effects(self, port: HidPort) -> None:
        layout = self._layout
        self._blocks: dict[str, int] = {}
        # what a program that was killed left there would in the end leave no room
        port.write(layout.control(pid.RESET))
        for axis in layout.force_axes:
            port.set_feature(layout.create_constant())
            self._blocks[axis] = layout.loaded_block(port.get_feature(*layout.block_load()))
        port.write(layout.control(pid.ENABLE_ACTUATORS))
        gain = layout.device_gain()
        if gain is not None:
            port.write(gain)
        for axis, block in self._blocks.items():
            port.write(layout.set_effect(block, DIRECTION_DEGREES[axis], EFFECT_MS))
            port.write(layout.magnitude(block, 0.0))
        self._started_s = float("-inf")
        self._running = False
        self._reading_s = float("-inf")
        self._reading: Reading | None = None
        self._fault = ""
        self._velocity.reset()

    def exchange(self, force_on_tool_n: np.ndarray | None, timeout_s: float) -> Reading | None:
        """One magnitude an axis, a restart when due; then the newest position."""
        if force_on_tool_n is None:
            self._stop()
        else:
            self._push(force_on_tool_n)
        reports = opened(self._port).drain(self._layout.longest_input, max(1, round(timeout_s * 1000)))
        now = self._clock()
        fresh = False
        for report in reports:
            fault = self._layout.fault(report)
            self._fault = self._fault if fault is None else fault
            axes = self._layout.axes(report)
            if axes is not None:
                fresh = True
                self._position = self.options.stroke_m * np.array([axes.x or 0.0, -(axes.y or 0.0), 0.0])
                self._buttons = axes.buttons
        if not fresh and (self._reading_s == float("-inf") or now - self._reading_s < QUIET_S):
            return None
        # a stick that is held still may report nothing: silence of an attached device is its last place
        self._reading_s = now
        velocity = self._velocity.update(now, self._position)
        return Reading(self._position, velocity, buttons=self._buttons, fault=self._fault)

    def _push(self, force_on_tool_n: np.ndarray) -> None:
        port = opened(self._port)
        components = {"x": force_on_tool_n[0], "y": -force_on_tool_n[1]}
        for axis, block in self._blocks.items():
            share = min(max(components[axis] / self.options.full_scale_n, -1.0), 1.0)
            port.write(self._layout.magnitude(block, float(share)))
        now = self._clock()
        if now - self._started_s >= RESTART_S:
            for block in self._blocks.values():
                port.write(self._layout.operate(block, pid.START))
            self._started_s, self._running = now, True

    def _stop(self) -> None:
        if not self._running:
            return
        port = opened(self._port)
        for block in self._blocks.values():
            port.write(self._layout.magnitude(block, 0.0))
            port.write(self._layout.operate(block, pid.STOP))
        self._running, self._started_s = False, float("-inf")

    def disconnect(self) -> None:
        """Zero, stop every effect, close."""
        if self._port is None:
            return
        try:
            self._running = True
            self._stop()
            for block in self._blocks.values():
                free = self._layout.free(block)
                if free is not None:
                    self._port.write(free)
            self._port.write(self._layout.control(pid.STOP_ALL))
        except (OSError, DeviceError):
            pass  # unplugged: the effects end by themselves within EFFECT_MS
        self._port.close()
        self._port = None


def make(options: PidOptions | None = None, *, clock: Clock = host_clock, hid: Any = None) -> ForcefulDevice:
    """A force-feedback device, not yet open."""
    return ForcefulDevice(PidWire(options or PidOptions(), clock, hid), clock=clock)


def _candidates(hid: Any = None) -> list[dict[str, Any]]:
    """Sticks, game pads and wheels: hidapi tells usages, not whether there is force; the descriptor does."""
    return enumerate_devices(lambda e: (e.get("usage_page"), e.get("usage")) in _JOYSTICK_USAGES, module=hid)


def find(options: PidOptions | None = None, *, hid: Any = None) -> list[Availability]:
    """Every stick or wheel that is plugged in and whether it takes forces."""
    try:
        entries = _candidates(hid or load())
    except DeviceError as error:
        return [Availability(SPEC, why_not=str(error), remedy="pip install hidapi")]
    if not entries:
        return [Availability(SPEC, why_not="no stick or wheel is plugged in", remedy="plug one in")]
    return [_look(entry, options or PidOptions(), hid) for entry in entries]


def _look(entry: dict[str, Any], options: PidOptions, hid: Any) -> Availability:
    there = permitted(entry, SPEC)
    if not there.present:
        return there
    try:
        port = HidPort(there.where, entry["vendor_id"], module=hid)
        try:
            axes = PidLayout.from_bytes(port.descriptor()).force_axes
        finally:
            port.close()
    except (DeviceError, OSError) as error:
        return replace(there, why_not=str(error), remedy="choose a device with force feedback")
    spec = PidWire(options, host_clock, hid).spec
    return replace(there, spec=replace(spec, title=there.spec.title, actuated_axes=axes, sensed_axes=axes))


class VelocityEstimate:
    """First-order low pass of `time_constant_s` over differences; a long gap starts it anew."""

    def __init__(self, time_constant_s: float = 0.008) -> None:
        self.time_constant_s = time_constant_s
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next velocity is zero."""
        self._position: np.ndarray | None = None
        self._time_s = 0.0
        self._velocity = np.zeros(3)

    def update(self, time_s: float, position_m: np.ndarray) -> np.ndarray:
        """(3,) m/s after this position."""
        duration = time_s - self._time_s
        if self._position is None or duration > LONGEST_GAP_S:
            self._velocity = np.zeros(3)
        elif duration <= 0:
            return self._velocity
        else:
            keep = math.exp(-duration / self.time_constant_s)
            self._velocity = keep * self._velocity + (1 - keep) * (position_m - self._position) / duration
        self._position, self._time_s = position_m, time_s
        return self._velocity
