"""Strain stiffening: Yeoh's second coefficient makes the dent's force grow faster than neo-Hookean.

Fitted to the axisymmetric finite-strain solution of mechanics.dent at c20 / c10 = 0.35 (nu = 0.49, a
sticking sphere, to 1.8 radii; within 0.3 % of the force): normal 1 + 0.197 c20/c10 x^1.25, sideways 1 +
0.129 c20/c10 x^1.7, x = delta / R. 'palpate bench dent-table --stiffening' recomputes it. The far field is
left as it is.
"""

from __future__ import annotations

import numpy as np

from mechanics.dent import grid
from mechanics.effects.base import Effect, Keys, Parameter, Scope, unchanged
from mechanics.effects.settings import Touch
from mechanics.model import Model
from mechanics.schema import Key

FORCE_PER_C20, FORCE_POWER = 0.197, 1.25
SIDEWAYS_PER_C20, SIDEWAYS_POWER = 0.129, 1.7


def stiffening(c20_over_c10: float) -> tuple[np.ndarray, np.ndarray]:
    """Factors (k,) on the dent's normal force and sideways stiffness at mechanics.dent.grid()."""
    x = grid()
    return (
        1 + FORCE_PER_C20 * c20_over_c10 * x**FORCE_POWER,
        1 + SIDEWAYS_PER_C20 * c20_over_c10 * x**SIDEWAYS_POWER,
    )


def _touch(touch: Touch, keys: Keys, model: Model) -> None:
    ratio = float(keys["c20_over_c10"])
    touch.factors.append(lambda poisson_ratio: stiffening(ratio))


EFFECT = Effect(
    name="strain_stiffening",
    domain="object",
    scope=Scope.EVERYWHERE,
    words="the material stiffens as it is strained",
    parameters=(Parameter("c20_over_c10", "1", 0.0, 4.0, 0.0, (0.3,), 0.02),),
    keys={"c20_over_c10": Key(low=0.0, high=100.0, required=True)},
    report=lambda values, scene, modulus_pa: {"c20_over_c10": float(values[0])},
    touch=_touch,
    apply=unchanged,
    hides_strain=True,
    stands_for_strain=True,
)
