"""Ranges of options: what is allowed, and which way lies less protection."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

from mechanics.errors import OptionError


@dataclass(frozen=True)
class Range:
    """low, high: both allowed. looser: which way from the default protects less; '' where neither does."""

    low: float
    high: float
    looser: Literal["", "higher", "lower"] = ""


def check_ranges(options: Any, ranges: Mapping[str, Range]) -> None:
    """Raise OptionError for the first field outside its range (NaN is outside all); None passes."""
    for name, allowed in ranges.items():
        value = getattr(options, name)
        if value is not None and not allowed.low <= value <= allowed.high:
            raise OptionError(f"{name} is {value}; allowed is {allowed.low:g} to {allowed.high:g}")


def loosened(options: Any, ranges: Mapping[str, Range]) -> tuple[str, ...]:
    """What protects less than its default does, in plain words with the flag that set it."""
    words = []
    for field in fields(options):
        value, default = getattr(options, field.name), field.default
        looser = ranges[field.name].looser if field.name in ranges else ""
        if isinstance(value, bool) or value is None or default is None or not looser:
            continue
        if value > default if looser == "higher" else value < default:
            flag = field.metadata.get("flag") or "--" + field.name.replace("_", "-")
            words.append(f"protection loosened: {flag} is {value:g} (default {default:g})")
    return tuple(words)
