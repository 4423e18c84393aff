"""How a part of the program runs in a Python process of its own: the same installation as its parent's."""

from __future__ import annotations

import os
import sys
import threading


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
