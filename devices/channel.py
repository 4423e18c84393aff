"""Newest pose from one process to another through a small memory-mapped file; neither side ever waits.

A record carries its own checksum, so that a reader that meets a half-written one keeps the last whole one;
this needs no memory barrier and no lock.
"""

from __future__ import annotations

import contextlib
import mmap
import os
import struct
import tempfile
import zlib
from dataclasses import dataclass
from pathlib import Path

from palpate.mechanics.disk.scratch import memory_folder, temporary_prefix

_RECORD = struct.Struct("<Qd3dI")
_CHECK = struct.Struct("<I")
_SIZE = _RECORD.size + _CHECK.size


@dataclass(frozen=True)
class Pose:
    """sequence counts writes from 1; time_s: the writer's clock (CLOCK_MONOTONIC, shared by processes)."""

    sequence: int
    time_s: float
    position_m: tuple[float, float, float]
    buttons: int


class PoseChannel:
    """One writer, one reader. `PoseChannel.create()` in one process, `PoseChannel(path)` in the other."""

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        with open(self.path, "r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _SIZE)
        self._owner = False
        self._sequence = 0
        self._last: Pose | None = None

    @classmethod
    def create(cls) -> PoseChannel:
        """A new, empty channel; its creator removes the file on `close`."""
        handle, name = tempfile.mkstemp(prefix=temporary_prefix("pose-"), dir=memory_folder())
        os.write(handle, bytes(_SIZE))
        os.close(handle)
        channel = cls(name)
        channel._owner = True
        return channel

    def write(self, time_s: float, position_m: tuple[float, float, float], buttons: int = 0) -> None:
        """Replace the pose."""
        self._sequence += 1
        record = _RECORD.pack(self._sequence, time_s, *map(float, position_m), buttons)
        self._memory[:_SIZE] = record + _CHECK.pack(zlib.crc32(record))

    def read(self) -> Pose | None:
        """The newest whole pose, or None before the first."""
        data = self._memory[:_SIZE]
        record, (check,) = data[: _RECORD.size], _CHECK.unpack(data[_RECORD.size :])
        sequence, time_s, x, y, z, buttons = _RECORD.unpack(record)
        if sequence and zlib.crc32(record) == check:
            self._last = Pose(sequence, time_s, (x, y, z), buttons)
        return self._last

    def close(self) -> None:
        """Release it; the creator's close also removes the file."""
        self._memory.close()
        if self._owner:
            with contextlib.suppress(FileNotFoundError):
                self.path.unlink()
