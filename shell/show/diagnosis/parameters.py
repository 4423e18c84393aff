"""Parameters of effects in words, with units that a hand knows."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.quantities import fitting_unit, quantity_words, split_key
from palpate.mechanics.quantities import number_words as number
from palpate.words import signed, spaced

WORDS = {
    "mu": "friction coefficient",
    "g": "extra force right after a fast press, shares of the lasting force",
    "tau_s": "that extra force fades within",
    "share": "extra force right after a fast press, share of the lasting force",
    "exponent": "it fades by this power of time",
    "diffusivity_m2_per_s": "fluid drains at",
    "work_j_per_m2": "work to separate the surfaces",
    "healed": "share of it that pulls on first touch",
    "c20_over_c10": "stiffening (c20 over c10; below 0 it softens)",
    "r": "softening on repeats (r; smaller is more)",
    "m_rel": "width of the softening (m, of the greatest load)",
    "matrix": "reading per true force, 3 x 3",
    "tip_radius_m": "radius of the tip",
    "young_modulus_pa": "Young's modulus",
    "poisson_ratio": "Poisson's ratio",
    "centre_m": "middle at",
    "radius_m": "radius",
    "modulus_ratio": "stiffness relative to the rest, times",
    "thickness_m": "thickness",
    "ratio_base": "stiffness at the base, times the mean",
    "ratio_top": "stiffness at the top, times the mean",
    "k_normal_pa_per_m": "support's stiffness, pressed",
    "k_tangential_pa_per_m": "support's stiffness, sideways",
    "bonded_fraction": "share of the base that holds",
    "direction": "the loose part lies towards",
    "pull_off_n": "greatest pull",
    "range_m": "felt up to this distance",
    "inside": "share of it that holds within the contact too",
    "stiffness_n_per_m": "the tool's stiffness",
    "bias_n": "reading in free air, x y z",
    "rate_n_per_s": "zero drifts by, x y z",
    "mass_kg": "mass beyond the sensor",
    "delay_s": "force reads late by",
    "width_m": "width of the play",
    "shift_m": "shift, x y z",
    "rotation_rad": "turn, x y z",
}

_SEVERAL = ("g", "tau_s")
"""Keys whose lists hold one number for each of several processes."""


def plain_key(key: str, value: Any = None) -> tuple[str, float, str]:
    """(words, factor from SI, unit) of a parameter's key, in units that a hand knows; value: what the unit is
    to fit."""
    unit, factor = fitting_unit(key, value)
    return WORDS.get(key, spaced(split_key(key)[0])), factor, unit


def short(parameters: Mapping[str, Any], words: Mapping[str, str] = MappingProxyType({})) -> str:
    """Parameters in one line. words: of keys that are called something else here."""
    said = []
    for key, value in parameters.items():
        name, sign = signed(words.get(key) or plain_key(key)[0], value)
        said.append(f"{name} {quantity_words(key, value if sign > 0 else -value)}")
    return ", ".join(said)


def parameter_rows(result: Diagnosis) -> list[list[str]]:
    """Effect, quantity, value, 95 % interval and unit of what was named."""
    rows = []
    for entry in result.entries:
        for key, value in entry.parameters.items() if entry.name in result.effects else ():
            words, factor, unit = plain_key(key, value)
            low, high = entry.intervals.get(key, (None, None))
            words, sign = signed(words, value)
            if sign < 0:
                value, low, high = -value, None if high is None else -high, None if low is None else -low
            for k, (one, least, most) in enumerate(_each(key, value, low, high)):
                span = "-" if least is None else f"{number(least, factor)} to {number(most, factor)}"
                said = f"{words} ({_ORDINALS[k]})" if one is not value else words
                rows.append([spaced(entry.name), said, number(one, factor), span, unit])
    return rows


_ORDINALS = ("first", "second", "third")


def _each(key: str, value: Any, low: Any, high: Any) -> list[tuple[Any, Any, Any]]:
    """The numbers of a list with their intervals, one by one; whole what belongs together, as x, y, z do."""
    apart = key in _SEVERAL and isinstance(value, list | tuple) and 1 < len(value) <= len(_ORDINALS)
    if not apart:
        return [(value, low, high)]
    nothing = [None] * len(value)
    return list(zip(value, nothing if low is None else low, nothing if high is None else high, strict=True))
