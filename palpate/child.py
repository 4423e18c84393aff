"""How a part of the program runs in a Python process of its own: the same installation as its parent's."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
"""The folder that holds the packages: site-packages, or a checkout that was installed editable."""


def module_command(module: str, *arguments: str) -> list[str]:
    """The command line that runs `python -m module` in this very interpreter.

    -P keeps the current folder out of the search: in a checkout it would shadow the installed packages.
    """
    return [sys.executable, "-P", "-m", module, *arguments]


def module_environment(**variables: str) -> dict[str, str]:
    """This process's environment and `variables`, with the parent's own packages found first."""
    old = os.environ.get("PYTHONPATH")
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *([old] if old else [])]), **variables}


def end_with_parent() -> None:
    """From now on, end this process at once when its input ends: then the parent, which holds the other end
    of that pipe, is gone, however that happened."""

    def wait() -> None:
        while os.read(0, 1 << 16):
            pass
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()
