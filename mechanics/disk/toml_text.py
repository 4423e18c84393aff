"""Tables as TOML text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import tomli_w


def dump_toml(table: Mapping[str, Any]) -> str:
    """A mapping of scalars, lists, arrays and nested mappings as TOML text.

    Values that are None are left out, since TOML has no such value. A list of scalars stays on one line.
    """
    return _SPREAD.sub(_on_one_line, tomli_w.dumps(plain(table)))


# tomli_w gives each item a line; a line break cannot be part of a string, so this is always a list's
_SPREAD = re.compile(r"\[\n((?: +[^ \[\]{].*,\n)+) *\]")


def _on_one_line(spread: re.Match[str]) -> str:
    items = spread[1].splitlines()
    return "[" + ", ".join(item.strip().removesuffix(",") for item in items) + "]"


def plain(value: Any) -> Any:
    """The value in Python's own types, for TOML and JSON: arrays and tuples as lists, no key whose value is
    None, other objects by their text."""
    if isinstance(value, Mapping):
        return {str(key): plain(v) for key, v in value.items() if v is not None}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return value.item()
    return value if isinstance(value, bool | int | float) else str(value)
