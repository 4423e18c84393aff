"""What a command says: progress on standard error, JSON to a file or standard output, lines for a person."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from pathlib import Path
from typing import Any, Self

from mechanics.files import JSON, atomic_file


class Output:
    """Standard output of one command. destination: of its JSON; '-' keeps standard output for it alone."""

    def __init__(self, destination: str | None = None) -> None:
        self.destination = destination

    def say(self, *lines: str) -> None:
        """Print lines for a person, unless standard output belongs to JSON."""
        if self.destination != "-" and lines:
            print(*lines, sep="\n")

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


def plain(value: Any) -> Any:
    """A value that JSON can hold: arrays as lists, numbers that are not finite as null."""
    import numpy as np

    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return plain(dataclasses.asdict(value))
    if isinstance(value, dict) or hasattr(value, "items"):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def progress_bar(label: str) -> Bar:
    """A `mechanics.progress.Progress` that draws a bar on stderr when that is a terminal; call `.close()`."""
    return Bar(label)


class Bar:
    """See `progress_bar`; also a context manager, which closes it."""

    def __init__(self, label: str) -> None:
        from tqdm import tqdm

        self._bar = tqdm(
            total=100.0,
            desc=label,
            disable=not sys.stderr.isatty(),
            bar_format="{desc:<34.34} {bar:24} {percentage:3.0f}% {elapsed}",
            leave=True,
        )
        self._label = label

    def __call__(self, stage: str, fraction: float) -> None:
        self._bar.set_description_str(f"{self._label}: {stage}", refresh=False)
        self._bar.n = 100.0 * min(max(fraction, 0.0), 1.0)
        self._bar.refresh()

    def close(self) -> None:
        """Finish the bar's line."""
        self._bar.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
