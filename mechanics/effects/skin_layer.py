"""A skin of another stiffness: the dent feels it by the share of its strain that lies in the film.

The modulus under a contact of radius a is E ratio^w(thickness / a), w Gao's weight of a film (Gao, Chiu & Lee
1992), 0 for a thin and 1 for a thick one: stiff at first touch, less so deeper. How the skin holds the whole
object together is in the far field, by mechanics.model.material.skin_ratio.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.mechanics.compliance.far_field import energy_fields, far_with_weights
from palpate.mechanics.contact.dent import grid
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene, TouchTerms
from palpate.mechanics.model.material import SKIN, Skin
from palpate.mechanics.model.model import Model


def film_weight(thickness_over_contact: np.ndarray, poisson_ratio: float) -> np.ndarray:
    """Gao's I0: share of the film in the modulus under a contact, 0 thin to 1 thick."""
    x = np.maximum(thickness_over_contact, 1e-9)
    return 2 / np.pi * np.arctan(x) + (
        (1 - 2 * poisson_ratio) * x * np.log((1 + x * x) / (x * x)) - x / (1 + x * x)
    ) / (2 * np.pi * (1 - poisson_ratio))


def film_factor(
    contact_radius_m: np.ndarray, thickness_m: float, modulus_ratio: float, poisson_ratio: float
) -> np.ndarray:
    """Modulus under contacts of these radii over that of the object without its skin."""
    weight = film_weight(thickness_m / np.maximum(contact_radius_m, 1e-6), poisson_ratio)
    return modulus_ratio**weight


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
