"""One field of an operation: of which kinds it is, whether a value may stand there, and how it is listed."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any

from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import near
from palpate.mechanics.options import check_range

_KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "bool": (lambda v: isinstance(v, bool), "True or False"),
    "int": (lambda v: isinstance(v, Integral) and not isinstance(v, bool), "a whole number"),
    "float": (lambda v: isinstance(v, Real) and not isinstance(v, bool), "a number"),
    "str": (lambda v: isinstance(v, str), "a word"),
}


def type_words(field: dataclasses.Field[Any]) -> set[str]:
    """The names of a field's types: {"float", "None"}."""
    text = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", str(field.type))
    return {part.strip() for part in text.split("|")}


def check(name: str, value: Any, field: dataclasses.Field[Any]) -> None:
    """Raise OptionError for a value of the wrong kind, not among the choices, or out of range."""
    types = type_words(field)
    if value is None and "None" in types:
        return
    choices = field.metadata["choices"]
    if choices and value not in choices:
        like = near(str(value), choices)
        meant = f"did you mean {like[0]}? " if like else ""
        raise OptionError(f"{name} is {value!r}; {meant}allowed are {', '.join(choices)}")
    plain = types - {"None"}
    if len(plain) == 1 and (word := plain.pop()) in _KINDS and not _KINDS[word][0](value):
        unit = f" in {field.metadata['unit']}" if field.metadata["unit"] else ""
        raise OptionError(f"{name} is {value!r}; it must be {_KINDS[word][1]}{unit}")
    check_range(field, value)


@dataclass(frozen=True)
class Option:
    """One option: its name as a keyword, default, unit ('' for a pure number or a word), words, the only
    values allowed where they are few, and the least and greatest number."""

    name: str
    default: Any
    unit: str
    help: str
    choices: tuple[str, ...] | None
    low: float
    high: float

    @property
    def words(self) -> str:
        """Name, unit, meaning, and what is allowed."""
        return f"{self.name}{self._said}"

    @property
    def _said(self) -> str:
        unit = f" [{self.unit}]" if self.unit else ""
        allowed = f"; one of {', '.join(self.choices)}" if self.choices else ""
        return f"{unit}: {self.help}{allowed}"

    def __str__(self) -> str:
        return f"{self.name} = {self.default!r}{self._said}"


class Options(tuple[Option, ...]):
    """The options of one operation; `print` lists them, a line each."""

    def __str__(self) -> str:
        return "\n".join(map(str, self))

    __repr__ = __str__
