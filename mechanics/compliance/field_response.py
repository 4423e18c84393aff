"""How presses answer to a field of stiffness: by the elements' shares of their compliance, and under the tip.

A press of a share `a` of whose answer is the far field's tells ln E at an element by that element's share of
the far field, and the rest of it right under the tip, where its dent lies. To first order in each element's
compliance, the far field and the modulus under the tip change as mechanics.compliance.far_field says.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.compliance.far_field import EnergyFields, energy_fields, far_with_weights
from palpate.mechanics.compliance.pressed_places import Places
from palpate.mechanics.compliance.smooth_field import TIP_DEPTH_IN_RADII, Shares


def shares_of(places: Places, answer: np.ndarray) -> Shares:
    """By which each press tells of the field at the elements' centres, then at the presses' own tips.

    answer: (p,) m, change of ln E of a press a unit of compliance along its normal, unit modulus.
    """
    fields = energy_fields(places)
    far = answer[:, None] * fields.energy[:, :, 0, 0][places.place]
    own = np.maximum(1 - far.sum(axis=1), 0.0)
    weight = np.hstack([far, np.diag(own)])
    nodes = np.vstack([fields.centroid, tips_of(places)])
    return Shares(nodes, weight / weight.sum(axis=1, keepdims=True))


def shares_in_elements(places: Places, answer: np.ndarray) -> Shares:
    """The same at the elements' centres alone: under a tip are those that its contact meets, as a renderer
    has it."""
    fields = energy_fields(places)
    weight = answer[:, None] * fields.energy[:, :, 0, 0][places.place]
    own = np.maximum(1 - weight.sum(axis=1), 0.0)
    np.add.at(weight.T, places.model.mesh.touchable_elements, (own[:, None] * places.under_tip).T)
    return Shares(fields.centroid, weight / weight.sum(axis=1, keepdims=True))


def tips_of(places: Places) -> np.ndarray:
    """(p, 3) m, where under each press the dent's own modulus is taken."""
    return places.point - TIP_DEPTH_IN_RADII * places.model.tool.tip_radius_m * places.normal


def far_of(
    places: Places, fields: EnergyFields, ratio: np.ndarray, softness: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(far (p, 3, 3) 1/m in local frames, dent_ratio (p,)) of presses on an object whose elements are of
    ratios (m,) and whose softness under each tip is (p,)."""
    # what the far field takes off is of the modulus under the tip: the half-space, and what the energies'
    # elements are too wide for, so that the same ratio everywhere is another modulus
    taken = fields.whole[places.place] - places.far
    return far_with_weights(places, 1 / ratio) + (1 - softness)[:, None, None] * taken, 1 / softness
