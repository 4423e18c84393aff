"""What the far field of a place gives back for the material under the tip.

The dent is that of a half-space: of the modulus under the tip, beneath a skin where there is one. The far
field of a place is the object's compliance under a patch less a uniform half-space's; where the material
under the tip is another, or a skin's membrane lies on it, the difference of the two half-spaces is given
back, or it counts twice.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.compliance.near_field import surface_softness
from palpate.mechanics.compliance.patch import half_space_compliance
from palpate.mechanics.elastic.membrane import half_space_change
from palpate.mechanics.model.model import Model


def given_back(
    model: Model, points: np.ndarray, normals: np.ndarray, width_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """(softness (k,), far (k, 3, 3) 1/m, unit modulus) under a tip at points (k, 3) m of unit normals.

    softness: the global modulus over the dent's own, skin apart. far: to add to a far field that was taken
    under patches of that width less a uniform half-space.
    """
    nu, tip = model.material.poisson_ratio, model.tool.tip_radius_m
    softness = surface_softness(model.mesh, model.surface_ratio, points, tip)
    own = softness[:, None, None]
    half = half_space_compliance(normals, nu, width_m)
    skinned = half_space_change(normals, nu, width_m, model.stretch_m)
    return softness, (1 - own) * half - own * skinned
