"""A skin of another stiffness: the dent feels it by the share of its strain that lies in the film.

The modulus under a contact of radius a is E ratio^w(thickness / a), w Gao's weight of a film (Gao, Chiu & Lee
1992), 0 for a thin and 1 for a thick one: stiff at first touch, less so deeper. How the skin holds the whole
object together is in the far field, by mechanics.moduli.skin_ratio.
"""

from __future__ import annotations

import numpy as np

from mechanics.dent import DentLaw, grid


def film_weight(thickness_over_contact: np.ndarray, poisson_ratio: float) -> np.ndarray:
    """Gao's I0: share of the film in the modulus under a contact, 0 thin to 1 thick."""
    x = np.maximum(thickness_over_contact, 1e-9)
    return 2 / np.pi * np.arctan(x) + (
        (1 - 2 * poisson_ratio) * x * np.log((1 + x * x) / (x * x)) - x / (1 + x * x)
    ) / (2 * np.pi * (1 - poisson_ratio))


def film_factor(
    contact_radius_m: np.ndarray, thickness_m: float, modulus_ratio: float, poisson_ratio: float
) -> np.ndarray:
    """Modulus under contacts of these radii over that of the object without its skin."""
    weight = film_weight(thickness_m / np.maximum(contact_radius_m, 1e-6), poisson_ratio)
    return modulus_ratio**weight


def skinned(
    law: DentLaw, thickness_m: float, modulus_ratio: float, tip_radius_m: float, poisson_ratio: float
) -> DentLaw:
    """The dent law of a tip on an object with a skin; its modulus stays that of the object within."""
    contact = tip_radius_m * np.sqrt(np.maximum(grid(), 1e-6))
    factor = film_factor(contact, thickness_m, modulus_ratio, poisson_ratio)
    return law.scaled(factor, factor, name=f"{law.name}, skin")
