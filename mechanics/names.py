"""A name that nobody has: which was probably meant, and which are allowed. The one place that guesses."""

from __future__ import annotations

from collections.abc import Iterable


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
