"""A name that nobody has: which was probably meant, and which are allowed. The one place that guesses.

KEY=VALUE words, as options take them: the one place that cuts them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from palpate.mechanics.errors import OptionError


def near(name: str, allowed: Iterable[str], most: int = 1, cutoff: float = 0.6) -> list[str]:
    """Allowed names that were probably meant, nearest first; [] where none is like it.

    Letters in other cases and _ for - are no difference. cutoff: how alike, 0 to 1 (`difflib`).
    """
    import difflib  # only where something was misspelt

    plain: dict[str, str] = {}
    for each in allowed:
        plain.setdefault(_plain(each), each)
    return [plain[each] for each in difflib.get_close_matches(_plain(name), plain, most, cutoff)]


def unknown(name: str, what: str, allowed: Iterable[str], more: str = "", others: Iterable[str] = ()) -> str:
    """'tuch' is no command; did you mean touch? allowed are ...

    more: what else is allowed, in words; others: names of these, which may have been meant too.
    """
    listed = list(allowed)
    meant = near(name, [*listed, *others])
    hint = f" did you mean {meant[0]}?" if meant else ""
    return f"'{name}' is no {what};{hint} allowed are {', '.join(listed)}{more}"


def _plain(name: str) -> str:
    return name.lower().replace("_", "-")


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
