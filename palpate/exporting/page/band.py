"""How far a page's force may be off: one function, asked for every place and depth of a table."""

from __future__ import annotations

import numpy as np

from mechanics.model import Model

LAW_SHARE = 0.03
"""Of the force: the error of the law that the fit of the modulus takes for itself (`--law-error`)."""
UNKNOWN_SHARE = 0.1
"""Of the modulus, where a model states no interval."""


def force_band(model: Model, place: np.ndarray, depth_m: np.ndarray) -> np.ndarray:
    """(v, k) 95 % half width of the force over the force, at places (v, 3) m and depths (k,) m.

    The model's interval of its modulus and the law's own error, taken as independent.
    """
    low, high = model.material.young_modulus_ci95_pa
    modulus = UNKNOWN_SHARE
    if np.isfinite([low, high]).all():
        modulus = 0.5 * (high - low) / model.material.young_modulus_pa
    return np.full((len(place), len(depth_m)), float(np.hypot(modulus, LAW_SHARE)))
