"""How far a page's force may be off: one function, asked for every place and depth of a table."""

from __future__ import annotations

import numpy as np

from render.fem.renderer import FemRenderer
from render.force_error import law_share, place_numbers

UNKNOWN_SHARE = 0.1
"""Of the modulus, where a model states no interval."""


def force_band(renderer: FemRenderer, depth_m: np.ndarray) -> np.ndarray:
    """(v, k) 95 % half width of the force over the force, at the v vertices of the renderer's surface and
    depths (k,) m.

    The model's interval of its modulus and the law's own error (render.force_error), taken as independent.
    """
    model = renderer.model
    low, high = model.material.young_modulus_ci95_pa
    modulus = UNKNOWN_SHARE
    if np.isfinite([low, high]).all():
        modulus = 0.5 * (high - low) / model.material.young_modulus_pa
    radius = model.tool.tip_radius_m
    numbers = place_numbers(renderer, radius)
    return np.hypot(modulus, law_share(depth_m / radius, *numbers[:, :, None]))
