"""Units in columns' names, and what they are in SI."""

from __future__ import annotations

import re

import numpy as np

from palpate.mechanics.quantities import parse_unit

_SPELT = {
    "time": ("s", "sec", "seconds", "ms", "us", "ns", "min"),
    "position": ("m", "cm", "mm", "um", "nm", "in", "inch"),
    "force": ("N", "mN", "uN", "nN", "kN", "gf", "kgf", "lbf", "newton", "g", "kg"),
}
_SAME = {"sec": "s", "seconds": "s", "inch": "in", "newton": "N", "g": "gf", "kg": "kgf"}
"""Other spellings; a column of force in grams holds the weight of so much."""
SI = {
    kind: {unit: parse_unit(_SAME.get(unit, unit)).scale for unit in units} for kind, units in _SPELT.items()
}
"""Kind of quantity -> unit -> what one is in SI."""
_BRACKETS = re.compile(r"[\[({]\s*([^\])}\d][^\])}]*?)\s*[\])}]\s*(?:#\d+)?$")
_TAIL = re.compile(r"(?:\s*[_/,]\s*|\s+)([A-Za-zµμ]+)$")


_EPOCH_S = (1e9, 2.2e9)
"""Seconds since 1970 from 2001 to 2039."""


def unit_since_1970(t: np.ndarray) -> str | None:
    """The unit of times (n,) that count from 1970 in ms, us or ns; None where they do not."""
    middle = float(np.median(t[np.isfinite(t)])) if np.isfinite(t).any() else 0.0
    low, high = _EPOCH_S
    return next((u for u in ("ms", "us", "ns") if low < middle * SI["time"][u] < high), None)


def plain(unit: str) -> str:
    """A unit in plain letters: either micro sign is u."""
    return unit.strip().replace("µ", "u").replace("μ", "u").replace("\ufffd", "u")


def is_unit(text: str) -> bool:
    """Whether a word is a unit of anything."""
    word = plain(text).lower()
    return word in _OTHER or any(word == unit.lower() for units in SI.values() for unit in units)


_OTHER = ("-", "%", "pa", "kpa", "mpa", "deg", "rad", "nm", "n/mm^2")


def unit_in(name: str, kind: str) -> str | None:
    """The unit of that kind that a column's name ends with: in brackets, after an underscore, space or
    slash."""
    found = _BRACKETS.search(name) or _TAIL.search(name)
    if not found:
        return None
    unit, allowed = plain(found[1]), SI[kind]
    if unit in allowed:
        return unit
    alike = [u for u in allowed if u.lower() == unit.lower()]
    return alike[0] if len(alike) == 1 else None


def without_unit(name: str) -> str:
    """The name without the unit in brackets, or after an underscore, space or slash, that it ends with."""
    bare = _BRACKETS.sub("", name)
    tail = _TAIL.search(bare)
    return bare[: tail.start()] if tail and is_unit(tail[1]) and len(bare) > len(tail[0]) else bare
