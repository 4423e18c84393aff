"""A skin of another stiffness: the dent feels it as a layer bonded to a half-space (mechanics.contact.skin),
a stiff one stiff at first touch and less so deeper; and it holds the object together as a membrane on its
surface (mechanics.elastic.membrane). A soft one lets the object as a whole be.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from palpate.mechanics.compliance.far_field import far_under_skin
from palpate.mechanics.contact.skin import skin_factors
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene, TouchTerms
from palpate.mechanics.model.material import SKIN, Skin
from palpate.mechanics.model.model import Model


def _set(touch: TouchTerms, skin: Skin, model: Model) -> None:
    factors = skin_factors(skin, model.tool.tip_radius_m)
    touch.factors.append(lambda poisson_ratio: factors)


def beneath_skin(touch: TouchTerms, model: Model) -> None:
    """Put the skin that a model's material has into what a tip feels."""
    if model.material.skin is not None:
        _set(touch, model.material.skin, model)


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    return {"thickness_m": float(values[0]), "modulus_ratio": float(np.exp(values[1]))}


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    places, skin = scene.places, Skin(**_report(values, scene, settings.modulus))
    _set(settings.touch, skin, places.model)
    settings.far = settings.far + far_under_skin(places, skin.stretch_m)


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
