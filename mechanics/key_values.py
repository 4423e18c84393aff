"""KEY=VALUE words, as options take them: the one place that cuts them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from palpate.mechanics.errors import OptionError


def pairs(given: Mapping[str, Any] | Iterable[str] | None, flag: str, example: str) -> list[tuple[str, Any]]:
    """(key, value) of KEY=VALUE words, or of what is a mapping already, each key once.

    flag: as it is typed, with its dashes. Raises OptionError for a word that is not of the example's form, or
    a key that is said twice.
    """
    if isinstance(given, Mapping):
        return list(given.items())
    found: dict[str, Any] = {}
    for word in given or ():
        key, equals, value = (part.strip() for part in word.partition("="))
        if not (key and equals and value):
            raise OptionError(f"{flag} '{word}' must be KEY=VALUE, as {example}")
        if key in found:
            raise OptionError(f"{flag} says '{key}' twice: say it once")
        found[key] = value
    return list(found.items())


def words_of(text: str) -> list[str]:
    """The words of a comma separated list."""
    return [word.strip() for word in text.split(",") if word.strip()]


def number(flag: str, key: str, value: Any) -> float:
    """The value as a number; raises OptionError where it is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise OptionError(f"{flag} {key}={value}: '{value}' is no number; write {key}=NUMBER") from None
