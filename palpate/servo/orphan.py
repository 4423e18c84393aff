"""A servo whose parent was killed ends by itself, whatever it is doing, with zero force.

The end of the input is no proof of the parent's end: a process that it forked holds the other end open. So
the parent's number is looked at, from the first moment on, by a thread that needs nothing of what it ends.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable

from devices.safety import LATCHING
from palpate.servo.layout import ENABLE, ROW, STOP, SharedArrays

LOOK_S = 0.1
GRACE_S = 0.7


def end_with_parent(parent: int, arrays: SharedArrays, goes_on: Callable[[], bool]) -> None:
    """Watch in a thread of its own: zero and an ordinary end at once, a hard one after GRACE_S.

    goes_on: whether this servo is to outlive its parent; it does for as long as it has a force to give, since
    nobody is left who could enable it. Systems without a parent that changes tell by the input's end alone.
    """
    if os.name != "posix":
        return

    def watch() -> None:
        while os.getppid() == parent or (goes_on() and _gives_force(arrays)):
            time.sleep(LOOK_S)
        arrays.control[ENABLE] = 0
        arrays.control[STOP] = 1
        time.sleep(GRACE_S)
        # still loading, compiling, or in a driver that hangs: what the device does then is its own rule
        os._exit(1)

    threading.Thread(target=watch, name="servo's parent", daemon=True).start()


def _gives_force(arrays: SharedArrays) -> bool:
    """Whether force is enabled and no fault has latched."""
    last = arrays.ring[int(arrays.ring_head[0] - 1) % len(arrays.ring)].view(ROW)[0]
    return bool(arrays.control[ENABLE]) and not int(last["reasons"]) & LATCHING
