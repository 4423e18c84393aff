"""Times of day and dates as loggers write them, in seconds."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime

_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
_DAY_FIRST = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})[T ](\d{1,2}:\d\d.*)")
_CLOCK = re.compile(r"(\d{1,3}):(\d\d)(?::(\d\d(?:\.\d+)?))?")


def seconds_of(text: str) -> float:
    """s since 1970 of '2026-11-22T13:05:01.25' or '22.11.2026 13:05:01,25', since midnight of '13:05:01.25';
    nan of anything else. Without a zone it is UTC."""
    text = text.strip().replace(",", ".")
    day_first = _DAY_FIRST.fullmatch(text)
    if day_first:
        day, month, year, clock = day_first.groups()
        text = f"{year}-{month:>02}-{day:>02} {clock}"
    if _ISO.match(text):
        try:
            at = datetime.fromisoformat(text)
        except ValueError:
            return math.nan
        return (at if at.tzinfo else at.replace(tzinfo=UTC)).timestamp()
    clock_only = _CLOCK.fullmatch(text)
    if clock_only:
        hours, minutes, seconds = clock_only.groups()
        return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds or 0.0)
    return math.nan
