"""Strain stiffening, or softening: a family of isotropic solids with one shape parameter r, signed.

The energy grows with I1 as 2 dW/dI1 = mu h(I1 - 3): h(J) = exp(2 r J) where r is above 0 (Demiray 1972; the
isotropic part of Fung and of Veronda & Westmann), and 1 / sqrt(1 - 4 r J) below 0 (Knowles 1977 with n =
1/2, the softest power at which no deformation loses ellipticity). Both begin as 1 + 2 r J: r is Yeoh's
c20 / c10 at small strains, and 0 is neo-Hookean.

The dent's force and sideways stiffness over the neo-Hookean ones were solved for some r by the axisymmetric
finite-strain solver and stand in mechanics/contact/dent_stiffening.csv ('python -m tools.dent_table
--family'). The far field is left as it is.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.contact.dent import grid
from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Scope, unchanged
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import TouchTerms
from palpate.mechanics.model.model import Model

if TYPE_CHECKING:
    from scipy.interpolate import PchipInterpolator

FAMILY = Path(__file__).parents[1] / "contact" / "dent_stiffening.csv"
"""Columns ratio, depth / R, ln of the factor on the force over ratio, the same of the sideways stiffness."""
LEAST, GREATEST = -0.5, 4.0
"""Of the ratio: what the table spans."""
_SPREAD = 0.2  # ratios are told apart on this scale: nodes lie about evenly in asinh(ratio / _SPREAD)


def hardening(excess: np.ndarray, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """(h, dh/dJ) at J = I1 - 3: 2 dW/dI1 over the shear modulus, and its slope. ratio: r above."""
    if ratio >= 0:
        h = np.exp(2 * ratio * excess)
        return h, 2 * ratio * h
    inside = 1 - 4 * ratio * excess
    return inside**-0.5, 2 * ratio * inside**-1.5


@cache
def _family() -> PchipInterpolator:
    """asinh(ratio / _SPREAD) to (2, k): ln of the factors over ratio, at mechanics.contact.dent.grid()."""
    from scipy.interpolate import PchipInterpolator  # here: most materials need none

    ratio, x, force, sideways = np.loadtxt(FAMILY, delimiter=",", unpack=True)
    ratios = np.unique(ratio)
    logs = []
    for each in ratios:
        own = ratio == each
        columns = (np.concatenate([[0.0], c[own]]) for c in (force, sideways))
        at = np.sqrt(np.concatenate([[0.0], x[own]]))
        # smooth in the root of the depth; beyond the deepest solution it is held
        within = np.minimum(np.sqrt(grid()), at[-1])
        logs.append([PchipInterpolator(at, c)(within) for c in columns])
    return PchipInterpolator(np.arcsinh(ratios / _SPREAD), np.array(logs), axis=0)


def stiffening(c20_over_c10: float) -> tuple[np.ndarray, np.ndarray]:
    """Factors (k,) on the dent's normal force and sideways stiffness at mechanics.contact.dent.grid().

    Beyond LEAST or GREATEST the logarithm goes on in proportion to the ratio.
    """
    within = float(np.clip(c20_over_c10, LEAST, GREATEST))
    force, sideways = np.exp(c20_over_c10 * _family()(np.arcsinh(within / _SPREAD)))
    return force, sideways


def _touch(touch: TouchTerms, keys: Keys, model: Model) -> None:
    ratio = float(keys["c20_over_c10"])
    touch.factors.append(lambda poisson_ratio: stiffening(ratio))


EFFECT = Effect(
    name="strain_stiffening",
    domain="object",
    scope=Scope.EVERYWHERE,
    words="the material stiffens or softens as it is strained",
    parameters=(Parameter("c20_over_c10", "1", LEAST, GREATEST, 0.0, (0.3, -0.05), 0.02),),
    keys={"c20_over_c10": FileKey(low=LEAST, high=GREATEST, required=True)},
    report=lambda values, scene, modulus_pa: {"c20_over_c10": float(values[0])},
    touch=_touch,
    apply=unchanged,
    hints=SearchHints(
        hides_strain=True,
        stands_for_strain=True,
    ),
)
