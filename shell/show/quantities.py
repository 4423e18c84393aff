"""What pages colour an object by: the name, the unit that people read, and one colour map for each."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from palpate.mechanics.quantities import prefixed


@dataclass(frozen=True)
class ShownQuantity:
    """name: in words; unit: that people read, '' for a count; scale: to it from SI; colour_map: its own.
    least_share: of the middle value, that the colours span at least, so that 2 % look like 2 %."""

    name: str
    unit: str
    scale: float
    colour_map: str

    least_share: float = 0.0

    def limits(self, low: float, high: float) -> tuple[float, float]:
        """Of its colours: from 0 where that is its least, and no narrower than a share of the middle."""
        if self in FROM_ZERO:
            return 0.0, max(high, 1e-12)
        middle, half = (
            0.5 * (low + high),
            max(0.5 * (high - low), 0.5 * self.least_share * 0.5 * (low + high)),
        )
        return middle - half, middle + half

    @property
    def label(self) -> str:
        """Of an axis or a bar: 'depth [mm]'."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


ORDER = ShownQuantity("first touches, in order", "", 1.0, "plasma")
DEPTH = ShownQuantity("greatest depth", "mm", 1e3, "YlGnBu")
ERROR = ShownQuantity("force error", "mN", 1e3, "YlOrRd")
AS_RECORDED, FITTED = (f"{ERROR.name}, first touches {how}" for how in ("as recorded", "fitted"))
"""Of one press the two may be 96 and 20 mN: what a first touch that was found late costs is in the first."""
STIFFNESS = ShownQuantity("own stiffness", "N/m", 1.0, "viridis")
KELVIN_VOIGT = ShownQuantity("stiffness k_V of a press", "N/m", 1.0, "viridis")
MODULUS = ShownQuantity("modulus", "kPa", 1e-3, "cividis", least_share=0.5)
UNCERTAINTY = ShownQuantity("shape uncertainty", "mm", 1e3, "Purples")
FROM_ZERO = (ERROR, UNCERTAINTY, DEPTH)
"""Whose colours begin at nothing."""

_SOFTNESS = (
    (2e3, "fat tissue or a soft jelly"),
    (8e3, "liver"),
    (20e3, "relaxed muscle"),
    (60e3, "a very soft silicone, or tensed muscle"),
    (300e3, "a soft rubber"),
    (10e6, "a firm rubber"),
    (float("inf"), "a hard plastic, or stiffer"),
)
"""Up to a modulus, Pa: what is about as soft. Orders of magnitude of elastography and of data sheets."""


def softness(modulus_pa: float) -> str:
    """What is about as soft as a Young's modulus, Pa."""
    return next(words for limit, words in _SOFTNESS if modulus_pa <= limit)


_UNIT = re.compile(r"^(.*)\[(m|m/s|N|N/m|Pa|s)\]$")
_NOTHING = 1e-9


def readable(label: str, values: Sequence[float]) -> tuple[str, list[float]]:
    """SI values as people read them, and their label so: 'speed [m/s]' of 0.04 is 'speed [mm/s]' of 40."""
    found = _UNIT.match(label)
    if not found:
        return label, list(values)
    most = max((abs(v) for v in values if abs(v) > _NOTHING), default=1.0)
    unit, scale = prefixed(found[2], most)
    return f"{found[1]}[{unit}]", [0.0 if abs(v) <= _NOTHING else scale * v for v in values]
