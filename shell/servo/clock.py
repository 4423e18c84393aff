"""The servo's clock: monotonic nanoseconds and sleeping until an absolute time, from compiled code on Linux.

`COMPILED` says whether the compiled loop can sleep by itself (clock_nanosleep with TIMER_ABSTIME). Elsewhere
the loop is driven from Python, which sleeps short and spins the rest.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any, cast

from numba import njit, types

COMPILED = sys.platform.startswith("linux")
SPIN_S = 0.002


def c_function(name: str, signature: Any) -> Callable[..., int]:
    """A function of the C library for compiled code; numba's own type for it is not that of a callable."""
    return cast(Callable[..., int], types.ExternalFunction(name, signature))


_MONOTONIC = 1
_ABSOLUTE = 1
_gettime = c_function("clock_gettime", types.int32(types.int32, types.voidptr))
_nanosleep = c_function(
    "clock_nanosleep", types.int32(types.int32, types.int32, types.voidptr, types.voidptr)
)


@njit(cache=True, nogil=True)
def compiled_now_ns(timespec):
    """CLOCK_MONOTONIC in ns; timespec: (2,) int64 scratch. The clock of time.perf_counter_ns on Linux."""
    _gettime(_MONOTONIC, timespec.ctypes)
    return timespec[0] * 1_000_000_000 + timespec[1]


@njit(cache=True, nogil=True)
def compiled_sleep_until(timespec, deadline_ns):
    """Sleep until CLOCK_MONOTONIC reaches `deadline_ns`; returns at once where that has passed."""
    timespec[0] = deadline_ns // 1_000_000_000
    timespec[1] = deadline_ns % 1_000_000_000
    while _nanosleep(_MONOTONIC, _ABSOLUTE, timespec.ctypes, 0) == 4:
        pass  # EINTR: the time is absolute, so sleeping again loses nothing


def sleep_until(deadline_ns: int) -> None:
    """The same from Python, on every platform: sleeps short of the deadline, spins the rest."""
    while True:
        left = deadline_ns * 1e-9 - time.perf_counter()
        if left <= 0:
            return
        if left > SPIN_S:
            time.sleep(left - SPIN_S)
