"""What a command says: progress on standard error, JSON to a file or standard output, lines for a person."""

from __future__ import annotations

import json
import shutil
import sys
import threading
from collections.abc import Collection
from contextlib import AbstractContextManager
from typing import Any

from palpate.mechanics.disk.writing import JSON, atomic_file
from palpate.mechanics.progress import Progress, Remaining
from palpate.mechanics.result import plain


class Output:
    """Standard output of one command. destination: of its JSON; '-' keeps standard output for it alone."""

    def __init__(self, destination: str | None = None) -> None:
        self.destination = destination

    def say(self, *lines: str) -> None:
        """Print lines for a person, unless standard output belongs to JSON."""
        if self.destination != "-" and lines:
            print(*lines, sep="\n", flush=True)  # a pipe or file shows it while the work goes on

    def stages(self, progress: Progress, first: str, brief: Collection[str] = ()) -> Progress:
        """The same progress, which says each stage before it begins where no terminal shows its bar. first:
        what is said before them all; brief: stages that are over at once, of which nothing is said."""
        met: list[str] = []

        def told(stage: str, fraction: float) -> None:
            if stage not in (*met, *brief) and not sys.stderr.isatty():
                self.say(*([] if met else [first]), f"  {stage} ...")
                met.append(stage)
            progress(stage, fraction)

        return told

    def json(self, value: Any) -> None:
        """Write the answer as JSON where that was asked for."""
        emit_json(value, self.destination)


def emit_json(value: Any, destination: str | None) -> None:
    """Write `value` as JSON to a file, or to standard output for '-'; nothing for None."""
    if destination is None:
        return
    text = json.dumps(plain(value), indent=1)
    if destination == "-":
        print(text)
        return
    with atomic_file(destination, JSON) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


_REDRAWN_S, _SHORT_S = 1.0, 5.0
SILENT_S = 10.0
"""How long nothing is said where no terminal shows a bar."""


def progress_bar(label: str) -> Bar:
    """A `mechanics.progress.Progress` on standard error; call `.close()`, or use it as a context manager."""
    return Bar(label)


class Bar(AbstractContextManager["Bar"]):
    """The one display of every wait, which goes on while a stage tells of nothing: on a terminal a bar with
    the stage and what is left of it; elsewhere a line of these, of what takes longer than SILENT_S."""

    def __init__(self, label: str) -> None:
        from tqdm import tqdm

        terminal, (columns, rows) = sys.stderr.isatty(), shutil.get_terminal_size()
        self._bar = tqdm(
            total=100.0,
            desc=label,
            file=sys.stderr,
            disable=not terminal,
            bar_format="{percentage:3.0f}% {bar:16} {elapsed} {desc}",
            ncols=columns,
            nrows=rows,  # tqdm draws nothing on a terminal that says no size
            leave=True,
        )
        self._terminal, self._label, self._stage, self._share = terminal, label, "", 0.0
        self._left, self._closed = Remaining(), threading.Event()
        self._left.tell(0.0)
        self._thread = threading.Thread(target=self._go_on, name="progress", daemon=True)
        self._thread.start()

    def __call__(self, stage: str, fraction: float) -> None:
        self._stage, self._share = stage, min(max(fraction, 0.0), 1.0)
        self._left.tell(self._share)
        if self._terminal:
            self._draw()

    def _words(self) -> str:
        """Label and stage, and what is left."""
        late = self._left.elapsed_s > _SHORT_S
        about = ": ".join(word for word in (self._label, self._stage) if word)
        return ", ".join(word for word in (about, self._left.words() if late else "") if word)

    def _draw(self) -> None:
        self._bar.ncols = shutil.get_terminal_size().columns
        width = max(20, self._bar.ncols - 30)
        self._bar.set_description_str(self._words()[:width], refresh=False)
        self._bar.n = 100.0 * self._share
        self._bar.refresh()

    def _go_on(self) -> None:
        while not self._closed.wait(_REDRAWN_S if self._terminal else SILENT_S):
            if self._terminal:
                self._draw()
            else:
                print(f"{self._words()} ...", file=sys.stderr, flush=True)

    def close(self) -> None:
        """Finish the bar's line."""
        self._closed.set()
        self._thread.join()
        self._bar.close()

    def __exit__(self, *_: object) -> None:
        self.close()
