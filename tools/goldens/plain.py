"""What is written of a text, a table, a page: without what differs from run to run, and short."""

from __future__ import annotations

import gzip
import hashlib
import json
import math
import re
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np

LONG = 24
"""Numbers of a list, above which it is written in short."""
TIMES = ("seconds",)
"""Keys of JSON that say how long something took."""
BITS = "bits"
"""The key under which hashes of exact bytes stand."""
_DATE = re.compile(r"\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:\d\d)?)?")
_HASH = re.compile(r"\b(?=[0-9a-f]*[a-f])(?=[0-9a-f]*\d)(?:[0-9a-f]{64}|[0-9a-f]{12})\b")
_BLOB = re.compile(r"data:[\w/+.;-]+,[\w+/=%.-]{40,}")
_LONGEST = 400
"""Characters of an attribute or a line, above which it is a blob."""
_VOID = {"area", "base", "br", "col", "hr", "img", "input", "link", "meta", "source", "wbr"}
_PICTURES = ("svg", "script", "style", "canvas")


def digest(data: bytes | str) -> str:
    """Sixteen digits that stand for exact bytes."""
    return hashlib.sha256(data.encode() if isinstance(data, str) else data).hexdigest()[:16]


WAIT = re.compile(r"^.* \.\.\.\n", re.MULTILINE)
"""What a long wait says of itself (mechanics.progress): how often depends on the machine."""


class Plain:
    """Texts without the places and versions of one machine. places: {text: what stands for it}."""

    def __init__(self, places: Mapping[str, str], version: str) -> None:
        self.places = sorted(
            (each for each in places.items() if len(each[0]) > 1), key=lambda each: -len(each[0])
        )
        self.version = re.compile(rf"(?<![\d.]){re.escape(version)}(?![\d.]*\d)")

    def text(self, text: str) -> str:
        """One text."""
        for place, name in self.places:
            text = text.replace(place, name)
        text = self.version.sub("VERSION", text)
        return _HASH.sub("HASH", _DATE.sub("DATE", text))

    def lines(self, text: str) -> list[str]:
        """Line by line."""
        return [line.rstrip() for line in self.text(text).splitlines()]

    def tree(self, value: Any) -> Any:
        """JSON: texts plain, long lists of numbers in short."""
        if isinstance(value, str):
            return self.text(value)
        if isinstance(value, dict):
            return {self.text(k): "TIME" if k in TIMES else self.tree(v) for k, v in value.items()}
        if isinstance(value, list):
            numbers = _numbers(value)
            if numbers is not None and len(numbers) > LONG:
                return short(numbers)
            return [self.tree(v) for v in value]
        return value

    def file(self, path: Path) -> dict[str, Any]:
        """A file in short: JSON and pages whole, columns of a table, else how it begins."""
        data = path.read_bytes()
        name = path.name.removesuffix(".gz")
        data = gzip.decompress(data) if path.suffix == ".gz" else data
        if data[:8] == b"\x89PNG\r\n\x1a\n":
            return {"picture": blob("picture", data)}
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            return {"bytes": len(data), BITS: digest(data)}
        if name.endswith(".json"):
            return {"json": self.tree(json.loads(text))}
        if name.endswith(".html"):
            return {"page": self.page(text)}
        if name.endswith(".csv"):
            table = _table(text)
            if table is not None:
                return table | {BITS: digest(data)}
        lines = self.lines(text)
        begin = [x if len(x) < _LONGEST else blob("line", x) for x in lines[:40]]
        return {"lines": len(lines), "begin": begin, BITS: digest("\n".join(lines))}

    def page(self, text: str) -> list[str]:
        """An HTML page: tags and words line by line, pictures and scripts as blobs."""
        reader = _Page(self)
        reader.feed(text)
        reader.close()
        return [self.text(line) for line in reader.lines]


def blob(kind: str, data: bytes | str) -> str:
    """'[picture 1234 bytes 0123456789abcdef]'."""
    return f"[{kind} {len(data)} bytes {digest(data)}]"


def short(values: list[Any]) -> dict[str, Any]:
    """Many numbers: how many, their rms, some, and what stands for their bytes."""
    flat = np.array([float("nan") if v is None else float(v) for v in values])
    rms = float(np.sqrt(np.nanmean(flat**2))) if np.isfinite(flat).any() else None
    some = [None if math.isnan(v) else v for v in flat[:: max(len(flat) // 12, 1)].tolist()]
    return {"numbers": len(flat), "rms": rms, "some": some, BITS: digest(flat.tobytes())}


def _numbers(value: Any) -> list[Any] | None:
    """A nested list of numbers as a flat one; None where anything else is in it."""
    if value is None or (isinstance(value, (int, float)) and not isinstance(value, bool)):
        return [value]
    if not isinstance(value, list):
        return None
    out = []
    for each in value:
        found = _numbers(each)
        if found is None:
            return None
        out += found
    return out


def _table(text: str) -> dict[str, Any] | None:
    """Columns of a CSV of many rows of numbers; None for another."""
    header, _, rest = text.partition("\n")
    rows = rest.splitlines()
    if len(rows) <= LONG:
        return None
    try:
        values = np.array([[float(x or "nan") for x in row.split(",")] for row in rows])
    except ValueError:
        return None
    return {"rows": len(values), "columns": dict(zip(header.split(","), map(_column, values.T), strict=True))}


def _column(values: np.ndarray) -> dict[str, Any]:
    made = short(values.tolist())
    return {"rms": made["rms"], "some": made["some"]}


class _Page(HTMLParser):
    def __init__(self, plain: Plain) -> None:
        super().__init__()
        self.plain = plain
        self.lines: list[str] = []
        self.depth = 0
        self.inside: list[str] = []
        self.held: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if self.inside or tag in _PICTURES:
            self.held.append(self.get_starttag_text() or "")
            if tag in _PICTURES and not (self.get_starttag_text() or "").endswith("/>"):
                self.inside.append(tag)
            return
        said = "".join(f' {k}="{_attribute(v)}"' for k, v in sorted(attrs))
        self.lines.append(" " * self.depth + f"<{tag}{said}>")
        if tag not in _VOID:
            self.depth += 1

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if self.inside:
            self.held.append(self.get_starttag_text() or "")
        else:
            self.handle_starttag(tag, attrs)
            self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        if self.inside:
            if tag == self.inside[-1]:
                self.inside.pop()
            if not self.inside:
                self.lines.append(" " * self.depth + self._held(tag))
                self.held = []
        elif tag not in _VOID:
            self.depth = max(self.depth - 1, 0)

    def _held(self, tag: str) -> str:
        """A picture, a script or a script's data as a blob."""
        try:
            data = self.plain.tree(json.loads("".join(self.held[1:])))
        except ValueError:
            return blob(tag, "".join(self.held))
        return blob("data", json.dumps(data))

    def handle_data(self, data: str) -> None:
        if self.inside:
            self.held.append(data)
        elif words := " ".join(data.split()):
            self.lines.append(" " * self.depth + (words if len(words) < 4000 else blob("text", words)))


def _attribute(value: str | None) -> str:
    said = _BLOB.sub(lambda found: blob("picture", found[0]), " ".join((value or "").split()))
    return said if len(said) < _LONGEST else blob("value", said)
