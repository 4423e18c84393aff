"""What an object is made of, in typed parts. No mesh: what elements make of it stands in
mechanics.model.moduli."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.mechanics.contact.dent import dent_laws
from palpate.mechanics.disk.schema import Key, Schema
from palpate.mechanics.errors import ModelError
from palpate.mechanics.quantities import POISSON_RATIO

UNKNOWN = (float("nan"), float("nan"))
"""An interval that nobody estimated."""

LENGTH = Key(low=1e-5, high=1.0, unit="m", required=True)
RATIO = Key(low=1e-3, high=1e3, required=True)
PLACE = Key(low=-10.0, high=10.0, size=3, unit="m", required=True)
BALL: Schema = {"centre_m": PLACE, "radius_m": LENGTH, "modulus_ratio": RATIO}
GRADIENT: Schema = {"ratio_base": RATIO, "ratio_top": RATIO}
SKIN: Schema = {"thickness_m": LENGTH, "modulus_ratio": RATIO}


@dataclass(frozen=True)
class Ball:
    """A sphere in an object: centre (3,) m in the mesh's frame, radius m, modulus over the object's.

    Raises ModelError for a place that is not finite, or a size or ratio that is not above 0.
    """

    centre_m: tuple[float, float, float]
    radius_m: float
    modulus_ratio: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_m", tuple(finite("centre_m", self.centre_m, (3,)).tolist()))
        for name in ("radius_m", "modulus_ratio"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))


@dataclass(frozen=True)
class Gradient:
    """Modulus over the object's, linear along the support's normal from the support to the highest node."""

    ratio_base: float
    ratio_top: float

    def __post_init__(self) -> None:
        for name in ("ratio_base", "ratio_top"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))


@dataclass(frozen=True)
class Skin:
    """A layer under the touchable surface: thickness m, modulus over that of what lies within."""

    thickness_m: float
    modulus_ratio: float

    def __post_init__(self) -> None:
        for name in ("thickness_m", "modulus_ratio"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))


@dataclass(frozen=True, eq=False)
class Material:
    """SI units. Every ratio is a modulus over the global one; parts that overlap multiply.

    young_modulus_pa: the global modulus e of eq. (13), of what is no part of its own; young_modulus_ci95_pa:
    its 95 % interval, nan where unknown. dent_law: by its name in mechanics.contact.dent. inclusions: by
    name. field: (m,) ratio of each tetrahedron where it is given as numbers, or None. Raises ModelError for
    what is no number or out of range.
    """

    young_modulus_pa: float
    poisson_ratio: float
    young_modulus_ci95_pa: tuple[float, float] = UNKNOWN
    dent_law: str = "linear"
    inclusions: Mapping[str, Ball] = field(default_factory=dict)
    gradient: Gradient | None = None
    skin: Skin | None = None
    field: np.ndarray | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "young_modulus_pa", positive("young_modulus_pa", self.young_modulus_pa))
        nu = float(finite("poisson_ratio", self.poisson_ratio))
        if not POISSON_RATIO.takes(nu):
            raise ModelError(f"poisson_ratio is {nu:g}; it must be {POISSON_RATIO.words}")
        put(self, "poisson_ratio", nu)
        low, high = numbers("young_modulus_ci95_pa", self.young_modulus_ci95_pa, (2,)).tolist()
        if low > high or min(low, high) < 0:
            raise ModelError(f"young_modulus_ci95_pa is [{low:g}, {high:g}]; allowed is 0 <= low <= high")
        put(self, "young_modulus_ci95_pa", (low, high))
        if self.dent_law not in dent_laws():
            raise ModelError(f"dent_law is '{self.dent_law}'; allowed are {', '.join(dent_laws())}")
        put(self, "inclusions", dict(self.inclusions))
        if self.field is not None:
            ratio = np.array(self.field, dtype=float)
            if ratio.ndim != 1 or not (np.isfinite(ratio) & (ratio > 0)).all():
                raise ModelError(f"field {ratio.shape} needs one positive finite value a tetrahedron")
            ratio.setflags(write=False)
            put(self, "field", ratio)


def numbers(name: str, value: Any, shape: tuple[int, ...] = ()) -> np.ndarray:
    """`value` as floats of that shape; raises ModelError where it is none."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        array = None
    if array is None or array.shape != shape:
        raise ModelError(f"{name} is {value!r}; it must be {_words(shape)}")
    return array


def finite(name: str, value: Any, shape: tuple[int, ...] = ()) -> np.ndarray:
    """As `numbers`, and none of them infinite or nan."""
    array = numbers(name, value, shape)
    if not np.isfinite(array).all():
        raise ModelError(f"{name} is {array.tolist()}; it must be {_words(shape)}, finite")
    return array


def positive(name: str, value: Any) -> float:
    """A finite number above 0; raises ModelError where it is none."""
    number = float(finite(name, value))
    if not number > 0:
        raise ModelError(f"{name} is {number:g}; it must be greater than 0")
    return number


def _words(shape: tuple[int, ...]) -> str:
    return f"{shape[0]} numbers" if shape else "a number"
