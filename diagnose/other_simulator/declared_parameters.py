"""What a simulator was given, and our law at that: the reference that its numerics are held against."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from palpate.diagnosis.forward.prediction import Forward
from palpate.mechanics.compliance.far_field import far_at_poisson
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.friction_slip import EFFECT as SLIP
from palpate.mechanics.effects.settings import STICKS, ForwardSettings
from palpate.mechanics.effects.tip_radius import EFFECT as TIP
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.names import number, pairs
from palpate.mechanics.plausible import POISSON_RATIO, TIP_RADIUS, YOUNG_MODULUS

_FRICTION = FileKey(low=0.0, high=100.0, unknown=True)
KEYS: dict[str, FileKey] = {
    "young_modulus_pa": YOUNG_MODULUS,
    "poisson_ratio": POISSON_RATIO,
    "friction": _FRICTION,
    "tip_radius_m": TIP_RADIUS,
}
ALIASES = {
    "modulus": "young_modulus_pa",
    "young_modulus": "young_modulus_pa",
    "young": "young_modulus_pa",
    "e": "young_modulus_pa",
    "nu": "poisson_ratio",
    "poisson": "poisson_ratio",
    "mu": "friction",
    TIP.name: "tip_radius_m",
}


@dataclass(frozen=True)
class Stated:
    """young_modulus_pa, poisson_ratio, friction (inf: the tip sticks), tip_radius_m of a simulation. given:
    the names of those that were said; the others are the model's."""

    young_modulus_pa: float
    poisson_ratio: float
    friction: float
    tip_radius_m: float
    given: frozenset[str] = frozenset()

    def but(self, name: str, value: float) -> Stated:
        """The same with one value changed."""
        other: dict[str, Any] = {name: value}
        return dataclasses.replace(self, **other)

    def as_json(self) -> dict[str, float | None]:
        """By name; null for the friction of a tip that sticks."""
        values = {name: getattr(self, name) for name in KEYS}
        return {name: value if math.isfinite(value) else None for name, value in values.items()}


def stated_values(said: Iterable[str] | Mapping[str, Any] | None) -> dict[str, float]:
    """{field of Stated: value} of KEY=VALUE words, or a mapping. Raises OptionError for what is not known."""
    flag = "--stated"
    values: dict[str, float] = {}
    for key, value in pairs(said, flag, "modulus=30000"):
        name = ALIASES.get(key.lower(), key.lower())
        if name not in KEYS:
            raise OptionError(f"--stated {key}: not known; allowed are {', '.join(KEYS)}")
        if name in values:
            raise OptionError(f"--stated says {name} twice: say it once")
        values[name] = number(flag, key, value)
        if math.isnan(values[name]) or not KEYS[name].takes(values[name]):
            raise OptionError(f"--stated {key}={value}: it must be {KEYS[name].words}")
    return values


def stated_of(said: Iterable[str] | Mapping[str, Any] | None, model: Model) -> Stated:
    """`stated_values` over the model's. Raises OptionError for what is not known."""
    values: dict[str, Any] = stated_values(said)
    slip = model.effects.get(SLIP.name, {})
    usual = Stated(
        model.material.young_modulus_pa,
        model.material.poisson_ratio,
        float(slip.get("mu", STICKS)),
        model.tool.tip_radius_m,
    )
    return dataclasses.replace(usual, **values, given=frozenset(values))


@dataclass
class StatedForward(Forward):
    """The forward model of a simulation: its ideal is what the simulator was given, whatever a fit would take
    for the modulus, so that what differs from it is the simulator's own."""

    measured: ClassVar[bool] = False
    stated: Stated = field(default_factory=lambda: Stated(1.0, 0.49, STICKS, 1.0))

    def ideal(self, modulus: float) -> ForwardSettings:
        """Settings of the ideal model at the stated parameters; `modulus` does not count."""
        given = self.stated
        settings = super().ideal(given.young_modulus_pa)
        if given.poisson_ratio != settings.nu:
            settings.nu = given.poisson_ratio
            settings.far = far_at_poisson(self.places, given.poisson_ratio)
        settings.touch.friction = given.friction
        settings.touch.tip_ratio = given.tip_radius_m / self.tip_radius
        # a larger tip on the same path meets the surface earlier
        settings.onset = settings.onset + (given.tip_radius_m - self.tip_radius)
        return settings
