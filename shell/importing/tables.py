"""Tables of numbers, whatever file they come from (`formats`: one file each), and what the readers share.

Units in columns' names, and what they are in SI.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from palpate.importing.formats.registry import by_suffix
from palpate.mechanics.disk.reading import bounded_memory, no_file
from palpate.mechanics.disk.surface_files import SUFFIXES
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.extras import install_words
from palpate.mechanics.quantities import parse_unit

_SPELT = {
    "time": ("s", "sec", "seconds", "ms", "us", "ns", "min"),
    "position": ("m", "cm", "mm", "um", "nm", "in", "inch"),
    "force": ("N", "mN", "uN", "nN", "kN", "gf", "kgf", "lbf", "newton", "g", "kg"),
}
_SAME = {"sec": "s", "seconds": "s", "inch": "in", "newton": "N", "g": "gf", "kg": "kgf"}
"""Other spellings; a column of force in grams holds the weight of so much."""
SI = {
    kind: {unit: parse_unit(_SAME.get(unit, unit)).scale for unit in units} for kind, units in _SPELT.items()
}
"""Kind of quantity -> unit -> what one is in SI."""
_BRACKETS = re.compile(r"[\[({]\s*([^\])}\d][^\])}]*?)\s*[\])}]\s*(?:#\d+)?$")
_TAIL = re.compile(r"(?:\s*[_/,]\s*|\s+)([A-Za-zµμ]+)$")


_EPOCH_S = (1e9, 2.2e9)
"""Seconds since 1970 from 2001 to 2039."""


def unit_since_1970(t: np.ndarray) -> str | None:
    """The unit of times (n,) that count from 1970 in ms, us or ns; None where they do not."""
    middle = float(np.median(t[np.isfinite(t)])) if np.isfinite(t).any() else 0.0
    low, high = _EPOCH_S
    return next((u for u in ("ms", "us", "ns") if low < middle * SI["time"][u] < high), None)


def plain(unit: str) -> str:
    """A unit in plain letters: either micro sign is u."""
    return unit.strip().replace("µ", "u").replace("μ", "u").replace("\ufffd", "u")


def is_unit(text: str) -> bool:
    """Whether a word is a unit of anything."""
    word = plain(text).lower()
    return word in _OTHER or any(word == unit.lower() for units in SI.values() for unit in units)


_OTHER = ("-", "%", "pa", "kpa", "mpa", "deg", "rad", "nm", "n/mm^2")


def unit_in(name: str, kind: str) -> str | None:
    """The unit of that kind that a column's name ends with: in brackets, after an underscore, space or
    slash."""
    found = _BRACKETS.search(name) or _TAIL.search(name)
    if not found:
        return None
    unit, allowed = plain(found[1]), SI[kind]
    if unit in allowed:
        return unit
    alike = [u for u in allowed if u.lower() == unit.lower()]
    return alike[0] if len(alike) == 1 else None


def without_unit(name: str) -> str:
    """The name without the unit in brackets, or after an underscore, space or slash, that it ends with."""
    bare = _BRACKETS.sub("", name)
    tail = _TAIL.search(bare)
    return bare[: tail.start()] if tail and is_unit(tail[1]) and len(bare) > len(tail[0]) else bare


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


def read_tables(path: Path | str) -> list[Table]:
    """Every table of a file, or of a ROS 2 bag's folder.

    Raises RecordingError where the file is not there, is of no known kind, is damaged, holds no numbers, or
    needs a library that is not installed.
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f"'{path}' {no_file(path)}: name a file that is there")
    suffix, known = ".bag" if path.is_dir() else path.suffix.lower(), by_suffix()
    if suffix not in known:
        allowed, shapes = (", ".join(s.removeprefix(".") for s in each) for each in (known, SUFFIXES))
        raise RecordingError(
            f"'{path}' is of no kind that can be read: allowed are {allowed}, a ROS 2 bag's folder; of "
            f"shapes {shapes}. Export its numbers as csv, its shape as stl"
        )
    module, _, needs = known[suffix]
    reader: Callable[[Path], list[Table]] = import_module(module).read
    try:
        with bounded_memory(path, RecordingError):
            tables = [t for t in map(_numbers, reader(path)) if t.columns and t.rows > 1]
    except RecordingError:
        raise
    except ModuleNotFoundError as error:
        raise RecordingError(
            f"'{path}' needs {needs}, and {error.name} is not installed: "
            + install_words("import", error.name)
        ) from error
    except Exception as error:  # each library has errors of its own for a damaged file
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise RecordingError(
            f"'{path}' cannot be read as {suffix.removeprefix('.')} ({reason}): write it anew, as csv "
            "where that fails"
        ) from error
    if not tables:
        raise RecordingError(f"'{path}' holds no columns of numbers with two rows or more")
    return tables


def _numbers(table: Table) -> Table:
    """Without columns that hold no finite number, and with each stamp's seconds and nanoseconds in one."""
    kept = {name: np.asarray(v, dtype=float) for name, v in table.columns.items()}
    return Table(table.name, _stamped({name: v for name, v in kept.items() if np.isfinite(v).any()}))


_SECONDS = re.compile(r"((.*?)[._/]?)secs?")
_FRACTIONS = ("nanosec", "nanosecs", "nsec", "nsecs")


def _stamped(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """ROS writes a time as whole seconds beside nanoseconds: the first takes in the second."""
    found: dict[str, np.ndarray] = {}
    for name, values in columns.items():
        stamp, fraction = _beside(name, columns)
        if fraction is None:
            found[name] = values
        else:
            found[stamp] = values + 1e-9 * columns[fraction]
    return found


def _beside(seconds: str, columns: Mapping[str, np.ndarray]) -> tuple[str, str | None]:
    """(what whole seconds are the time of, the column of nanoseconds beside them or None)."""
    found = _SECONDS.fullmatch(seconds)
    if found is None:
        return seconds, None
    beside = (f"{found[1]}{name}" for name in _FRACTIONS)
    return found[2] or "stamp", next((name for name in beside if name in columns), None)


def by_length(name: str, held: Mapping[str, np.ndarray]) -> list[Table]:
    """A table for each length: (n,) arrays, and the columns of (n, k) or (k, n) with k up to 16."""
    tables: dict[int, dict[str, np.ndarray]] = {}
    for key, value in held.items():
        value = np.asarray(value)
        if value.dtype.kind == "M":
            value = (value - value[0]).astype("timedelta64[ns]").astype(float) * 1e-9
        if value.dtype.kind not in "fiub" or value.ndim not in (1, 2) or not value.size:
            continue
        value = value[:, None] if value.ndim == 1 else value
        value = value.T if value.shape[0] < value.shape[1] else value
        if value.shape[1] > 16:
            continue
        wide = value.shape[1] > 1
        own = tables.setdefault(len(value), {})
        own.update({f"{key}[{k}]" if wide else key: value[:, k].astype(float) for k in range(value.shape[1])})
    many = len(tables) > 1
    return [Table(f"{name}:{n}" if many else name, columns) for n, columns in tables.items()]


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
        nano = _beside(seconds, columns)[1]
        stamp = columns.pop(seconds) + (1e-9 * columns.pop(nano) if nano else 0.0)
    else:
        stamp = np.array(times_s)
    return Table(name, {"stamp": stamp, **columns})
