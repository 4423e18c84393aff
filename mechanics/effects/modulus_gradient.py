"""Modulus gradient: stiffness runs linearly from the base to the top, along the support's normal."""

from typing import Any

import numpy as np

from palpate.mechanics.compliance.far_field import energy_fields, far_with_weights
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene
from palpate.mechanics.model.material import GRADIENT, Gradient, gradient_ratio, height_share
from palpate.mechanics.model.model import Model


def gradient(log_ratio: float) -> Gradient:
    """The gradient whose mean is 1: the mean belongs to the modulus."""
    base = 2 / (1 + np.exp(-log_ratio))
    return Gradient(float(base), float(2 - base))


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    places, model = scene.places, scene.places.model
    height = places.stage(
        "height share", lambda: height_share(model.mesh, model.support.point, model.support.normal)
    )
    ratio = gradient_ratio(gradient(values[0]), height)
    settings.far = settings.far - places.far + far_with_weights(places, 1 / ratio)
    # the half-space that is taken off is of the modulus under the tip
    softness = places.under_tip @ (1 / ratio[model.mesh.touchable_elements])
    settings.far = settings.far + (1 - softness)[:, None, None] * energy_fields(places).half_space
    settings.dent_ratio = settings.dent_ratio / softness


def _report(values: np.ndarray, scene: TouchedScene, modulus_pa: float) -> dict[str, Any]:
    found = gradient(values[0])
    return {"ratio_base": found.ratio_base, "ratio_top": found.ratio_top}


def _apply(model: Model, keys: Keys) -> Model:
    there = model.material.gradient or Gradient(1.0, 1.0)
    base, top = float(keys["ratio_base"]), float(keys["ratio_top"])
    return model.with_material(gradient=Gradient(base * there.ratio_base, top * there.ratio_top))


EFFECT = Effect(
    name="modulus_gradient",
    domain="object",
    scope=Scope.PLACES,
    words="the object is stiffer at one end than at the other",
    parameters=(Parameter("log_ratio", "ln 1", -3.0, 3.0, 0.0, (0.3, -0.3), 0.05),),
    keys=GRADIENT,
    report=_report,
    change=_change,
    apply=_apply,
    hints=SearchHints(
        expensive=True,
    ),
)
