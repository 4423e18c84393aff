"""Libraries are loaded whole: one that is half loaded when an exception comes may crash the process."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterator


@contextlib.contextmanager
def loaded_whole() -> Iterator[None]:
    """Ctrl-C and requests to end wait until what is loaded here is there; then they are answered."""
    names = ("SIGINT", "SIGTERM", "SIGHUP")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    ours = [n for n in numbers if callable(signal.getsignal(n))]
    if threading.current_thread() is not threading.main_thread() or not ours:
        yield
        return
    came: list[int] = []
    before = {n: signal.signal(n, lambda number, frame: came.append(number)) for n in ours}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if came:
        signal.raise_signal(came[0])
