"""What a TOML may hold: every key with its type, range and unit in one table, checked in one place."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.mechanics import names
from palpate.mechanics.errors import PalpateError

_WORDS = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}
_SHOWN = 60


@dataclass(frozen=True)
class FileKey:
    """One key: its type, the values allowed, and how many where it is a list (0: as many as one likes).

    unknown: nan and inf are allowed, for what nobody knows.
    """

    kind: type = float
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    size: int | None = None
    choices: tuple[str, ...] = ()
    required: bool = False
    unknown: bool = False

    @property
    def words(self) -> str:
        """What is allowed, for people."""
        if self.choices:
            return f"one of {', '.join(self.choices)}"
        what = _WORDS[self.kind]
        if self.size is not None:
            what = f"a list of {self.size or ''} numbers".replace("  ", " ")
        return what + span(self.low, self.high, self.unit)

    def takes(self, value: Any) -> bool:
        """Whether a value of a TOML is allowed."""
        if self.size is not None:
            fits = isinstance(value, list | tuple) and (not self.size or len(value) == self.size)
            return fits and all(self._one(each) for each in value)
        return self._one(value)

    def _one(self, value: Any) -> bool:
        if self.kind in (bool, str):
            return isinstance(value, self.kind) and (not self.choices or value in self.choices)
        whole = isinstance(value, int) and not isinstance(value, bool)
        if not (whole or (self.kind is float and isinstance(value, float))):
            return False
        try:
            number = float(value)
        except OverflowError:
            return False
        inside = math.isfinite(number) and self.low <= number <= self.high
        return inside or (self.unknown and (math.isnan(number) or number == math.inf))


@dataclass(frozen=True)
class Named:
    """Tables of one form under names of their own: [inclusions.NAME]."""

    form: Schema


@dataclass(frozen=True)
class Listed:
    """An array of tables of one form: [[inclusion]]."""

    form: Schema


ANY = None
"""A key whose value is not checked."""
Schema = Mapping[str, "FileKey | Named | Listed | Schema | None"]


def span(low: float, high: float, unit: str) -> str:
    """' from 1 to 2 m', for people; '' where everything is allowed."""
    ends = math.isfinite(low), math.isfinite(high)
    if all(ends):
        words = f" from {low:g} to {high:g}"
    elif any(ends):
        words = f" of at least {low:g}" if ends[0] else f" of at most {high:g}"
    else:
        words = ""
    return f"{words} {unit}".rstrip() if unit and words else words + (f" in {unit}" if unit else "")


def near(name: str, allowed: Mapping[str, Any] | tuple[str, ...]) -> str | None:
    """The allowed name that was probably meant."""
    return next(iter(names.near(name, allowed, cutoff=0.75)), None)


def check_table(
    table: Any, schema: Schema, path: Path | str, error: type[PalpateError], *, strict: bool
) -> list[str]:
    """Raise `error` in one line for the first key of a wrong type or out of range, or one that is missing.

    strict: also for a key that nobody knows; else those that are probably misspelt come back, a line each.
    """
    notes: list[str] = []
    for line, weight in _faults(table, schema, ()):
        if weight == _GRAVE or strict:
            raise error(f"'{path}': {line}")
        if weight == _MISSPELT:
            notes.append(f"'{path}': {line}")
    return notes


_UNKNOWN, _MISSPELT, _GRAVE = range(3)


def _faults(table: Any, schema: Schema, where: tuple[str, ...]) -> Iterator[tuple[str, int]]:
    """(what is wrong, how much it weighs), grave ones first."""
    name = f"[{'.'.join(where)}]"
    if not isinstance(table, Mapping):
        yield f"{name} is {_shown(table)}; it must be a table", _GRAVE
        return
    below: list[tuple[str, int]] = []
    for key, form in schema.items():
        if key not in table:
            if isinstance(form, FileKey) and form.required:
                meant = near(key, tuple(k for k in table if k not in schema))
                hint = f" (is {meant!r} meant for it?)" if meant else ""
                yield f"{_at(name, where)}{key} is missing{hint}: it must be {form.words}", _GRAVE
            continue
        value = table[key]
        if isinstance(form, FileKey):
            if not form.takes(value):
                yield f"{_at(name, where)}{key} = {_shown(value)}; it must be {form.words}", _GRAVE
        elif isinstance(form, Named):
            forms = dict.fromkeys(value, form.form) if isinstance(value, Mapping) else {}
            below += _faults(value, forms, (*where, key))
        elif isinstance(form, Listed):
            if not isinstance(value, list):
                yield f"[[{'.'.join((*where, key))}]] is {_shown(value)}; it must be a list of tables", _GRAVE
                continue
            for number, each in enumerate(value):
                below += _faults(each, form.form, (*where, f"{key} {number + 1}"))
        elif form is not None:
            below += _faults(value, form, (*where, key))
    yield from sorted(below, key=lambda fault: fault[1] < _GRAVE)
    for key in table:
        if key not in schema:
            meant = near(key, schema)
            allowed = f"did you mean {meant}?" if meant else f"allowed are {', '.join(schema) or 'no keys'}"
            yield f"{_at(name, where)}{key} is no key: {allowed}", _MISSPELT if meant else _UNKNOWN


def _at(name: str, where: tuple[str, ...]) -> str:
    return f"{name} " if where else ""


def _shown(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."
