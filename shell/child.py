"""How a part of the program runs in a Python process of its own: the same installation as its parent's.

Libraries are loaded whole: one that is half loaded when an exception comes may crash the process.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any


def module_command(module: str, *arguments: str) -> list[str]:
    """The command line that runs `python -m module` in this very interpreter.

    -P keeps the current folder out of the search: a file `palpate.py` there would be taken for the package.
    """
    return [sys.executable, "-P", "-m", module, *arguments]


def end_with_parent() -> None:
    """From now on, end this process at once when its input ends: then the parent, which holds the other end
    of that pipe, is gone, however that happened."""

    def wait() -> None:
        while os.read(0, 1 << 16):
            pass
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


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
def loaded_whole(heard: Callable[[], object] = lambda: None) -> Iterator[None]:
    """Ctrl-C and requests to end wait until what is loaded here is there; then they are answered. heard: ends
    what is done here where it goes on until it is ended, as a library's loop that forgets exceptions."""
    came: list[int] = []

    def hear(number: int, frame: Any) -> None:
        came.append(number)
        heard()

    before = listen(hear)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if came:
        signal.raise_signal(came[0])
