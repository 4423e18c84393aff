"""The log of the program: logger `palpate`, a child by module (`palpate.mechanics.disk.store`).

In Python it is any library's: it prints nothing below WARNING until one asks, by
`logging.getLogger("palpate")`. A command writes it to standard error, a line each, from `--log-level` on;
what libraries warn of goes to `palpate.libraries`.
"""

from __future__ import annotations

import contextlib
import logging
import sys
import warnings
from collections.abc import Iterator
from typing import TextIO

LEVELS = ("debug", "info", "warning", "error")
LOG = logging.getLogger("palpate")
_LIBRARIES, _OURS = LOG.getChild("libraries"), LOG.getChild("warnings")


class _Lines(logging.Handler):
    """To standard error as it is when the line is written."""

    def __init__(self, prog: str) -> None:
        super().__init__()
        self.prog = prog

    def emit(self, record: logging.LogRecord) -> None:
        level, words = record.levelname.lower(), " ".join(record.getMessage().split())
        where = "" if record.levelno >= logging.WARNING else f" {record.name.removeprefix('palpate.')}:"
        with contextlib.suppress(OSError, ValueError):  # nobody reads standard error any more
            print(f"{self.prog}: {level}:{where} {words}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def on_stderr(prog: str, level: str = "warning") -> Iterator[None]:
    """In the block, the log stands on standard error, warnings in it; afterwards all is as before."""
    before, handler = LOG.level, _Lines(prog)
    LOG.addHandler(handler)
    set_level(level)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _warned
            yield
    finally:
        LOG.removeHandler(handler)
        LOG.setLevel(before)


def set_level(level: str) -> None:
    """What is less than `level`, one of LEVELS, is not logged."""
    LOG.setLevel(level.upper())


def _warned(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    from palpate.mechanics.errors import PalpateWarning

    if issubclass(category, PalpateWarning):
        _OURS.warning("%s", message)
    else:
        _LIBRARIES.warning("%s: %s (%s, line %d)", category.__name__, message, filename, lineno)
