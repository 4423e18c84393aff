"""What the operating system grants a real-time loop, and one plain word for what it does not."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import threading

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
        return "SCHED_FIFO: not asked for"
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
