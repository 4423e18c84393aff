"""Recordings, by file, by embedded name, or from what already holds one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mechanics.errors import OptionError, RecordingError
from palpate.operations._declare import REQUIRED, Call, operand, operation

if TYPE_CHECKING:
    from mechanics.recording import Recording
    from palpate.operations._shared import RecordingLike


@dataclass(frozen=True)
class ReadOperands:
    """What is read."""

    source: RecordingLike = operand(REQUIRED, "NAME.csv, NAME.csv.gz, NAME.toml, or an embedded name")


@operation(ReadOperands, progress=False)
def read_recording(asked: ReadOperands, call: Call) -> Recording:
    """Read a recording: NAME.csv, NAME.csv.gz or NAME.toml, or an embedded one by its name.

    Times s, positions of the tip's centre m, forces on the tool N, device frame.
    Raises RecordingError for what is missing or impossible.
    """
    from mechanics.recording import Recording as Plain
    from mechanics.recording import read_recording as read
    from scenes.embedded import embedded_names, embedded_recording

    source = asked.source
    if isinstance(source, Plain):
        return source
    held = getattr(source, "recording", None)
    if isinstance(held, Plain):
        return held
    if str(source) in embedded_names():
        return read(embedded_recording(str(source)))
    if not isinstance(source, str | Path):
        raise OptionError(f"a {type(source).__name__} is no recording: give one, or the path of its file")
    try:
        return read(source)
    except RecordingError as error:
        if Path(source).exists() or "." in Path(source).name:
            raise
        raise RecordingError(f"{error}; embedded are {', '.join(embedded_names())}") from error
