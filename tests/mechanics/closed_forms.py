"""Closed-form solutions of linear elasticity, as small functions.

A half-space fills z <= 0 in the formulas below; forces act on its surface at the origin, into it (-z)
where they are called normal. SI units. Sources: Johnson, Contact Mechanics (1985), chapters 3 and 4.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk


def plane_strain_modulus(young_modulus_pa: float, poisson_ratio: float) -> float:
    """E* = E / (1 - nu^2), Pa."""
    return young_modulus_pa / (1 - poisson_ratio**2)


def hertz_force(
    depth_m: np.ndarray, radius_m: float, young_modulus_pa: float, poisson_ratio: float
) -> np.ndarray:
    """Force, N, of a rigid paraboloid pressed `depth_m` into a half-space: 4/3 E* sqrt(R) d^1.5 (4.23)."""
    depth = np.maximum(depth_m, 0.0)
    return 4 / 3 * plane_strain_modulus(young_modulus_pa, poisson_ratio) * np.sqrt(radius_m) * depth**1.5


def elliptic_force(
    depth_m: np.ndarray, greater: float, less: float, young_modulus_pa: float, poisson_ratio: float
) -> np.ndarray:
    """Force, N, of a rigid body of principal relative curvatures `greater` > `less`, 1/m (4.25 to 4.31)."""

    def integrals(axes: float) -> tuple[float, float]:
        k, e = ellipk(1 - axes**2), ellipe(1 - axes**2)
        return e / axes**2 - k, k - e

    axes = brentq(lambda b: np.divide(*integrals(b)) - greater / less, 1e-3, 1 - 1e-6)
    sides = np.prod(integrals(axes))
    first = (4 / np.pi / (1 - axes**2)) ** (1 / 3) * np.sqrt(axes) * sides ** (1 / 6)
    second = 2 / np.pi * np.sqrt(axes) / first * ellipk(1 - axes**2)
    round_one = hertz_force(depth_m, 1 / np.sqrt(greater * less), young_modulus_pa, poisson_ratio)
    return round_one / second**1.5


def hertz_contact_radius(depth_m: np.ndarray, radius_m: float) -> np.ndarray:
    """Contact radius, m: sqrt(R d)."""
    return np.sqrt(radius_m * np.maximum(depth_m, 0.0))


def sphere_force(
    contact_radius_m: np.ndarray, radius_m: float, young_modulus_pa: float, poisson_ratio: float
) -> tuple[np.ndarray, np.ndarray]:
    """(force N, depth m) of a rigid sphere of exact profile for a contact radius below R (Sneddon 1965)."""
    a = np.asarray(contact_radius_m, dtype=float)
    log = np.log((radius_m + a) / (radius_m - a))
    modulus = plane_strain_modulus(young_modulus_pa, poisson_ratio)
    return modulus * ((a**2 + radius_m**2) / 2 * log - a * radius_m), a / 2 * log


def flat_punch_force(
    depth_m: np.ndarray, punch_radius_m: float, young_modulus_pa: float, poisson_ratio: float
) -> np.ndarray:
    """Force, N, of a rigid flat circular punch: 2 E* a d (3.36)."""
    return 2 * plane_strain_modulus(young_modulus_pa, poisson_ratio) * punch_radius_m * np.asarray(depth_m)


def bonded_punch_sideways_force(
    shift_m: np.ndarray, punch_radius_m: float, young_modulus_pa: float, poisson_ratio: float
) -> np.ndarray:
    """Force, N, of a sticking circle of contact moved sideways: 8 G a / (2 - nu) d (7.42)."""
    shear = young_modulus_pa / (2 * (1 + poisson_ratio))
    return 8 * shear * punch_radius_m / (2 - poisson_ratio) * np.asarray(shift_m)


def boussinesq_displacement(
    points_m: np.ndarray, force_n: float, young_modulus_pa: float, poisson_ratio: float
) -> np.ndarray:
    """(k, 3) m: displacement at points (k, 3), z <= 0, for a force pressing in at the origin (3.18)."""
    x, y, z = np.asarray(points_m, dtype=float).T
    depth = -z
    shear = young_modulus_pa / (2 * (1 + poisson_ratio))
    rho = np.sqrt(x**2 + y**2 + depth**2)
    scale = force_n / (4 * np.pi * shear)
    across = depth / rho**3 - (1 - 2 * poisson_ratio) / (rho * (rho + depth))
    down = depth**2 / rho**3 + 2 * (1 - poisson_ratio) / rho
    return scale * np.stack([x * across, y * across, -down], axis=1)


def cerruti_displacement(
    points_m: np.ndarray, force_n: float, young_modulus_pa: float, poisson_ratio: float
) -> np.ndarray:
    """(k, 3) m: displacement at points (k, 3), z <= 0, for a force along +x at the origin (3.76)."""
    x, y, z = np.asarray(points_m, dtype=float).T
    depth = -z
    shear = young_modulus_pa / (2 * (1 + poisson_ratio))
    rho = np.sqrt(x**2 + y**2 + depth**2)
    s = 1 - 2 * poisson_ratio
    sum_ = rho + depth
    scale = force_n / (4 * np.pi * shear)
    ux = 1 / rho + x**2 / rho**3 + s * (1 / sum_ - x**2 / (rho * sum_**2))
    uy = x * y / rho**3 - s * x * y / (rho * sum_**2)
    down = x * depth / rho**3 + s * x / (rho * sum_)
    return scale * np.stack([ux, uy, -down], axis=1)


def uniaxial_strain_of_stress(stress_pa: float, young_modulus_pa: float, poisson_ratio: float) -> np.ndarray:
    """(3,) strains along the stress and across it: s / E, -nu s / E, -nu s / E."""
    return stress_pa / young_modulus_pa * np.array([1.0, -poisson_ratio, -poisson_ratio])


def volume_strain_of_pressure(pressure_pa: float, young_modulus_pa: float, poisson_ratio: float) -> float:
    """Relative change of volume under a pressure: -3 (1 - 2 nu) p / E."""
    return -3 * (1 - 2 * poisson_ratio) * pressure_pa / young_modulus_pa
