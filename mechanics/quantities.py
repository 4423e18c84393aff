"""A unit in words, "Pa/m" or "m^2/s", as powers of metres, newtons and seconds, and as people read it.

`Key.unit`, `option(unit=...)` and `Parameter.unit` state units in one spelling: a space multiplies, one slash
divides, ^ raises, "1" has no dimension, "ln s" is a logarithm. A key's name ends with its unit
(`work_j_per_m2`). What is plausible of a quantity stands in `mechanics.plausible`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any, NamedTuple

from palpate.mechanics.errors import OptionError


class Unit(NamedTuple):
    """scale: what one is in SI; then its powers of metres, newtons and seconds (kg = N s^2/m)."""

    scale: float
    length: int
    force: int
    time: int

    def factor(self, length: float, force: float, time: float) -> float:
        """By how much a quantity grows where lengths, forces and times grow by these factors."""
        return length**self.length * force**self.force * time**self.time


_BASE = {
    "1": Unit(1.0, 0, 0, 0),
    "bytes": Unit(1.0, 0, 0, 0),
    "GB": Unit(1e9, 0, 0, 0),
    "rad": Unit(1.0, 0, 0, 0),
    "deg": Unit(math.pi / 180, 0, 0, 0),
    "m": Unit(1.0, 1, 0, 0),
    "in": Unit(0.0254, 1, 0, 0),
    "N": Unit(1.0, 0, 1, 0),
    "gf": Unit(9.80665e-3, 0, 1, 0),
    "lbf": Unit(4.4482216, 0, 1, 0),
    "s": Unit(1.0, 0, 0, 1),
    "min": Unit(60.0, 0, 0, 1),
    "Hz": Unit(1.0, 0, 0, -1),
    "Pa": Unit(1.0, -2, 1, 0),
    "J": Unit(1.0, 1, 1, 0),
    "W": Unit(1.0, 1, 1, -1),
    "g": Unit(1e-3, -1, 1, 2),
}
_PREFIXES = {"M": 1e6, "k": 1e3, "c": 1e-2, "m": 1e-3, "u": 1e-6, "n": 1e-9}
_FACTOR = re.compile(r"([A-Za-z]+|1)(?:\^(-?\d+))?")
_READ = {
    "m": "mm", "s": "ms", "N": "mN", "Pa": "kPa", "kg": "g", "rad": "deg", "m/s": "mm/s", "N/s": "mN/s",
    "N/m": "N/mm", "Pa/m": "kPa/mm", "m^2/s": "mm^2/s",
}  # fmt: skip
"""SI unit -> the one that people read of small soft objects; others are read as they are."""


@lru_cache(maxsize=256)
def parse_unit(unit: str) -> Unit:
    """What a unit is; raises OptionError for one that is unknown or has no fixed dimension ('N/m^r', 'ln s').

    'N s/m' is newtons times seconds over metres; all behind the slash divides.
    """
    above, slash, below = unit.partition("/")
    whole = _product(unit, above.split(), 1.0, 0, 0, 0, 1)
    return _product(unit, below.split(), *whole, -1) if slash else whole


def _product(
    unit: str, factors: Iterable[str], scale: float, length: int, force: int, time: int, sign: int
) -> Unit:
    """A product of units to the power `sign`, times what is there."""
    for each in factors or ["?"]:
        found = _FACTOR.fullmatch(each)
        one = _symbol(found[1]) if found else None
        if found is None or one is None:
            raise OptionError(
                f"'{unit}' is no unit of fixed dimension: allowed are products of {', '.join(_BASE)}, with "
                f"the prefixes {', '.join(_PREFIXES)}, whole powers (m^2) and one slash"
            )
        power = sign * int(found[2] or 1)
        scale *= one.scale**power
        length += power * one.length
        force += power * one.force
        time += power * one.time
    return Unit(scale, length, force, time)


def _symbol(symbol: str) -> Unit | None:
    if symbol in _BASE:
        return _BASE[symbol]
    prefix, base = _PREFIXES.get(symbol[0]), _BASE.get(symbol[1:])
    if prefix is None or base is None or symbol[1:] in ("1", "bytes", "rad", "deg", "in", "lbf", "min"):
        return None
    return base._replace(scale=prefix * base.scale)


_OF_NAMES = {
    each.lower(): each
    for each in ("m", "mm", "s", "ms", "N", "Pa", "Hz", "J", "W", "kg", "rad", "deg", "bytes")
}


def split_key(name: str) -> tuple[str, str]:
    """(name, unit) of a key whose name ends with its unit: ('work', 'J/m^2') of 'work_j_per_m2'; unit '1'
    where it ends with none."""
    words = name.split("_")
    for first in range(1, len(words)):
        above, per, below = " ".join(words[first:]).partition(" per ")
        parts = [_powers(above), *([_powers(below)] if per else [])]
        if all(parts):
            return "_".join(words[:first]), "/".join(parts)
    return name, "1"


def unit_of_key(name: str) -> str:
    """The unit that a key's name ends with; '1' where it ends with none."""
    return split_key(name)[1]


def _powers(words: str) -> str:
    """'N s' of 'n s', 'm^2' of 'm2'; '' where one of the words is no unit."""
    out = []
    for word in words.split():
        found = re.fullmatch(r"([a-z]+)(\d?)", word)
        if found is None or found[1] not in _OF_NAMES:
            return ""
        out.append(_OF_NAMES[found[1]] + (f"^{found[2]}" if found[2] else ""))
    return " ".join(out)


def read_unit(unit: str) -> tuple[str, float]:
    """(unit that people read, factor to it from the SI `unit`): ('N/mm', 1e-3) of 'N/m', ('', 1) of '1'."""
    if unit in ("", "1"):
        return "", 1.0
    shown = _READ.get(unit, unit)
    scale = 1.0 if shown == unit else parse_unit(unit).scale / parse_unit(shown).scale
    return shown.replace("^2", "²").replace("deg", "degrees"), scale


MOST_NUMBERS = 12
"""Of a list that are written out; of longer ones the least and the greatest."""


def number_words(value: Any, factor: float = 1.0) -> str:
    """A value, or a list of values, times `factor`, to three digits: '0.35', '(1, 2, 3)', 'yes'."""
    if isinstance(value, list | tuple) and len(value) == 1:
        return number_words(value[0], factor)
    if isinstance(value, list | tuple) and len(value) > MOST_NUMBERS and not isinstance(value[0], list):
        return (
            f"{number_words(min(value), factor)} to {number_words(max(value), factor)} ({len(value)} values)"
        )
    if isinstance(value, list | tuple):
        return "(" + ", ".join(number_words(v, factor) for v in value) + ")"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, (int, float)):
        return str(value)
    scaled = value * factor
    if abs(scaled) >= 100 or abs(scaled) < 1e-5:
        return f"{scaled:.0f}"
    return f"{scaled:.2g}" if abs(scaled) < 1 else f"{scaled:.3g}"


_LARGER = {"ms": ("s", 1e-3), "mN": ("N", 1e-3), "kPa": ("MPa", 1e-3), "g": ("kg", 1e-3), "mm": ("m", 1e-3)}


def fitting_unit(key: str, value: Any) -> tuple[str, float]:
    """(unit, factor to it from SI) in which people write this value of a key: seconds of 20 s, ms of 0.02."""
    unit, factor = read_unit(unit_of_key(key))
    numbers = [abs(v) for v in (value if isinstance(value, list | tuple) else [value]) if _is_number(v)]
    if unit in _LARGER and max(numbers, default=0.0) * factor >= 1000:
        unit, more = _LARGER[unit]
        factor *= more
    return unit, factor


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def quantity_words(key: str, value: Any) -> str:
    """A value as people write it, with the unit that its key ends with: '68 N/mm' of stiffness_n_per_m."""
    unit, factor = fitting_unit(key, value)
    return f"{number_words(value, factor)} {unit}".strip()


def prefixed(unit: str, greatest: float) -> tuple[str, float]:
    """(unit, factor to it) in which numbers of that SI unit, at most `greatest`, read well: kPa of pascals,
    thousandths of what is below 1."""
    prefix = "k" if unit == "Pa" else "m" if greatest < 1.0 else ""
    return prefix + unit, 1 / _PREFIXES[prefix] if prefix else 1.0
