"""A skin of another stiffness: a dent feels it as a layer bonded to a half-space, by the contact's radius.

The modulus under a contact of radius a is E k(a / thickness), k exact for a flat punch without friction:
modulus_ratio for a small contact, 1 for a wide one: a stiff skin is stiff at first touch and less so deeper.
The layer's response to a wave of the load is in closed form (Burmister 1945; O'Sullivan & King 1988), the
punch's integral equation is solved by quadrature. How the skin holds the whole object together is in the far
field, by mechanics.model.material.skin_ratio.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from palpate.mechanics.compliance.far_field import energy_fields, far_with_weights
from palpate.mechanics.contact.dent import grid
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene, TouchTerms
from palpate.mechanics.model.material import SKIN, Skin
from palpate.mechanics.model.model import Model

_RADII = np.geomspace(0.02, 20.0, 32)
"""Contact radii, in thicknesses, at which a punch is solved; what a skin adds to wider ones falls with the
radius."""
_WAVES, _PARTS = 12.0, (48, 400)
"""Wavenumber times thickness above which a load feels the layer alone; points of the quadratures over the
punch and over the waves."""


def layer_softness(wave: np.ndarray, modulus_ratio: float, poisson_ratio: float) -> np.ndarray:
    """Normal displacement under a load of these wavenumbers, times thickness, over that of a half-space of
    the layer's own material: 1 for short waves, modulus_ratio for long ones."""
    b = 3 - 4 * poisson_ratio
    one, two = 1 - (1 + b) / (1 + modulus_ratio * b), (modulus_ratio - 1) / (modulus_ratio + b)
    decay = np.exp(-2 * wave)
    above = 1 + 4 * wave * two * decay - one * two * decay**2
    return np.asarray(above / (1 - (one + two + 4 * two * wave**2) * decay + one * two * decay**2))


@lru_cache(maxsize=1)
def _waves() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Places on a punch and their weights, waves, and (radius, place, wave) cosines, by the wave's weight."""
    (place, weight), (wave, share) = (np.polynomial.legendre.leggauss(n) for n in _PARTS)
    place, wave = 0.5 * (place + 1), 0.5 * (wave + 1) * _WAVES
    cosines = np.cos(_RADII[:, None, None] * place[:, None] * wave)
    return 0.5 * weight, wave, cosines, 0.5 * share * _WAVES


@lru_cache(maxsize=64)
def _punch(modulus_ratio: float, poisson_ratio: float) -> CubicSpline:
    """The modulus under a punch over that of the half-space, by the logarithm of _RADII."""
    weight, wave, cosines, share = _waves()
    beyond = (layer_softness(wave, modulus_ratio, poisson_ratio) - 1) * share
    kernel = 2 / np.pi * _RADII[:, None, None] * ((cosines * beyond) @ cosines.transpose(0, 2, 1))
    load = np.linalg.solve(np.eye(len(weight)) + kernel * weight, np.ones((len(weight), 1)))[..., 0]
    return CubicSpline(np.log(_RADII), modulus_ratio * (load @ weight))


def film_factor(
    contact_radius_m: np.ndarray, thickness_m: float, modulus_ratio: float, poisson_ratio: float
) -> np.ndarray:
    """Modulus under contacts of these radii over that of the object without its skin."""
    wide = np.maximum(contact_radius_m / thickness_m, _RADII[0])
    solved = np.minimum(wide, _RADII[-1])
    return np.asarray(1 + (_punch(modulus_ratio, poisson_ratio)(np.log(solved)) - 1) * solved / wide)


def _set(touch: TouchTerms, skin: Skin, model: Model) -> None:
    contact = model.tool.tip_radius_m * np.sqrt(np.maximum(grid(), 1e-6))

    def factors(poisson_ratio: float) -> tuple[np.ndarray, np.ndarray]:
        own = film_factor(contact, skin.thickness_m, skin.modulus_ratio, poisson_ratio)
        return own, own

    touch.factors.append(factors)


def _of_material(touch: TouchTerms, model: Model) -> None:
    if model.material.skin is not None:
        _set(touch, model.material.skin, model)


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    return {"thickness_m": float(values[0]), "modulus_ratio": float(np.exp(values[1]))}


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    places, skin = scene.places, Skin(**_report(values, scene, settings.modulus))
    _set(settings.touch, skin, places.model)
    thickness, depth = skin.thickness_m, energy_fields(places).depth
    inside = np.clip(thickness / np.maximum(depth, 1e-6), 0, 1) * (depth < 2 * thickness)
    changed = far_with_weights(places, 1 + inside * (1 / skin.modulus_ratio - 1))
    settings.far = settings.far + changed - places.far


EFFECT = Effect(
    name="skin_layer",
    domain="object",
    scope=Scope.PLACES,
    words="a skin of another stiffness covers the object",
    parameters=(
        Parameter("thickness_m", "m", 3e-4, 8e-3, 3e-3, (2e-3, 2e-3), 2e-4),
        Parameter("log_ratio", "ln 1", -2.0, 3.0, 0.0, (0.5, -0.4), 0.03),
    ),
    keys=SKIN,
    report=_report,
    of_material=_of_material,
    change=_change,
    apply=lambda model, keys: model.with_material(skin=Skin(**keys)),
    hints=SearchHints(
        hides_strain=True,
        stands_for_strain=True,
        expensive=True,
    ),
)
