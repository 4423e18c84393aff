"""What libraries say while they read a file goes into our log, not onto the terminal: a file that cannot be
read is refused in one line of ours."""

from __future__ import annotations

import contextlib
import io
import logging
import threading
import warnings
from collections.abc import Iterator

from palpate.mechanics.errors import PalpateWarning


class _Mine(logging.Filter):
    """Of the root logger, to which libraries log by `logging.error`: what this thread says goes to `log`."""

    def __init__(self, log: logging.Logger) -> None:
        super().__init__()
        self.log, self.thread = log, threading.get_ident()

    def filter(self, record: logging.LogRecord) -> bool:
        if record.thread != self.thread:
            return True
        self.log.info("%s", _on_one_line(record.getMessage()))
        return False


@contextlib.contextmanager
def overheard(log: logging.Logger) -> Iterator[None]:
    """In the block, what libraries warn of, log and print goes to `log`, level INFO; our own warnings come
    after it. No logger is disabled, and what other threads log is left alone; what they print meanwhile goes
    to `log` too."""
    root, mine, none = logging.getLogger(), _Mine(log), logging.NullHandler()
    printed = io.StringIO()
    root.addFilter(mine)
    root.addHandler(none)  # else the first `logging.error` gives the root a handler, for good
    ours: list[warnings.WarningMessage] = []
    try:
        with (
            warnings.catch_warnings(record=True, action="always") as warned,
            contextlib.redirect_stdout(printed),
            contextlib.redirect_stderr(printed),
        ):
            yield
    finally:
        root.removeFilter(mine)
        root.removeHandler(none)
        for each in warned:
            if issubclass(each.category, PalpateWarning):
                ours.append(each)
            else:
                log.info("%s: %s", each.category.__name__, _on_one_line(str(each.message)))
        for line in filter(str.strip, printed.getvalue().splitlines()):
            log.info("%s", _on_one_line(line))
    for each in ours:
        warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)


def _on_one_line(text: str) -> str:
    return " ".join(text.split())
