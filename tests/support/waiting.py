"""Waiting for a state. The limit only ends a test that hangs: no test is about how long something takes."""

from __future__ import annotations

import time
from collections.abc import Callable

PATIENCE_S = 600.0


def eventually(condition: Callable[[], object], patience_s: float = PATIENCE_S) -> bool:
    """Whether `condition()` comes true within `patience_s` seconds; it is asked every few milliseconds."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.005)
    return bool(condition())
