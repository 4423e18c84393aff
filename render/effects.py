"""The effects of a model that are rendered: what a tip feels where it touches, as numbers for the step.

Effects of the material's layout and of the base are in the model's moduli and compliance already. Effects of
the instrument are corrections of a recording and are never rendered.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.mechanics.effects.laws_along_path import PathNumbers, path_numbers
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.effects.settings import STICKS, TouchTerms
from palpate.mechanics.model.model import Model
from palpate.render.options import RenderOptions

STICKING = 1.0
"""Enough for every press of a hand to stick, as the ideal tip does; a tip that is dragged along slides all
the same, where one that stuck for good would stretch the surface without bound."""


class EffectArrays(NamedTuple):
    """For the kernel. path: of the laws along a touch's path. dent_radius: (1,) factor on the tip's radius in
    the dent."""

    path: PathNumbers
    dent_radius: np.ndarray


def rendered_touch(model: Model, options: RenderOptions) -> TouchTerms:
    """What a tip feels: the material's dent, the effects that the model names, the options' law and friction.

    What is material stays where the options leave effects out. Raises ModelError where an effect's keys are
    missing or impossible.
    """
    touch = TouchTerms()
    for effect in effects():
        if effect.of_material is not None:
            effect.of_material(touch, model)
        elif options.effects and effect.name in model.effects:
            effect.set_touch(touch, model.effects[effect.name], model)
    if options.dent_law is not None:
        touch.dent_law = options.dent_law
    if options.friction is not None:
        touch.friction = float(options.friction)
    elif touch.friction == STICKS:
        touch.friction = STICKING
    return touch


def effect_arrays(touch: TouchTerms) -> EffectArrays:
    """The kernel's numbers of a touch."""
    return EffectArrays(path_numbers(touch), np.array([touch.tip_ratio]))
