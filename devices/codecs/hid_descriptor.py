"""A HID report descriptor, parsed: where every value lies in which report (HID 1.11, section 6.2.2).

Devices differ in report ids, sizes and order, and all of it is stated in the descriptor. A usage is written
as one number, page << 16 | id (0x000F0070 is the PID page's Magnitude).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from palpate.mechanics.errors import DeviceError

Kind = Literal["input", "output", "feature"]
_MAIN: dict[int, Kind] = {8: "input", 9: "output", 11: "feature"}
_COLLECTION, _END_COLLECTION = 10, 12
_WIDEST_BITS, _LONGEST_BITS = 64, 8 * 4096
"""Of a value, and of a report: what declares more is damaged, and would fill the memory."""


@dataclass(frozen=True)
class ReportField:
    """`count` values of `size` bits from bit `bit` of a report (its id byte not counted).

    array: a value is the number of one of `usages`, counted from logical_min; else value i has usage i (the
    last usage stands for the rest). path: usages of the collections around it, outermost first.
    """

    kind: Kind
    report_id: int
    bit: int
    size: int
    count: int
    usages: tuple[int, ...]
    logical_min: int
    logical_max: int
    array: bool
    path: tuple[int, ...]

    def index(self, usage: int) -> int | None:
        """Which of the values has this usage, for a field that is no array."""
        if self.array or usage not in self.usages:
            return None
        return min(self.usages.index(usage), self.count - 1)

    def selector(self, usage: int) -> int | None:
        """The value that selects this usage, for an array."""
        return self.logical_min + self.usages.index(usage) if self.array and usage in self.usages else None

    def get(self, report: bytes, index: int = 0) -> int:
        """Value `index` of a report without its id byte; raises DeviceError where the report is too short."""
        start = self.bit + index * self.size
        if start + self.size > 8 * len(report):
            raise DeviceError(
                f"report 0x{self.report_id:02x} has {len(report)} bytes: shorter than it declared"
            )
        raw = int.from_bytes(report, "little") >> start & ((1 << self.size) - 1)
        signed = self.logical_min < 0 and raw >> (self.size - 1)
        return raw - (1 << self.size) if signed else raw

    def put(self, bits: int, value: int, index: int = 0) -> int:
        """`bits` (a report as a little-endian number) with value `index` set, within the logical range."""
        value = min(max(int(value), self.logical_min), self.logical_max)
        start = self.bit + index * self.size
        mask = ((1 << self.size) - 1) << start
        return bits & ~mask | (value << start & mask)


@dataclass(frozen=True)
class Descriptor:
    """fields in order; report_bits: (kind, id) -> bits; numbered: reports start with their id."""

    fields: tuple[ReportField, ...]
    report_bits: dict[tuple[str, int], int]
    numbered: bool

    def report_bytes(self, kind: Kind, report_id: int) -> int:
        """Length without the id byte."""
        return (self.report_bits.get((kind, report_id), 0) + 7) // 8

    def find(self, kind: Kind, inside: int | None, usage: int) -> ReportField | None:
        """The first field of a kind, inside a collection, that has a usage or lies in a collection of it."""
        for candidate in self.fields:
            if candidate.kind != kind or (inside is not None and inside not in candidate.path):
                continue
            if usage in candidate.usages or usage in candidate.path:
                return candidate
        return None


@dataclass(frozen=True)
class _Globals:
    page: int = 0
    logical_min: int = 0
    logical_max: int = 0
    report_id: int = 0
    size: int = 0
    count: int = 0


@dataclass
class _Locals:
    usages: list[int] = field(default_factory=list)
    low: int | None = None


def _signed(data: bytes) -> int:
    return int.from_bytes(data, "little", signed=True)


def parse(descriptor: bytes) -> Descriptor:
    """Every field of a report descriptor; raises DeviceError where it is cut off or unbalanced."""
    state, local = _Globals(), _Locals()
    stack: list[_Globals] = []
    path: list[int] = []
    fields: list[ReportField] = []
    bits: dict[tuple[str, int], int] = {}
    position, numbered = 0, False
    while position < len(descriptor):
        prefix = descriptor[position]
        if prefix == 0xFE:  # a long item: its size follows, nothing uses them
            position += 3 + (descriptor[position + 1] if position + 1 < len(descriptor) else 0)
            continue
        length = (0, 1, 2, 4)[prefix & 3]
        data = descriptor[position + 1 : position + 1 + length]
        if len(data) < length:
            raise DeviceError("the device's report descriptor is cut off: replug it")
        position += 1 + length
        kind, tag = prefix >> 2 & 3, prefix >> 4
        value = int.from_bytes(data, "little")
        if kind == 1:
            state = _global_item(state, stack, tag, value, data)
            numbered = numbered or tag == 8
        elif kind == 2:
            _local_item(local, state.page, tag, value, length)
        elif kind == 0:
            if tag == _COLLECTION:
                path.append(local.usages[0] if local.usages else 0)
            elif tag == _END_COLLECTION:
                if not path:
                    raise DeviceError("the device's report descriptor closes a collection that is not open")
                path.pop()
            elif tag in _MAIN:
                key = (_MAIN[tag], state.report_id)
                first, bits[key] = bits.get(key, 0), bits.get(key, 0) + state.size * state.count
                if state.size > _WIDEST_BITS or bits[key] > _LONGEST_BITS or state.report_id > 255:
                    raise DeviceError(
                        "the device's report descriptor declares an impossible report: replug it"
                    )
                if not value & 1 and state.size * state.count:  # neither constant padding nor nothing
                    fields.append(_field(_MAIN[tag], state, local, value, first, tuple(path)))
            local = _Locals()
    return Descriptor(tuple(fields), bits, numbered)


def _global_item(state: _Globals, stack: list[_Globals], tag: int, value: int, data: bytes) -> _Globals:
    if tag == 10:
        stack.append(state)
        return state
    if tag == 11:
        if not stack:
            raise DeviceError("the device's report descriptor pops an empty stack")
        return stack.pop()
    if tag == 2:
        # 0xFFFF in two bytes is 65535 for an unsigned field, -1 only where the minimum is negative
        return replace(state, logical_max=_signed(data) if state.logical_min < 0 else value)
    names = {0: "page", 1: "logical_min", 7: "size", 8: "report_id", 9: "count"}
    return replace(state, **{names[tag]: _signed(data) if tag == 1 else value}) if tag in names else state


def _local_item(local: _Locals, page: int, tag: int, value: int, length: int) -> None:
    usage = value if length == 4 else page << 16 | value
    if tag == 0:
        local.usages.append(usage)
    elif tag == 1:
        local.low = usage
    elif tag == 2 and local.low is not None:
        local.usages.extend(range(local.low, min(usage, local.low + 4096) + 1))
        local.low = None


def _field(
    kind: Kind, state: _Globals, local: _Locals, flags: int, bit: int, path: tuple[int, ...]
) -> ReportField:
    return ReportField(
        kind,
        state.report_id,
        bit,
        state.size,
        state.count,
        tuple(local.usages),
        state.logical_min,
        state.logical_max,
        not flags & 2,
        path,
    )
