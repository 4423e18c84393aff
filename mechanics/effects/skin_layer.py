"""A skin of another stiffness: the dent feels it as a layer bonded to a half-space, by the contact's radius.

The modulus under a contact is that under a flat punch of its radius (mechanics.compliance.local_material):
the skin's for a small one, the object's for a wide one, so a stiff skin is stiff at first touch and less so
deeper. How the skin holds the whole object together is in the far field, by material.skin_ratio.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.mechanics.compliance.far_field import energy_fields, far_with_weights
from palpate.mechanics.compliance.local_material import patch_softness, punch_factor
from palpate.mechanics.compliance.pressed_places import Places
from palpate.mechanics.contact.dent import grid
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene, TouchTerms
from palpate.mechanics.model.material import SKIN, Skin
from palpate.mechanics.model.model import Model


def _set(touch: TouchTerms, skin: Skin, model: Model) -> None:
    contact = model.tool.tip_radius_m * np.sqrt(np.maximum(grid(), 1e-6))

    def factors(poisson_ratio: float) -> tuple[np.ndarray, np.ndarray]:
        own = punch_factor(contact, skin, poisson_ratio)
        return own, own

    touch.factors.append(factors)


def beneath_skin(touch: TouchTerms, model: Model) -> None:
    """Put the skin that a model's material has into what a tip feels."""
    if model.material.skin is not None:
        _set(touch, model.material.skin, model)


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    return {"thickness_m": float(values[0]), "modulus_ratio": float(np.exp(values[1]))}


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    places, skin = scene.places, Skin(**_report(values, scene, settings.modulus))
    _set(settings.touch, skin, places.model)
    fields = energy_fields(places)
    local = 1 - patch_softness(fields.width_m, skin, places.model.material.poisson_ratio)
    settings.far = settings.far + _stretched(skin, places) + local * fields.half_space


def _stretched(skin: Skin, places: Places) -> np.ndarray:
    """(p, 3, 3) 1/m, change of each press's compliance, unit modulus, as if the skin were stretched like the
    object that it covers: C (C + (m - 1) E)^-1 C - C, of the energy E that the skin's elements hold of C."""
    fields, thickness = energy_fields(places), skin.thickness_m
    inside = np.clip(thickness / np.maximum(fields.depth, 1e-6), 0, 1) * (fields.depth < 2 * thickness)
    held = far_with_weights(places, 1 + inside) - places.far
    whole = fields.whole[places.place]
    return whole @ np.linalg.solve(whole + (skin.modulus_ratio - 1) * held, whole) - whole


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
    of_material=beneath_skin,
    change=_change,
    apply=lambda model, keys: model.with_material(skin=Skin(**keys)),
    hints=SearchHints(
        hides_strain=True,
        stands_for_strain=True,
        expensive=True,
    ),
)
