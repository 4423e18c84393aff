"""Libraries are loaded whole: one that is half loaded when an exception comes may crash the process."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from typing import Any


def listen(handler: Any) -> dict[int, Any]:
    """Let `handler` answer Ctrl-C and requests to end; returns what answered before."""
    names = ("SIGINT", "SIGTERM", "SIGHUP")
    try:
        numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
        ours = [n for n in numbers if signal.getsignal(n) not in (signal.SIG_IGN, None)]
        return {n: signal.signal(n, handler) for n in ours}
    except ValueError:  # in a thread: signals are the main one's business
        return {}


@contextlib.contextmanager
def loaded_whole() -> Iterator[None]:
    """Ctrl-C and requests to end wait until what is loaded here is there; then they are answered."""
    came: list[int] = []
    before = listen(lambda number, frame: came.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if came:
        signal.raise_signal(came[0])
