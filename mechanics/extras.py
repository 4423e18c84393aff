"""How to install what an extra needs, in words that hold for a clone and for an index alike: its libraries by
name, as the installed package states them."""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, requires


def libraries(extra: str) -> tuple[str, ...]:
    """Requirements of an extra, as "h5py>=3.8"; empty where the program is not installed or has no such."""
    try:
        stated = requires("palpate") or ()
    except PackageNotFoundError:
        return ()
    return tuple(
        line.partition(";")[0].strip()
        for line in stated
        if re.search(rf"extra\s*==\s*['\"]{extra}['\"]", line)
    )


def install_words(extra: str, module: str | None = None) -> str:
    """The pip command. module: that is missing, as an import names it; None, or one that the extra does not
    name: all of the extra."""
    wanted = libraries(extra)
    top = _plain((module or "").partition(".")[0])
    named = [line for line in wanted if _plain(re.split(r"[^\w.-]", line, maxsplit=1)[0]) == top]
    lines = named or wanted or ((module or extra),)
    return "pip install " + " ".join(f"'{line}'" for line in lines)


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "_", name).lower()
