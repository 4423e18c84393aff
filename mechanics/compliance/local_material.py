"""What a dent knows of the material under the tip, and what the far field gives back for it.

The dent is that of a half-space: of the modulus under the tip, beneath a skin where there is one. The far
field of a place is the object's compliance under a patch less a uniform half-space's; where the material
under the tip is another, the difference of the two half-spaces is given back, or it counts twice.

A layer bonded to a half-space answers a wave of the load in closed form (Burmister 1945; O'Sullivan & King
1988); a flat punch on it without friction is an integral equation, solved by quadrature.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.compliance.near_field import surface_softness
from palpate.mechanics.compliance.patch import half_space_compliance
from palpate.mechanics.model.material import Skin
from palpate.mechanics.model.model import Model

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_RADII = np.geomspace(0.02, 20.0, 32)
"""Contact radii, in thicknesses, at which a punch is solved; what a skin adds to wider ones falls with the
radius."""
_WAVES, _PARTS = 12.0, (48, 400)
"""Wavenumber times thickness above which a load feels the layer alone; points of the quadratures over the
punch and over the waves."""


def layer_softness(wave: np.ndarray, modulus_ratio: float, poisson_ratio: float) -> np.ndarray:
    """Normal displacement under a load of these wavenumbers, times thickness, over that of a half-space of
    the layer's own material: 1 for short waves, modulus_ratio for long ones."""
    b = 3 - 4 * poisson_ratio
    one, two = 1 - (1 + b) / (1 + modulus_ratio * b), (modulus_ratio - 1) / (modulus_ratio + b)
    decay = np.exp(-2 * wave)
    above = 1 + 4 * wave * two * decay - one * two * decay**2
    return np.asarray(above / (1 - (one + two + 4 * two * wave**2) * decay + one * two * decay**2))


@lru_cache(maxsize=1)
def _waves() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Weights of the places on a punch, waves, (radius, place, wave) cosines, and the waves' weights."""
    (place, weight), (wave, share) = (np.polynomial.legendre.leggauss(n) for n in _PARTS)
    place, wave = 0.5 * (place + 1), 0.5 * (wave + 1) * _WAVES
    cosines = np.cos(_RADII[:, None, None] * place[:, None] * wave)
    return 0.5 * weight, wave, cosines, 0.5 * share * _WAVES


@lru_cache(maxsize=64)
def _punch(modulus_ratio: float, poisson_ratio: float) -> CubicSpline:
    """The modulus under a punch over that of the half-space, by the logarithm of _RADII."""
    from scipy.interpolate import CubicSpline  # here: what has no skin needs none

    weight, wave, cosines, share = _waves()
    beyond = (layer_softness(wave, modulus_ratio, poisson_ratio) - 1) * share
    kernel = 2 / np.pi * _RADII[:, None, None] * ((cosines * beyond) @ cosines.transpose(0, 2, 1))
    load = np.linalg.solve(np.eye(len(weight)) + kernel * weight, np.ones((len(weight), 1)))[..., 0]
    return CubicSpline(np.log(_RADII), modulus_ratio * (load @ weight))


def punch_factor(contact_radius_m: np.ndarray, skin: Skin, poisson_ratio: float) -> np.ndarray:
    """Modulus under flat punches of these radii over that of the object without its skin."""
    wide = np.maximum(contact_radius_m / skin.thickness_m, _RADII[0])
    solved = np.minimum(wide, _RADII[-1])
    factor = _punch(skin.modulus_ratio, poisson_ratio)(np.log(solved))
    return np.asarray(1 + (factor - 1) * solved / wide)


def patch_softness(width_m: float, skin: Skin, poisson_ratio: float) -> float:
    """Mean displacement of a Gaussian patch of that width over what it is without the skin."""
    wave, share = np.polynomial.legendre.leggauss(200)
    wave = 3 * (wave + 1)  # times the width; beyond 6 a patch has no part
    weight = share * np.exp(-(wave**2))
    soft = layer_softness(wave * skin.thickness_m / width_m, skin.modulus_ratio, poisson_ratio)
    return float((weight * soft).sum() / weight.sum() / skin.modulus_ratio)


def given_back(
    model: Model, points: np.ndarray, normals: np.ndarray, width_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """(softness (k,), far (k, 3, 3) 1/m, unit modulus) under a tip at points (k, 3) m of unit normals.

    softness: the global modulus over the dent's own, skin apart. far: to add to a far field that was taken
    under patches of that width less a uniform half-space.
    """
    tip, nu, skin = model.tool.tip_radius_m, model.material.poisson_ratio, model.material.skin
    softness = surface_softness(model.mesh, model.surface_ratio, points, tip)
    felt = softness if skin is None else softness * patch_softness(width_m, skin, nu)
    return softness, (1 - felt)[:, None, None] * half_space_compliance(normals, nu, width_m)
