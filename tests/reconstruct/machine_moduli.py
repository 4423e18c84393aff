"""Moduli read off machines' curves, for comparison with what the machines state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.errors import ContactError, RecordingError
from palpate.mechanics.statistics import spread_about_zero
from palpate.reconstruction.machine_curves.indentation import Indentation
from palpate.reconstruction.machine_curves.uniaxial import Uniaxial


def small_strain_modulus(test: Uniaxial, *, low: float = 0.0, high: float = 0.05) -> float:
    """Slope (Pa) of a straight line through stress over strain between two strains.

    It is Young's modulus only where the platens let the faces slide; bonded faces raise it.
    """
    strain = 1 - test.stretch
    used = (strain >= low) & (strain <= high)
    if used.sum() < 3:
        raise RecordingError(f"fewer than 3 samples lie between the strains {low} and {high}")
    return float(np.polyfit(strain[used], -test.stress[used], 1)[0])


@dataclass(frozen=True)
class ApproachFit:
    """Modulus (Pa), travel at first touch (m), greatest indentation (m) over the radius, and share
    explained."""

    modulus_pa: float
    onset_m: float
    depth_over_radius: float
    r_squared: float


def fit_approach(indentation: Indentation, *, poisson_ratio: float = 0.5, law: str = "hertz") -> ApproachFit:
    """Modulus of the approach on a half-space, contact point free; law: a dent law of mechanics.contact.dent.

    For each contact point the modulus is linear least squares; the point is where the residual's derivative
    vanishes. Raises ContactError where the force never rises above its noise.
    """
    top = int(np.argmax(indentation.force))
    start = int(np.argmin(indentation.travel[: top + 1]))
    travel, force = indentation.travel[start : top + 1], indentation.force[start : top + 1]
    baseline = np.median(force[: max(10, len(force) // 5)])
    force = force - baseline
    noise = spread_about_zero(force[: max(10, len(force) // 5)])
    if not force.max() > 8 * noise:
        raise ContactError("the force of the approach never rises above its noise: no contact")
    nu = min(poisson_ratio, 0.4999)
    dent = dent_law(law, nu)

    def fitted(onset: float) -> tuple[float, float]:
        shape = np.asarray(dent.force(np.maximum(travel - onset, 0.0), 1.0, nu, indentation.tip_radius_m))
        e = float(shape @ force / max(shape @ shape, 1e-300))
        return e, float(((force - e * shape) ** 2).sum())

    candidates = np.linspace(travel.min(), travel.max() - 0.05 * np.ptp(travel), 60)
    best = int(np.argmin([fitted(c)[1] for c in candidates]))
    low, high = candidates[max(best - 1, 0)], candidates[min(best + 1, len(candidates) - 1)]
    step = 1e-4 * (high - low)

    def slope(onset: float) -> float:
        return fitted(onset + step)[1] - fitted(onset - step)[1]

    onset = brentq(slope, low, high) if slope(low) * slope(high) < 0 else candidates[best]
    e, cost = fitted(onset)
    total = float(((force - force.mean()) ** 2).sum())
    return ApproachFit(
        e, float(onset), float((travel.max() - onset) / indentation.tip_radius_m), 1 - cost / total
    )
