"""The servo's clock: monotonic nanoseconds and sleeping until an absolute time, from compiled code on Linux.

`COMPILED` says whether the compiled loop can sleep by itself (clock_nanosleep with TIMER_ABSTIME). Elsewhere
the loop is driven from Python, which sleeps short and spins the rest.

What the operating system grants a real-time loop, and one plain word for what it does not.
"""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import threading
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


_LOCK_ALL = 1 | 2  # MCL_CURRENT | MCL_FUTURE


def lock_memory() -> str:
    """Keep this process's pages in memory; '' where that was granted, else why not."""
    if not sys.platform.startswith("linux"):
        return f"memory: not locked (not supported on {sys.platform})"
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_LOCK_ALL) == 0:
        return ""
    reason = os.strerror(ctypes.get_errno())
    libc.munlockall()
    return f"memory: not locked ({reason}; raise 'ulimit -l' or grant CAP_IPC_LOCK)"


def real_time_thread(priority: int) -> str:
    """SCHED_FIFO for the calling thread; '' where that was granted, else why not."""
    if priority == 0:
        return "SCHED_FIFO: not requested"
    if not hasattr(os, "sched_setscheduler"):
        return f"SCHED_FIFO: not supported on {sys.platform}"
    try:
        os.sched_setscheduler(threading.get_native_id(), os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        return f"SCHED_FIFO: not permitted ({error.strerror}; grant CAP_SYS_NICE or an rtprio limit)"
    return ""


def quiet_interpreter() -> None:
    """No garbage collection, and a thread that waits for the interpreter gets it within 0.1 ms."""
    gc.collect()
    gc.freeze()
    gc.disable()
    sys.setswitchinterval(1e-4)
