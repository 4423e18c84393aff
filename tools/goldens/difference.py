"""Two written cases beside one another: what differs, number by number and word by word."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from tools.goldens.plain import BITS

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w])")
_BLOB = re.compile(r"\[(\w+) \d+ bytes [0-9a-f]{16}\]")


@dataclass(frozen=True)
class Tolerance:
    """rel, abs: of a number. digit: of a number in a text one unit of its last digit is nothing. bits: exact
    bytes count. near: {key: relative} of a case that is not the same twice: these keys of its JSON are
    compared so, all other numbers not at all."""

    rel: float = 1e-6
    abs: float = 1e-9
    digit: bool = False
    bits: bool = False
    near: Mapping[str, float] = field(default_factory=dict)

    def alike(self, a: float, b: float, rel: float | None = None) -> bool:
        """Whether two numbers are the same."""
        if math.isnan(a) or math.isnan(b):
            return math.isnan(a) and math.isnan(b)
        return math.isclose(a, b, rel_tol=self.rel if rel is None else rel, abs_tol=self.abs)


def differences(old: Any, new: Any, t: Tolerance, at: str = "") -> Iterator[str]:
    """Lines that say where two records differ."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted({*old, *new}):
            if key == BITS and (not t.bits or t.near):
                continue
            place = f"{at}.{key}" if at else key
            if key not in old or key not in new:
                yield f"{place}: {'gone' if key in old else 'new'}: {_brief(old.get(key, new.get(key)))}"
            else:
                yield from differences(old[key], new[key], t, place)
    elif isinstance(old, list) and isinstance(new, list):
        yield from _lists(old, new, t, at)
    elif isinstance(old, str) and isinstance(new, str):
        if not same_text(old, new, t):
            yield from (f"{at}:", f"  - {old}", f"  + {new}")
    elif _number(old) and _number(new):
        key = at.rpartition(".")[2].partition("[")[0]
        if t.near and key not in t.near:
            return
        if not t.alike(old, new, t.near.get(key)):
            yield f"{at}: {old!r} -> {new!r}"
    elif old != new and not (t.near and _loose(old) and _loose(new)):
        yield f"{at}: {_brief(old)} -> {_brief(new)}"


def _lists(old: list[Any], new: list[Any], t: Tolerance, at: str) -> Iterator[str]:
    if len(old) == len(new):
        for k, (a, b) in enumerate(zip(old, new, strict=True)):
            yield from differences(a, b, t, f"{at}[{k}]")
    elif all(isinstance(x, str) for x in (*old, *new)):
        yield f"{at}: {len(old)} -> {len(new)} lines"
        a, b = ([_NUMBER.sub("#", _BLOB.sub(r"[\1]", x)) for x in side] for side in (old, new))
        yield from (f"  {x}" for x in list(difflib.unified_diff(a, b, lineterm="", n=0))[2:])
    elif not t.near:
        yield f"{at}: {len(old)} -> {len(new)} entries"


def same_text(old: str, new: str, t: Tolerance) -> bool:
    """Whether two texts have the same words, and the same numbers to a tolerance."""
    if old == new:
        return True
    if t.near:
        old, new = (_BLOB.sub(r"[\1]", x) for x in (old, new))
    words = _NUMBER.split(old), _NUMBER.split(new)
    if words[0] != words[1]:
        return False
    pairs = zip(_NUMBER.findall(old), _NUMBER.findall(new), strict=True)
    return bool(t.near) or all(_same_number(a, b, t) for a, b in pairs)


def _same_number(a: str, b: str, t: Tolerance) -> bool:
    if a == b or t.alike(float(a), float(b)):
        return True
    return t.digit and abs(float(a) - float(b)) <= 1.01 * max(_unit(a), _unit(b))


def _unit(number: str) -> float:
    """What one unit of a written number's last digit is."""
    digits, _, power = number.lower().partition("e")
    return 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))


def _number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _loose(value: Any) -> bool:
    return value is None or _number(value)


def _brief(value: Any) -> str:
    said = repr(value)
    return said if len(said) < 100 else said[:97] + "..."


def words_alone(value: Any) -> Any:
    """A record as it is committed: words, keys, numbers to three digits; pictures and exact bytes left
    out."""
    if isinstance(value, dict):
        return {k: words_alone(v) for k, v in value.items() if k != BITS}
    if isinstance(value, list):
        return [words_alone(v) for v in value]
    if isinstance(value, str):
        return _BLOB.sub(r"[\1]", value)
    if isinstance(value, float) and math.isfinite(value):
        return float(f"{value:.3g}")
    return value
