"""Text tables as instruments write them: any separator, decimal comma, lines before the header, a line of
units."""

from __future__ import annotations

import csv
import gzip
import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from palpate.importing.tables import Table, is_unit, without_unit
from palpate.mechanics.errors import RecordingError

_SEPARATORS = ("\t", ";", ",", "|", None)
_LOOK = 400
"""Lines that are looked at to find separator, decimal sign and first row."""
_MISSING = ("", "-", "--", "nan", "na", "n/a", "#n/a", "null", "none", "inf", "-inf")
"""What stands in a cell that holds nothing."""
_THOUSANDS = re.compile(r"[-+]?\d{1,3}(,\d{3})+(\.\d*)?")
_FORTRAN = re.compile(r"[-+]?\d*\.?\d*[dD][-+]?\d+")
_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
_DAY_FIRST = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})[T ](\d{1,2}:\d\d.*)")
_WORD = re.compile(r"[^\W\d_][^,;\t|]*")
"""A cell that is no number may stand in a column of words: a phase, a sample's name, true or false."""
_CLOCK = re.compile(r"(\d{1,3}):(\d\d)(?::(\d\d(?:\.\d+)?))?")


def read(path: Path) -> list[Table]:
    """The one table of a text file: the longest run of rows of numbers, named by the line before it."""
    raw = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
    made = table_of(decoded(raw).splitlines(), path.name)
    if made is None:
        raise RecordingError(f"'{path}' holds no rows of two numbers or more: is it a table?")
    return [made]


def table_of(
    lines: list[str],
    name: str,
    separators: Sequence[str | None] = _SEPARATORS,
    commas: Sequence[bool] = (False, True),
) -> Table | None:
    """The table in the lines of a text, by whichever separator and decimal sign (comma: True) it has most
    numbers; None where it has no two numbers in a row."""
    best: tuple[int, int, str | None, bool] = (0, 0, None, False)
    for separator in separators:
        for comma in commas:
            if comma and separator == ",":
                continue
            start, cells = _run(lines, separator, comma)
            if cells > best[0]:
                best = cells, start, separator, comma
    cells, start, separator, comma = best
    if not cells:
        return None
    width = len(_split(lines[start], separator))
    rows = []
    for line in lines[start:]:
        parts = _split(line, separator)
        if not any(parts) or _remark(line):
            continue
        parts = (parts + [""] * width)[:width]
        rows.append([_number(part, comma) for part in parts])
    values = np.array(rows)
    names = _names(lines, start, separator, width)
    return Table(name, dict(zip(names, values.T, strict=True)))


def decoded(raw: bytes) -> str:
    """The text of a file's bytes, which may be cut anywhere."""
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _split(line: str, separator: str | None) -> list[str]:
    line = line.strip("\r\n")
    if separator is not None and '"' in line:
        return [part.strip() for part in next(csv.reader([line], delimiter=separator), [])]
    return [part.strip().strip('"').strip() for part in line.split(separator)]


def _remark(line: str) -> bool:
    return line.lstrip().startswith(("#", "%"))


def _number(text: str, comma: bool) -> float:
    number = text
    if comma and "," in text:
        number = text.replace(".", "").replace(",", ".")
    elif _THOUSANDS.fullmatch(text):
        number = text.replace(",", "")
    elif _FORTRAN.fullmatch(text):
        number = text.lower().replace("d", "e")
    try:
        return float(number)
    except ValueError:
        return np.nan if text.lower() in _MISSING else seconds_of(text)


def _run(lines: list[str], separator: str | None, comma: bool) -> tuple[int, int]:
    """First line and number of numbers of the longest run of rows among the first lines: two numbers or more
    in each, and words only in columns of words."""
    best, start, length = (0, 0), 0, 0
    held: list[bool | None] = []
    for i, line in enumerate(lines[:_LOOK]):
        parts = _split(line, separator)
        cells = [_is_number(part, comma) for part in parts]
        alike = len(parts) == len(held)
        if length and (_remark(line) or not any(parts) or (alike and all(c is None for c in cells))):
            continue
        words = [part for part, cell in zip(parts, cells, strict=True) if cell is False]
        numbers = cells.count(True)
        fits = numbers > 1 and all(map(_WORD.fullmatch, words))
        alike = alike and all(a is None or b is None or a == b for a, b in zip(held, cells, strict=True))
        if fits and length and alike:
            length += 1
            held = [b if a is None else a for a, b in zip(held, cells, strict=True)]
        else:
            start, length, held = i, int(fits), cells
        if fits and length * numbers > best[1]:
            best = start, length * numbers
    return best


def _is_number(part: str, comma: bool) -> bool | None:
    """Whether a cell is a number; None of one that holds nothing."""
    return None if part.lower() in _MISSING else bool(np.isfinite(_number(part, comma)))


def _names(lines: list[str], start: int, separator: str | None, width: int) -> list[str]:
    """The columns' names, with their units in brackets where a line of units follows them; else their
    numbers."""
    above = [line for line in lines[:start] if any(_split(line, separator))]
    header = _split(above[-1].lstrip("#%"), separator) if above else []
    if len(header) == width and len(above) > 1 and all(not h or is_unit(h.strip("[]()")) for h in header):
        named = _split(above[-2].lstrip("#%"), separator)
        if len(named) == width:
            header = [f"{n} ({u.strip('[]()')})" if u else n for n, u in zip(named, header, strict=True)]
            above.pop()
    if len(header) == width and len(above) > 1 and len({without_unit(h).lower() for h in header}) < width:
        header = _grouped(_split(above[-2].lstrip("#%"), separator), header)
    if len(header) != width or all(re.fullmatch(r"[-+.\d,eE]*", name) for name in header):
        header = [""] * width
    names: list[str] = []
    for k, name in enumerate(header):
        name = name or f"#{k + 1}"
        names.append(name if name not in names else f"{name} #{k + 1}")
    return names


def _grouped(groups: list[str], header: list[str]) -> list[str]:
    """Names that repeat under a line of groups, each behind its group; as they are where there is none."""
    if len(groups) != len(header) or sum(map(bool, groups)) < 2:
        return header
    found, group = [], ""
    for own, name in zip(groups, header, strict=True):
        group = own or group
        found.append(f"{group} ({name})" if is_unit(name) else f"{group} {name}".strip())
    return found


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
