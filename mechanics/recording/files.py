"""The two files of a recording: NAME.csv or NAME.csv.gz, columns of numbers under a header, and NAME.toml,
whose keys stand here with their ranges."""

from __future__ import annotations

import gzip
import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.bounds import LARGEST_N
from palpate.mechanics.contact.tip import FORMS
from palpate.mechanics.disk.reading import no_file, reading
from palpate.mechanics.disk.schema import ANY, FileKey, Listed, Schema
from palpate.mechanics.disk.surface_files import UNITS
from palpate.mechanics.disk.writing import Kind
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.plausible import (
    EXPLORATION,
    MOST_SAMPLES,
    POISSON_RATIO,
    READ_RATE,
    SAMPLE_RATE,
    TIP_RADIUS,
    TOOL_MASS,
)
from palpate.mechanics.recording.segments import STATED

REQUIRED_COLUMNS = ("t", "x", "y", "z", "fx", "fy", "fz")
QUATERNION_COLUMNS = ("qw", "qx", "qy", "qz")
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
            raise RecordingError(
                f"'{self._path}' unpacks to more than any recording holds: it is not a recording"
            )
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


_UNITS = {
    "micrometres": ("um", 1e-6),
    "millimetres": ("mm", 1e-3),
    "centimetres": ("cm", 1e-2),
    "inches": ("in", 0.0254),
}


def check_plausible(t: np.ndarray, rate: float, position: np.ndarray, force: np.ndarray) -> None:
    """Raises RecordingError for what no exploration of an object of 1 mm to 1 m by hand can be.

    t: (n,) s. rate: stated, Hz. position: (n, 3) m. force: (n, 3) N.
    """
    block = min(100, len(t) - 1)
    read = block / float(np.median(t[block:] - t[:-block]))
    if not _near(read, rate):
        units = {"milliseconds": ("ms", 1e3), "microseconds": ("us", 1e6)}
        like = next((unit for unit, (_, scale) in units.items() if _near(read * scale, rate)), "")
        raise RecordingError(
            f"t steps by {1 / read:.4g}, in seconds {read:.4g} Hz, where sample_rate_hz is {rate:g}: "
            + (f"these look like {like}; write t in seconds" if like else "state the true rate"),
            {"units": {"time": units[like][0]}} if like else {"rate_hz": float(f"{read:.4g}")},
        )
    if (t[-1] - t[0]) * max(rate, read) > MOST_SAMPLES:
        gap = int(np.argmax(np.diff(t)))
        raise RecordingError(
            f"the clock runs from {t[0]:.6g} to {t[-1]:.6g} s (longest gap {t[gap + 1] - t[gap]:.4g} s, "
            f"after data row {gap + 1}): at most {MOST_SAMPLES / rate:.6g} s at {rate:g} Hz; mend the clock "
            "or cut the recording"
        )
    path, extent = EXPLORATION["extent"], float(np.ptp(position, axis=0).max())
    if extent > path.high:
        guesses = [u for u, (_, s) in _UNITS.items() if path.likely[0] <= extent * s <= path.likely[1]]
        like = f"these look like {' or '.join(guesses)}; " if guesses else ""
        raise RecordingError(
            f"the tip's path is {extent:.4g} m across: {like}x, y, z must be metres, at most "
            f"{path.high:g} m across",
            {"units": {"position": _UNITS[guesses[0]][0]}} if guesses else {},
        )
    loud = np.flatnonzero((np.abs(force) > LARGEST_N).any(axis=1))
    if len(loud):
        raise RecordingError(
            f"{len(loud)} samples have a force above {LARGEST_N:g} N (first in data row {loud[0] + 1}): no "
            "sensor reads that; remove or repair those rows"
        )


def _near(value: float, other: float) -> bool:
    most = EXPLORATION["rate"].high
    return other / most < value < other * most


SCHEMA: Schema = {
    "recording": {
        "sample_rate_hz": SAMPLE_RATE,
        "force_on": FileKey(str, choices=("tool", "object"), required=True),
        "boundary_phase": FileKey(size=2, unit="s"),
        "quasi_static": FileKey(bool),
        "read_rate_hz": READ_RATE,
    },
    "tool": {
        "tip_radius_m": TIP_RADIUS,
        "tip": FileKey(str, choices=FORMS),
        "tip_angle_deg": FileKey(low=0.0, high=90.0, unit="deg"),
        "mass_kg": TOOL_MASS,
        "calibration": FileKey(str),
    },
    "sensor": {
        "force_noise_std_n": FileKey(low=0.0, high=10.0, unit="N"),
        "position_resolution_m": FileKey(low=0.0, high=0.01, unit="m"),
    },
    "object": {
        "name": FileKey(str),
        "poisson_ratio": POISSON_RATIO,
        "model": FileKey(str),
        "shape": FileKey(str),
        "shape_unit": FileKey(str, choices=tuple(UNITS)),
        "shape_pose": FileKey(str, choices=("auto", "given")),
        "shape_up": FileKey(str),
        "shape_sink_m": FileKey(low=0.0, high=1.0, unit="m"),
        "slab_m": FileKey(low=1e-6, high=2.0, unit="m"),
        "half_space": FileKey(bool),
    },
    "segment": Listed(
        {
            "kind": FileKey(str, choices=STATED, required=True),
            "start_s": FileKey(unit="s", required=True),
            "end_s": FileKey(unit="s", required=True),
        }
    ),
    "import": ANY,
    "truth": ANY,
}
"""What a recording's TOML may hold; further keys are left alone."""


def recording_files(path: Path | str) -> tuple[Path, Path]:
    """(samples, description) for a recording named by its .csv, .csv.gz or .toml."""
    path = Path(path)
    if path.name.endswith(".csv.gz"):
        stem = path.name.removesuffix(".csv.gz")
    elif path.suffix in (".csv", ".toml"):
        stem = path.name.removesuffix(path.suffix)
    else:
        raise RecordingError(f"'{path}' is no recording: name its .csv, .csv.gz or .toml")
    if path.suffix == ".toml":
        candidates = [path.with_name(stem + ending) for ending in (".csv.gz", ".csv")]
        samples = next((c for c in candidates if c.exists()), candidates[1])
    else:
        samples = path
    description = path.with_name(stem + ".toml")
    for file in (samples, description):
        if not file.is_file():
            raise RecordingError(
                f"'{file}' {no_file(file)}: a recording is NAME.csv (or NAME.csv.gz) "
                "and NAME.toml side by side"
            )
    return samples, description


def samples_path(path: Path | str) -> Path:
    """Where the samples of a recording to be written go; raises RecordingError for another ending."""
    path = Path(path)
    if path.suffix == ".toml":
        path = path.with_suffix(".csv.gz")
    if not path.name.endswith((".csv", ".csv.gz")):
        raise RecordingError(f"'{path}' must end in .csv, .csv.gz or .toml")
    return path


def description_of(path: Path) -> list[tuple[Path, Kind]]:
    path = samples_path(path)
    stem = path.name.removesuffix(".gz").removesuffix(".csv")
    return [(path.with_name(stem + ".toml"), DESCRIPTION)]


DESCRIPTION = Kind("a recording's description", (b"[recording]",))
SAMPLES = Kind(
    "a recording", (",".join(REQUIRED_COLUMNS).encode(),), likely_bytes=1 << 24, goes=samples_path,
    beside=description_of,
)  # fmt: skip
