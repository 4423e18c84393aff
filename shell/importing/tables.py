"""Tables of numbers, whatever file they come from; each format is one small reader."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.disk.reading import bounded_memory, no_file
from palpate.mechanics.errors import RecordingError


@dataclass(frozen=True)
class Table:
    """Columns (n,) by name, in the file's own units; name: of the topic, group or file that they come
    from."""

    name: str
    columns: Mapping[str, np.ndarray]

    @property
    def rows(self) -> int:
        """How many."""
        return len(next(iter(self.columns.values()), ()))


_HOME = "palpate.importing"
TEXT_SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".asc")
_READERS: dict[str, tuple[str, str]] = {
    **dict.fromkeys((*TEXT_SUFFIXES, ".gz"), (f"{_HOME}.text", "")),
    **dict.fromkeys((".xlsx", ".xlsm", ".xls", ".xlsb", ".ods"), (f"{_HOME}.sheets", "python-calamine")),
    ".npz": (f"{_HOME}.arrays:npz", ""),
    ".npy": (f"{_HOME}.arrays:npy", ""),
    ".mat": (f"{_HOME}.arrays:matlab", "h5py"),
    **dict.fromkeys((".h5", ".hdf5", ".hdf"), (f"{_HOME}.arrays:hdf5", "h5py")),
    ".parquet": (f"{_HOME}.arrays:parquet", "pyarrow"),
    ".bag": (f"{_HOME}.ros_bags:bag", "rosbags"),
    ".db3": (f"{_HOME}.ros_bags:bag", "rosbags"),
    ".mcap": (f"{_HOME}.ros_bags:mcap", "mcap, rosbags"),
}
"""Suffix -> reader, and the libraries that it needs beyond the program's own."""
SUFFIXES = tuple(_READERS)


def read_tables(path: Path | str) -> list[Table]:
    """Every table of a file, or of a ROS 2 bag's folder.

    Raises RecordingError where the file is not there, is of no known kind, is damaged, holds no numbers, or
    needs a library that is not installed.
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f"'{path}' {no_file(path)}: name a file that is there")
    suffix = ".bag" if path.is_dir() else path.suffix.lower()
    if suffix not in _READERS:
        allowed = ", ".join(s.removeprefix(".") for s in SUFFIXES)
        raise RecordingError(
            f"'{path}' is of no kind that can be read: allowed are {allowed}, a ROS 2 bag's folder"
        )
    home, libraries = _READERS[suffix]
    module, _, function = home.partition(":")
    reader: Callable[[Path], list[Table]] = getattr(import_module(module), function or "read")
    try:
        with bounded_memory(path, RecordingError):
            tables = [t for t in map(_numbers, reader(path)) if t.columns and t.rows > 1]
    except RecordingError:
        raise
    except ModuleNotFoundError as error:
        raise RecordingError(
            f"'{path}' needs {libraries}, and {error.name} is not installed: pip install 'palpate[import]'"
        ) from error
    except Exception as error:  # each library has errors of its own for a damaged file
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise RecordingError(f"'{path}' cannot be read as {suffix.removeprefix('.')} ({reason})") from error
    if not tables:
        raise RecordingError(f"'{path}' holds no columns of numbers with two rows or more")
    return tables


def _numbers(table: Table) -> Table:
    """Without columns that hold no finite number."""
    kept = {name: np.asarray(v, dtype=float) for name, v in table.columns.items()}
    return Table(table.name, {name: v for name, v in kept.items() if np.isfinite(v).any()})


def flattened(name: str, value: Any) -> dict[str, float]:
    """The numbers of a message by dotted names: of mappings, objects with fields, and short sequences."""
    if isinstance(value, bool | int | float | np.number):
        return {name: float(value)}
    if isinstance(value, Mapping):
        parts = list(value.items())
    elif hasattr(value, "__dataclass_fields__"):
        parts = [(n, getattr(value, n)) for n in value.__dataclass_fields__ if not n.startswith("__")]
    elif isinstance(value, list | tuple | np.ndarray) and len(value) <= 16:
        parts = [(str(i), v) for i, v in enumerate(value)]
    else:
        return {}
    found: dict[str, float] = {}
    for key, part in parts:
        found |= flattened(f"{name}.{key}" if name else str(key), part)
    return found


def of_messages(name: str, times_s: list[float], messages: list[dict[str, float]]) -> Table:
    """A table of flattened messages: a column for what every message has, `stamp` the time where it has
    one."""
    common = set(messages[0]).intersection(*messages[1:]) if messages else set()
    columns = {key: np.array([m[key] for m in messages]) for key in messages[0] if key in common}
    seconds = next((k for k in columns if k.endswith("stamp.sec")), None)
    if seconds is not None:
        nano = next((k for k in columns if k.endswith(("stamp.nanosec", "stamp.nsec"))), None)
        stamp = columns.pop(seconds) + (1e-9 * columns.pop(nano) if nano else 0.0)
    else:
        stamp = np.array(times_s)
    return Table(name, {"stamp": stamp, **columns})
