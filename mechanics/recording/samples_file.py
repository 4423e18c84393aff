"""The samples of a recording, NAME.csv or NAME.csv.gz: columns of numbers under a header."""

from __future__ import annotations

import gzip
import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.disk.files import reading
from mechanics.errors import RecordingError

REQUIRED_COLUMNS = ("t", "x", "y", "z", "fx", "fy", "fz")
QUATERNION_COLUMNS = ("qw", "qx", "qy", "qz")
MOST_SAMPLES = 10_000_000
"""Of a recording, also where its clock is filled at the sample rate: 2.7 hours at 1 kHz."""
_MOST_TEXT, _MOST_UNPACKED = 2 << 30, 200
"""Bytes of samples, and of unpacked ones a packed byte (numbers pack to a fifth)."""


class _Bounded(io.RawIOBase):
    """A stream that refuses to go on for ever: a small packed file may hold terabytes."""

    def __init__(self, path: Path, most: int) -> None:
        packed = path.suffix == ".gz"
        self._file: Any = gzip.open(path) if packed else open(path, "rb")
        self._left, self._path = most, path

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        count = self._file.readinto(buffer)
        self._left -= count
        if self._left < 0:
            raise RecordingError(f"'{self._path}' unpacks to more than any recording holds: it is none")
        return count

    def close(self) -> None:
        self._file.close()
        super().close()


def read_samples(path: Path) -> dict[str, np.ndarray]:
    """Columns by name; raises RecordingError where the header or a row does not fit.

    Numbers are ASCII, so that other columns may hold text of any encoding that begins with ASCII.
    """
    with reading(path, RecordingError):
        size = path.stat().st_size
        most = min(_MOST_TEXT, _MOST_UNPACKED * size + (1 << 20)) if path.suffix == ".gz" else _MOST_TEXT
        raw = io.BufferedReader(_Bounded(path, most), 1 << 18)
        with io.TextIOWrapper(raw, encoding="utf-8-sig", errors="surrogateescape") as file:
            first = file.readline(1 << 16)
            if "\0" in first or len(first) >= 1 << 16:
                raise RecordingError(f"'{path}' is no text of comma-separated numbers: save it as UTF-8 CSV")
            header = [name.strip() for name in first.split(",")]
            missing = [c for c in REQUIRED_COLUMNS if c not in header]
            if missing:
                shown = ascii(", ".join(header))[1:-1]
                raise RecordingError(
                    f"'{path}' lacks the columns {', '.join(missing)} (its header has "
                    f"{shown if len(shown) < 200 else shown[:200] + '...'}): needed are "
                    f"{', '.join(REQUIRED_COLUMNS)}"
                )
            wanted = [c for c in (*REQUIRED_COLUMNS, *QUATERNION_COLUMNS) if c in header]
            twice = [c for c in wanted if header.count(c) > 1]
            if twice:
                raise RecordingError(f"'{path}' has the column {twice[0]} twice: leave one of them out")
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", UserWarning)  # of empty lines and files
                    values = np.loadtxt(
                        file, delimiter=",", usecols=[header.index(c) for c in wanted], ndmin=2,
                        comments=None, max_rows=MOST_SAMPLES + 1,
                    )  # fmt: skip
            except ValueError as error:
                raise RecordingError(
                    f"'{path}' has a row that is not {len(header)} decimal numbers: {ascii(str(error))[1:-1]}"
                ) from error
    if len(values) > MOST_SAMPLES:
        raise RecordingError(
            f"'{path}' has more than {MOST_SAMPLES} samples: cut it, or sample it more slowly"
        )
    return dict(zip(wanted, values.T, strict=True))
