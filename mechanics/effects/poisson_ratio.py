"""Poisson's ratio: not what was stated. Thin places against thick ones, normal against tangential."""

import dataclasses

import numpy as np

from palpate.mechanics.compliance.far_field import far_at_poisson
from palpate.mechanics.effects.base import Effect, Parameter, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene
from palpate.mechanics.plausible import POISSON_RATIO


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    settings.nu = float(values[0])
    settings.far = settings.far - scene.places.far + far_at_poisson(scene.places, settings.nu)


EFFECT = Effect(
    name="poisson_ratio",
    domain="object",
    scope=Scope.EVERYWHERE,
    words="the material is more compressible than stated",
    parameters=(Parameter("poisson_ratio", "1", 0.30, 0.49, 0.49, (0.40,), 0.01),),
    keys={"poisson_ratio": dataclasses.replace(POISSON_RATIO, required=True)},
    report=lambda values, scene, modulus_pa: {"poisson_ratio": float(values[0])},
    change=_change,
    apply=lambda model, keys: model.with_material(poisson_ratio=keys["poisson_ratio"]),
    hints=SearchHints(
        hides_strain=True,
        stands_for_strain=True,
        expensive=True,
    ),
)
