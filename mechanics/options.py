"""Options: one frozen dataclass a step; the command line is generated from its fields.

@dataclass(frozen=True) class MeshingOptions:
    mesh_size_m: float = option(0.010, "edge length of the tetrahedra", unit="m", flag="--mesh-size")
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from numbers import Real
from typing import Any

from palpate.mechanics.disk.schema import span
from palpate.mechanics.errors import OptionError
from palpate.mechanics.plausible import POISSON_RATIO, TIP_RADIUS, YOUNG_MODULUS

EXACT = "solve each touched place instead of reading the table (about 10 s of CPU time per place)"
"""Help of `exact`, wherever it is an option."""
_BY_NAME = {
    "mesh_size_m": (5e-4, 0.2),
    "surface_distance_m": (2e-5, 0.05),
    "surface_edge_m": (3e-4, 0.05),
    "surface_spacing_m": (2e-4, 0.1),
    "base_spacing_m": (2e-4, 0.1),
    "indentation_m": (1e-5, 0.1),
    "site_m": (1e-5, 0.1),
    "tip_radius_m": (TIP_RADIUS.low, TIP_RADIUS.high),
    "position_resolution_m": (0.0, 0.01),
    "poisson_ratio": (POISSON_RATIO.low, POISSON_RATIO.high),
    "cutoff_hz": (1.0, 1e4),
    "radius_edge_ratio": (0.7, 100.0),
    "coloured_share": (0.0, 1.0),
    "hold_share": (0.0, 1.0),
    "folds": (2, 1000),
    "bootstraps": (20, 100_000),
    "bootstrap": (10, 100_000),
    "sites": (1, 1000),
    "repeats": (1, 1000),
    "turns": (0.01, 100.0),
    "clutch_button": (-1, 63),
    "scale": (1e-3, 1e3),
    "force_scale": (0.0, 1e2),
}
"""Sane ranges of options that are narrower than their unit's."""
_BY_UNIT = {
    "m": (0.0, 1.0),
    "mm": (0.5, 1000.0),
    "s": (0.0, 86400.0),
    "Hz": (0.1, 1e5),
    "N": (0.0, 1e3),
    "N/m": (0.0, 1e7),
    "N s/m": (0.0, 1e4),
    "N/s": (0.0, 1e6),
    "m/s": (1e-4, 10.0),
    "Pa": (YOUNG_MODULUS.low, YOUNG_MODULUS.high),
    "kg": (0.0, 100.0),
    "deg": (0.0, 90.0),
    "rad": (0.0, math.pi),
    "J": (0.0, 10.0),
    "W": (0.0, 10.0),
    "1": (0.0, math.inf),
}
"""Sane ranges of whatever has that unit: nothing here is negative, and objects are at most 1 m."""
_PLAIN = (0.0, 1e6)


def option(
    default: Any,
    help: str,
    *,
    unit: str = "",
    flag: str | None = None,
    choices: Sequence[str] | None = None,
    low: float | None = None,
    high: float | None = None,
    looser: str = "",
) -> Any:
    """A dataclass field with the words that the command line prints for it.

    `flag` defaults to `flag_of`; `choices` restricts a string. A boolean becomes `--flag/--no-flag`.
    A field whose default is None takes a float unless `choices` is given. `low` and `high`, both allowed,
    default to the sane range of its name or unit (`span_of`); a `high` of inf allows inf. `looser`: 'higher'
    or 'lower' where that way from the default protects a hand less (`loosened`).
    """
    metadata = {
        "help": help, "unit": unit, "flag": flag, "choices": tuple(choices) if choices else None,
        "low": low, "high": high, "looser": looser,
    }  # fmt: skip
    return dataclasses.field(default=default, metadata=metadata)


def flag_of(field: dataclasses.Field[Any]) -> str:
    """The flag that sets an option: its name without the unit, which help shows beside it."""
    if field.metadata["flag"]:
        return field.metadata["flag"]
    unit = field.metadata["unit"].lower().replace("/", " per ").replace(" ", "-").replace("--", "-")
    return ("--" + field.name.replace("_", "-")).removesuffix(f"-{unit}")


def span_of(field: dataclasses.Field[Any]) -> tuple[float, float]:
    """The least and greatest number that an option takes."""
    low, high = _BY_NAME.get(field.name, _BY_UNIT.get(field.metadata["unit"], _PLAIN))
    stated_low, stated_high = field.metadata.get("low"), field.metadata.get("high")
    return low if stated_low is None else stated_low, high if stated_high is None else stated_high


def check_range(field: dataclasses.Field[Any], value: Any, name: str | None = None) -> None:
    """Raise OptionError for a number outside what the option takes; other values pass."""
    if not isinstance(value, Real) or isinstance(value, bool):
        return
    number: Any = value
    low, high = span_of(field)
    if not low <= number <= high:
        unit = field.metadata["unit"]
        words = span(low, high, "" if unit == "1" else unit)
        raise OptionError(f"{name or field.name} is {str(number)[:30]}; allowed are numbers{words}")


def check_ranges(options: Any) -> None:
    """Raise OptionError for the first field of an options dataclass that is outside its range."""
    for field in dataclasses.fields(options):
        if "help" in field.metadata:
            check_range(field, getattr(options, field.name))


class Ranged:
    """Base of options dataclasses that are never outside their ranges (`check_ranges`)."""

    def __post_init__(self) -> None:
        check_ranges(self)


def loosened(options: Any) -> tuple[str, ...]:
    """What protects less than its default does, in plain words with the flag that set it."""
    words = []
    for field in dataclasses.fields(options):
        looser, value = field.metadata.get("looser"), getattr(options, field.name)
        if looser and (value > field.default if looser == "higher" else value < field.default):
            words.append(f"protection loosened: {flag_of(field)} is {value:g} (default {field.default:g})")
    return tuple(words)
