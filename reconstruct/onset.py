"""First touch, estimated by fitting the contact law to the rise of the force.

A threshold comes late: a 5 mm tip on 16 kPa pushes back with 4 mN at 0.15 mm. The law of a sphere on a body
that gives as a whole, u - u0 = (F / h)^(2/3) + c F (Hertz and a linear far field), is fitted to free air and
rise alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares


@dataclass(frozen=True)
class Rise:
    """The fitted law of one press: u0_m, its standard error, h (N/m^1.5), c (m/N), rms misfit in N."""

    u0_m: float
    u0_error_m: float
    hertz: float
    give: float
    misfit_n: float


def contact_law(u: np.ndarray, hertz: float, give: float) -> np.ndarray:
    """Force F (N) at travel u (m) with u = (F / h)^(2/3) + c F, zero for u <= 0.

    hertz: h = 4/3 E* sqrt(R), N/m^1.5; give: c, m/N. With y = F^(1/3): c y^3 + h^(-2/3) y^2 = u, solved by
    Newton.
    """
    u = np.maximum(np.asarray(u, dtype=float), 0.0)
    dent = hertz ** (-2 / 3)
    # the lesser of the two laws alone bounds the root from above: Newton on this convex cubic falls onto it
    y = np.minimum(np.sqrt(u / dent), np.cbrt(u / max(give, 1e-12)))
    for _ in range(12):
        slope = 3 * give * y**2 + 2 * dent * y
        y = np.maximum(y - (give * y**3 + dent * y**2 - u) / np.maximum(slope, 1e-30), 0.0)
    return y**3


def fit_rise(
    travel: np.ndarray,
    force: np.ndarray,
    noise_n: float,
    *,
    guess_m: float,
    hertz: float | None = None,
) -> Rise:
    """Fit the law to samples of one approach and rise: travel (n,) m into the object, force (n,) N along it.

    guess_m: travel where a threshold saw the touch. hertz: held fixed where given. Robust (soft L1 at 3
    sigma).
    """
    top = float(force.max())
    reach = max(float(travel.max()) - guess_m, 1e-4)
    h0 = hertz or 1.5 * top / reach**1.5
    start = np.array([guess_m - 0.1 * reach, np.log(0.3 * reach / max(top, 1e-6)), np.log(h0)])
    free = 2 if hertz else 3

    def residual(p: np.ndarray) -> np.ndarray:
        h = hertz or float(np.exp(np.clip(p[2], -20, 30)))
        give = float(np.exp(np.clip(p[1], -25, 10)))
        return (contact_law(travel - p[0], h, give) - force) / noise_n

    low = np.array([travel.min() - 0.5 * reach, -25.0, start[2] - 6])
    high = np.array([guess_m + 0.5 * reach, 8.0, start[2] + 6])
    fit = least_squares(
        residual,
        np.clip(start[:free], low[:free] + 1e-9, high[:free] - 1e-9),
        bounds=(low[:free], high[:free]),
        x_scale=np.array([1e-3, 1.0, 1.0])[:free],
        loss="soft_l1",
        f_scale=3.0,
        max_nfev=60,
    )
    rms = float(np.sqrt(np.mean(residual(fit.x) ** 2)))
    try:
        covariance = np.linalg.inv(fit.jac.T @ fit.jac)
        error = float(np.sqrt(covariance[0, 0])) * max(rms, 1.0)
    except np.linalg.LinAlgError:
        error = float("nan")
    h = hertz or float(np.exp(fit.x[2]))
    return Rise(float(fit.x[0]), error, h, float(np.exp(fit.x[1])), rms * noise_n)
