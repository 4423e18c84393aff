"""The memory that the servo shares with its parent: named arrays in one block, and what their cells mean.

Writers: the parent writes `control`; the servo's loop writes everything else. Blocks with a `_version` are
read by a sequence lock; the ring's rows are complete up to `ring_head`.

A sequence lock: a block of numbers with one writer and any readers, who copy and look again. The writer
makes the counter odd, writes, makes it even; a reader takes the copy where the counter was even and the
same before and after. Fences keep compiler and processor from reordering (also on ARM).
"""

from __future__ import annotations

import math
import mmap
import os
import tempfile
from collections.abc import Callable
from typing import NamedTuple, cast

import numpy as np
from numba import types
from numba.extending import intrinsic

from palpate.mechanics.disk.scratch import memory_folder, temporary_prefix
from palpate.mechanics.disk.writing import writing
from palpate.mechanics.kernels import kernel
from palpate.servo.histogram import BINS

RING_ROWS = 8192
MOST_TIPS = 32

STOP, ENABLE, BEAT = range(3)
"""Cells of `control`: STOP not 0 ends the loop; ENABLE: 0 for force off, else the number of the enabling;
BEAT: the parent's heartbeat, counted up for as long as it lives and runs."""

TICKS, MISSED, LATE, CONTACT_TICKS, DEADLINE, STARTED, STATUS, UNSETTLED = range(8)
"""Cells of `counts` (int64): ticks run, deadlines skipped, ticks started late, ticks in contact, the next
deadline (ns), the first deadline (ns), whether the loop runs, and ticks whose force did not settle."""

TIP_WIDTH = 15
HEAD_WIDTH = 32
ROW = np.dtype(
    [
        ("tick", "f8"),
        ("time_s", "f8"),
        ("position", "f8", 3),
        ("tip", "f8", 3),
        ("rendered", "f8", 3),
        ("command", "f8", 3),
        ("quaternion", "f8", 4),
        ("reasons", "f8"),
        ("buttons", "f8"),
        ("touching", "f8"),
        ("enabled", "f8"),
        ("lateness_s", "f8"),
        ("compute_s", "f8"),
        ("depth", "f8"),
    ]
)
"""One tick in the ring. position, command: device frame; tip (the first), rendered (the sum over tips, on the
tool): scene frame; compute_s is of the tick before; depth (m) of the first tip in the object, 0 in air and on
the support."""

ROW_WIDTH = ROW.itemsize // 8

_FIELDS: tuple[tuple[str, str, tuple[int, ...]], ...] = (
    ("control", "i8", (8,)),
    ("counts", "i8", (16,)),
    ("ring_head", "i8", (1,)),
    ("ring", "f8", (RING_ROWS, ROW_WIDTH)),
    ("snapshot_version", "i8", (1,)),
    ("snapshot", "f8", (HEAD_WIDTH + MOST_TIPS * TIP_WIDTH,)),
    ("compute_bins", "i8", (BINS,)),
    ("compute_extremes", "i8", (3,)),
    ("lateness_bins", "i8", (BINS,)),
    ("lateness_extremes", "i8", (3,)),
    ("reason_counts", "i8", (16,)),
    ("energies", "f8", (8,)),
    ("peak", "f8", (2,)),
)


class SharedArrays(NamedTuple):
    """Views of the shared block; shapes and meanings above."""

    control: np.ndarray
    counts: np.ndarray
    ring_head: np.ndarray
    ring: np.ndarray
    snapshot_version: np.ndarray
    snapshot: np.ndarray
    compute_bins: np.ndarray
    compute_extremes: np.ndarray
    lateness_bins: np.ndarray
    lateness_extremes: np.ndarray
    reason_counts: np.ndarray
    energies: np.ndarray
    peak: np.ndarray


def total_bytes() -> int:
    """Bytes of the block."""
    return sum(8 * math.prod(shape) for _, _, shape in _FIELDS)


def views(buffer: mmap.mmap | bytearray) -> SharedArrays:
    """The named arrays in a block of `total_bytes()`."""
    arrays, offset = {}, 0
    for name, kind, shape in _FIELDS:
        size = math.prod(shape)
        arrays[name] = np.frombuffer(buffer, dtype=kind, count=size, offset=offset).reshape(shape)
        offset += 8 * size
    return SharedArrays(**arrays)


def _take(descriptor: int, path: str) -> None:
    """Give the file its room now: where there is none, writing through the map would kill the process."""
    with writing(path):
        try:
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(descriptor, 0, total_bytes())
            else:
                os.ftruncate(descriptor, total_bytes())
        except OSError:
            os.close(descriptor)
            os.unlink(path)
            raise


class SharedBlock:
    """The block: a file in memory, made by the parent, mapped by its path in the servo.

    A plain mapped file instead of multiprocessing.shared_memory: its name can go as soon as both have it
    (`forget`), so that nothing is left behind by whichever is killed, and arrays keep the memory alive.
    """

    def __init__(self, path: str | None = None) -> None:
        self._owner = path is None
        if path is None:
            descriptor, path = tempfile.mkstemp(prefix=temporary_prefix("servo-"), dir=memory_folder())
            _take(descriptor, path)
        else:
            descriptor = os.open(path, os.O_RDWR)
        try:
            self.arrays = views(mmap.mmap(descriptor, total_bytes()))
        finally:
            os.close(descriptor)
        self.path = path

    def forget(self) -> None:
        """Remove the name (the owner's task); the memory goes with the last array. Harmless when repeated."""
        if self._owner:
            try:
                os.unlink(self.path)
            except FileNotFoundError:
                pass
            except PermissionError:
                return  # Windows keeps the name of a mapped file; the next call may succeed
            self._owner = False


TRIES = 1000


def _fence(typing_context):
    def generate(context, builder, signature, arguments):
        builder.fence("seq_cst")
        return context.get_dummy_value()

    return types.void(), generate


fence = cast(Callable[[], None], intrinsic(_fence))
"""A full memory fence; compiled code calls it without the typing context that numba passes."""


@kernel
def begin_write(counter):
    """Before writing the block."""
    counter[0] += 1
    fence()


@kernel
def end_write(counter):
    """After writing the block."""
    fence()
    counter[0] += 1


@kernel
def write_block(counter, block, values):
    """block[...] = values, as one."""
    begin_write(counter)
    for i in range(values.size):
        block[i] = values[i]
    end_write(counter)


@kernel
def read_block(counter, block, values):
    """values[...] = block as one; returns the block's version, or -1 where the writer never let go."""
    for _ in range(TRIES):
        before = counter[0]
        fence()
        if before % 2 == 0:
            for i in range(values.size):
                values[i] = block[i]
            fence()
            if counter[0] == before:
                return before
    return -1


def read_copy(counter: np.ndarray, block: np.ndarray) -> np.ndarray | None:
    """A consistent copy of the block, or None where the writer died in the middle of a write."""
    values = np.empty_like(block)
    return None if read_block(counter, block, values) < 0 else values
