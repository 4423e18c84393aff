"""Mullins softening: below the greatest load that a place has felt it is softer (Ogden & Roxburgh 1999).

The force is multiplied by 1 - erf((W_max - W) / m) / r. W stands for the stored energy, taken to grow with
the depth as a dent's does, depth^2.5; m = m_rel times W at the greatest depth of the exploration.
"""

from __future__ import annotations

import math

import numpy as np

from palpate.mechanics.contact.dent import dent_load
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, check, unchanged
from palpate.mechanics.effects.law import PathLaw
from palpate.mechanics.effects.settings import TouchTerms
from palpate.mechanics.kernels import kernel
from palpate.mechanics.model.model import Model

_NONE = 1e-6  # 1 / r that counts as none


@kernel
def softening(load, most, r, m):
    """Factor on the force, 1 while loading afresh; load, most and m in the measure of `dent_load`."""
    if most <= load:
        return 1.0
    return 1.0 - math.erf((most - load) / m) / r


@kernel
def _step(numbers, memory, depth, deepest, load, most, dt, normal, force):
    factor = softening(load, most, numbers[0], numbers[1])
    for k in range(3):
        force[k] *= factor


LAW = PathLaw(_step, order=0, reads_load=True)


def greatest_load(model: Model) -> float:
    """`dent_load` of the deepest press of the exploration that the model was made from."""
    depths = model.presses.depth_m[np.isfinite(model.presses.depth_m)]
    return float(dent_load(max(depths, default=model.tool.tip_radius_m)))


def _touch(touch: TouchTerms, keys: Keys, model: Model) -> None:
    r, m_rel = float(keys["r"]), float(keys["m_rel"])
    check(r >= 1 and m_rel > 0, "mullins_softening", "r at least 1, m_rel greater than 0")
    touch.numbers[LAW] = np.array([r, m_rel * greatest_load(model)])


EFFECT = Effect(
    name="mullins_softening",
    domain="object",
    scope=Scope.TIME,
    words="the material is softer the second time it is pressed",
    parameters=(
        Parameter("inverse_r", "1", 0.0, 0.8, 0.0, (0.1, 0.1), 0.01),
        Parameter("m_rel", "1", 0.01, 2.0, 0.3, (0.1, 0.4), 0.02),
    ),
    keys={
        "r": FileKey(low=1.0, high=1e9, required=True),
        "m_rel": FileKey(low=1e-6, high=1e3, required=True),
    },
    report=lambda values, scene, modulus_pa: {
        "r": float(1 / max(values[0], _NONE)),
        "m_rel": float(values[1]),
    },
    touch=_touch,
    law=LAW,
    apply=unchanged,
)
