"""USB force feedback (HID page 0x0F, 'PID 1.0'): constant-force effects as reports, laid out by the
descriptor.

Facts: USB Device Class Definition for Physical Interface Devices 1.0; OpenFFBoard `ffb_defs.h`. Forces are
shares of full scale. Directions are clockwise from 'north': a constant effect at 90 degrees pushes along +x
of the device, one at 180 degrees along its +y (X = sin a, Y = -cos a). No device watchdog is specified: an
effect of finite duration that is started again and again is the dead man's switch.
"""

from __future__ import annotations

from dataclasses import dataclass

from palpate.devices.codecs.hid_descriptor import Descriptor, Kind, ReportField, parse
from palpate.mechanics.errors import DeviceError

PAGE = 0x000F0000
X, Y = 0x00010030, 0x00010031
SET_EFFECT, SET_CONSTANT, OPERATION, CONTROL = PAGE | 0x21, PAGE | 0x73, PAGE | 0x77, PAGE | 0x95
DEVICE_GAIN_REPORT, CREATE, BLOCK_LOAD, STATE = PAGE | 0x7D, PAGE | 0xAB, PAGE | 0x89, PAGE | 0x92
BLOCK_INDEX, EFFECT_TYPE, CONSTANT_FORCE = PAGE | 0x22, PAGE | 0x25, PAGE | 0x26
DURATION, GAIN, AXES, DIRECTION_ENABLE, DIRECTION = (
    PAGE | 0x50,
    PAGE | 0x52,
    PAGE | 0x55,
    PAGE | 0x56,
    PAGE | 0x57,
)
TRIGGER_BUTTON, MAGNITUDE, LOOPS, DEVICE_GAIN = PAGE | 0x53, PAGE | 0x70, PAGE | 0x7C, PAGE | 0x7E
OPERATION_KIND, START, STOP = PAGE | 0x78, PAGE | 0x79, PAGE | 0x7B
CONTROL_KIND, ENABLE_ACTUATORS, STOP_ALL, RESET = PAGE | 0x96, PAGE | 0x97, PAGE | 0x99, PAGE | 0x9A
BLOCK_FREE = PAGE | 0x90
LOAD_STATUS, LOADED, POOL_FULL = PAGE | 0x8B, PAGE | 0x8C, PAGE | 0x8D
ACTUATORS_ENABLED, SAFETY_SWITCH, ACTUATOR_POWER = PAGE | 0xA0, PAGE | 0xA4, PAGE | 0xA6
NO_TRIGGER_BUTTON = 255
_BUTTONS = 256


@dataclass(frozen=True)
class StickReading:
    """x, y: -1 to 1 over the axis' logical range (None where the device lacks it); buttons: a mask."""

    x: float | None = None
    y: float | None = None
    buttons: int = 0


@dataclass(frozen=True)
class PidLayout:
    """A force-feedback device's reports; every method returns whole reports, the id byte first."""

    descriptor: Descriptor

    @classmethod
    def from_bytes(cls, report_descriptor: bytes) -> PidLayout:
        """Raises DeviceError where the descriptor lacks what constant forces need."""
        layout = cls(parse(report_descriptor))
        for inside, usage, words in (
            (SET_EFFECT, BLOCK_INDEX, "set effect"),
            (SET_EFFECT, DURATION, "effect duration"),
            (SET_CONSTANT, MAGNITUDE, "constant force"),
            (OPERATION, OPERATION_KIND, "effect operation"),
        ):
            if layout.descriptor.find("output", inside, usage) is None:
                raise DeviceError(
                    f"this device's descriptor declares no {words} report: it takes no constant force"
                )
        return layout

    @property
    def force_axes(self) -> tuple[str, ...]:
        """Which of x and y are actuated."""
        enable = self.descriptor.find("output", SET_EFFECT, AXES)
        return tuple(n for n, u in (("x", X), ("y", Y)) if enable is not None and enable.index(u) is not None)

    def _report(self, kind: Kind, inside: int, values: list[tuple[int, int, int | None]]) -> bytes:
        """values: (usage of the field, value, which of its values or None for the first)."""
        bits, report_id = 0, None
        for usage, value, index in values:
            place = self.descriptor.find(kind, inside, usage)
            if place is None:
                continue  # optional in the class definition: gain, trigger button, loop count
            if report_id not in (None, place.report_id):
                raise DeviceError("this device's descriptor spreads one report over several ids: replug it")
            report_id = place.report_id
            bits = place.put(bits, value, index or 0)
        if report_id is None:
            raise DeviceError("this device's descriptor declares no such report")
        size = self.descriptor.report_bytes(kind, report_id)
        return bytes((report_id,)) + bits.to_bytes(size, "little")

    def _choice(self, kind: Kind, inside: int, group: int, usage: int) -> tuple[int, int, int | None]:
        """A selection, whether the device declares it as an array (a number) or as single bits."""
        place = self._find(kind, inside, group)
        number = place.selector(usage)
        if number is not None:
            return (group, number, None)
        index = place.index(usage)
        if index is None:
            raise DeviceError("this device's descriptor lacks a selection that constant forces need")
        return (group, 1, index)

    def _find(self, kind: Kind, inside: int, usage: int) -> ReportField:
        place = self.descriptor.find(kind, inside, usage)
        if place is None:
            raise DeviceError(f"this device's descriptor declares no usage 0x{usage:x} in 0x{inside:x}")
        return place

    def create_constant(self) -> bytes:
        """Feature report: make room for a constant force."""
        return self._report("feature", CREATE, [self._choice("feature", CREATE, EFFECT_TYPE, CONSTANT_FORCE)])

    def block_load(self) -> tuple[int, int]:
        """(id, bytes with the id) of the feature report that answers `create_constant`."""
        place = self._find("feature", BLOCK_LOAD, BLOCK_INDEX)
        return place.report_id, 1 + self.descriptor.report_bytes("feature", place.report_id)

    def loaded_block(self, report: bytes) -> int:
        """The effect's number from that answer; raises DeviceError where the device has no room."""
        status = self._find("feature", BLOCK_LOAD, LOAD_STATUS)
        selected = status.get(report[1:])
        if selected != status.selector(LOADED):
            full = selected == status.selector(POOL_FULL)
            raise DeviceError(
                "the device has no room for another effect: replug it, close other programs that use "
                "its forces"
                if full
                else "the device refused to create a constant force: replug it"
            )
        return self._find("feature", BLOCK_LOAD, BLOCK_INDEX).get(report[1:])

    def free(self, block: int) -> bytes | None:
        """Output report: give the effect's room back; None where the device has no such report."""
        if self.descriptor.find("output", BLOCK_FREE, BLOCK_INDEX) is None:
            return None
        return self._report("output", BLOCK_FREE, [(BLOCK_INDEX, block, None)])

    def control(self, usage: int) -> bytes:
        """Output report: ENABLE_ACTUATORS, STOP_ALL or RESET, which forgets every effect."""
        return self._report("output", CONTROL, [self._choice("output", CONTROL, CONTROL_KIND, usage)])

    def device_gain(self) -> bytes | None:
        """Output report: full gain; None where the device has no such report."""
        place = self.descriptor.find("output", DEVICE_GAIN_REPORT, DEVICE_GAIN)
        if place is None:
            return None
        return self._report("output", DEVICE_GAIN_REPORT, [(DEVICE_GAIN, place.logical_max, None)])

    def set_effect(self, block: int, degrees: float, duration_ms: int) -> bytes:
        """Output report: a constant force in one direction, of finite duration, at full gain.

        Raises DeviceError for a duration that means 'for ever' (0 or the field's greatest value).
        """
        duration = self._find("output", SET_EFFECT, DURATION)
        if not 0 < duration_ms < duration.logical_max or duration_ms >= 0x7FFF:
            raise DeviceError(f"an effect of {duration_ms} ms would outlive this program: use 1 to 32766 ms")
        gain = self.descriptor.find("output", SET_EFFECT, GAIN)
        values = [
            (BLOCK_INDEX, block, None),
            self._choice("output", SET_EFFECT, EFFECT_TYPE, CONSTANT_FORCE),
            (DURATION, duration_ms, None),
            (GAIN, gain.logical_max if gain else 0, None),
            (TRIGGER_BUTTON, NO_TRIGGER_BUTTON, None),
            (DIRECTION_ENABLE, 1, None),
        ]
        direction = self.descriptor.find("output", SET_EFFECT, DIRECTION)
        if direction is not None:
            turn = direction.logical_max - direction.logical_min + 1
            values.append((DIRECTION, direction.logical_min + round(degrees / 360.0 * turn), None))
        return self._report("output", SET_EFFECT, values)

    def magnitude(self, block: int, share: float) -> bytes:
        """Output report: the force as a share of full scale, -1 to 1."""
        full = self._find("output", SET_CONSTANT, MAGNITUDE).logical_max
        return self._report(
            "output", SET_CONSTANT, [(BLOCK_INDEX, block, None), (MAGNITUDE, round(share * full), None)]
        )

    def operate(self, block: int, usage: int) -> bytes:
        """Output report: START (once, for its duration) or STOP."""
        choice = self._choice("output", OPERATION, OPERATION_KIND, usage)
        return self._report("output", OPERATION, [(BLOCK_INDEX, block, None), choice, (LOOPS, 1, None)])

    @property
    def longest_input(self) -> int:
        """Bytes of the longest input report, its id included."""
        lengths = [
            self.descriptor.report_bytes("input", i) for k, i in self.descriptor.report_bits if k == "input"
        ]
        return 1 + max(lengths, default=0)

    def axes(self, report: bytes) -> StickReading | None:
        """Positions and buttons from an input report; None where it is of another kind."""
        report_id, body = self._split(report)
        x, y = (self._axis(report_id, body, usage) for usage in (X, Y))
        if x is None and y is None:
            return None
        return StickReading(x, y, self._buttons(report_id, body))

    def fault(self, report: bytes) -> str | None:
        """What a PID state report complains about, '' if nothing; None where it is another report."""
        report_id, body = self._split(report)
        words = None
        for usage, text in (
            (ACTUATOR_POWER, "its actuators have no power"),
            (SAFETY_SWITCH, "its safety switch is open"),
            (ACTUATORS_ENABLED, "its actuators are off"),
        ):
            place = self.descriptor.find("input", STATE, usage)
            if place is None or place.report_id != report_id:
                continue
            index = place.index(usage)
            words = words or ""
            if index is not None and not place.get(body, index) and not words:
                words = text
        return words

    def _split(self, report: bytes) -> tuple[int, bytes]:
        return (report[0], report[1:]) if self.descriptor.numbered and report else (0, report)

    def _axis(self, report_id: int, body: bytes, usage: int) -> float | None:
        for place in self.descriptor.fields:
            index = place.index(usage)
            if place.kind == "input" and place.report_id == report_id and index is not None:
                low, high = place.logical_min, place.logical_max
                if not low < high:
                    raise DeviceError("the device's report descriptor gives an axis no range: replug it")
                return min(max(2.0 * (place.get(body, index) - low) / (high - low) - 1.0, -1.0), 1.0)
        return None

    def _buttons(self, report_id: int, body: bytes) -> int:
        mask = 0
        for place in self.descriptor.fields:
            on_page = place.usages and place.usages[0] >> 16 == 9
            first = place.usages[0] - 0x00090001 if on_page else -1
            if place.kind == "input" and place.report_id == report_id and first >= 0 and place.size == 1:
                mask |= sum(
                    place.get(body, i) << (first + i) for i in range(min(place.count, _BUTTONS - first))
                )
        return mask
