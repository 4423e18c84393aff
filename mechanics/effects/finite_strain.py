"""Finite strain: a neo-Hookean solid instead of a linear one. It has no parameter: it grows with the
depth."""

import numpy as np

from palpate.mechanics.contact.dent import FINITE
from palpate.mechanics.effects.base import Effect, Role, Scope, no_keys
from palpate.mechanics.effects.settings import ForwardSettings, TouchedScene, TouchTerms
from palpate.mechanics.model.model import Model

LAW = FINITE


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    settings.touch.dent_law = LAW


def _of_material(touch: TouchTerms, model: Model) -> None:
    touch.dent_law = model.material.dent_law


EFFECT = Effect(
    name="finite_strain",
    domain="object",
    scope=Scope.PRESS,
    words="the presses are so deep that small-strain elasticity no longer holds",
    parameters=(),
    keys={},
    report=no_keys,
    plain_words="the presses are so deep that the material is stretched and squeezed strongly, where force "
    "no longer follows the simple law of elasticity",
    role=Role.KNOWN,
    change=_change,
    of_material=_of_material,
    apply=lambda model, keys: model.with_material(dent_law=LAW),
)
