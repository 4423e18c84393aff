"""A block of numbers with one writer and any readers, without a lock: readers copy and look again.

The writer makes the counter odd, writes, makes it even; a reader takes the copy where the counter was even
and the same before and after. Fences keep compiler and processor from reordering (also on ARM).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

import numpy as np
from numba import types
from numba.extending import intrinsic

from palpate.mechanics.kernels import kernel

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
