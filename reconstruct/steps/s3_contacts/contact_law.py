"""First touch, estimated by fitting the contact law to the rise of the force.

A threshold comes late: a 5 mm tip on 16 kPa pushes back with 4 mN at 0.15 mm. The law of a sphere on a body
that gives as a whole, u - u0 = (F / h)^(2/3) + c F (Hertz and a linear far field), is fitted to free air and
rise alike. A loading without free air is carried back along the law that all loadings share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from palpate.mechanics.statistics import spread

_LEAST_COMPLIANCE = 1e-12
_NEWTON_STEPS = 8
_LEAST_SQUARES_STEPS = 60
_SOFT = 3.0  # standard deviations
_FAR_SHARE = 0.1
"""Of a depth, which the far field usually is; a factor of e is its standard deviation."""
_ALIKE = 0.1
"""Least spread of ln stiffness between places that is believed."""


@dataclass(frozen=True)
class Rise:
    """The fitted law of one press: u0_m, its standard error, h (N/m^1.5), c (m/N)."""

    u0_m: float
    u0_error_m: float
    hertz: float
    compliance: float


def contact_law(u: np.ndarray, hertz: float, compliance: float) -> np.ndarray:
    """Force F (N) at travel u (m) with u = (F / h)^(2/3) + c F, zero for u <= 0.

    hertz: h = 4/3 E* sqrt(R), N/m^1.5; compliance: c, m/N.
    """
    return _cube_root(np.asarray(u, dtype=float), hertz ** (-2 / 3), compliance) ** 3


def _cube_root(u: np.ndarray, dent: float, compliance: float) -> np.ndarray:
    """y = F^(1/3) of c y^3 + dent y^2 = u, by Newton; dent = h^(-2/3)."""
    u = np.maximum(u, 0.0)
    # the lesser of the two laws alone bounds the root from above: Newton on this convex cubic falls onto it
    y = np.minimum(np.sqrt(u / dent), np.cbrt(u / max(compliance, _LEAST_COMPLIANCE)))
    for _ in range(_NEWTON_STEPS):
        y -= (compliance * y**3 + dent * y**2 - u) / np.maximum(3 * compliance * y**2 + 2 * dent * y, 1e-30)
    return np.maximum(y, 0.0)


def fit_rise(travel: np.ndarray, force: np.ndarray, noise_n: float, *, guess_m: float) -> Rise:
    """Fit the law to samples of one approach and rise: travel (n,) m into the object, force (n,) N along it.

    guess_m: travel where a threshold saw the touch. Robust (soft L1 at 3 sigma).
    """
    top = float(force.max())
    reach = max(float(travel.max()) - guess_m, 1e-4)
    start = np.array([
        guess_m - 0.1 * reach, np.log(0.3 * reach / max(top, 1e-6)), np.log(1.5 * max(top, 1e-6) / reach**1.5)
    ])  # fmt: skip
    low = np.array([travel.min() - 0.5 * reach, -25.0, start[2] - 6])
    high = np.array([guess_m + 0.5 * reach, 8.0, start[2] + 6])

    # ours, not scipy.optimize.least_squares: 1.4 ms a press where that takes 7.5, on two fits a press
    p = np.clip(start, low + 1e-9, high - 1e-9)
    residual, slopes = _residual(p, travel, force, noise_n)
    cost, damping = _soft(residual)[0], 1e-3
    for _ in range(_LEAST_SQUARES_STEPS):
        weight = _soft(residual)[1]
        normal = (slopes * weight[:, None]).T @ slopes
        try:
            step = np.linalg.solve(
                normal + damping * np.diag(np.diag(normal)) + 1e-12 * np.eye(3),
                slopes.T @ (weight * residual),
            )
        except np.linalg.LinAlgError:  # a tip that stands still tells nothing of where it touched
            break
        trial = np.clip(p - step, low, high)
        trial_residual, trial_slopes = _residual(trial, travel, force, noise_n)
        trial_cost = _soft(trial_residual)[0]
        if trial_cost > cost:
            damping *= 6
            if damping > 1e8:
                break
            continue
        gained, damping = cost - trial_cost, damping / 6
        p, residual, slopes, cost = trial, trial_residual, trial_slopes, trial_cost
        if gained < 1e-6 * cost:
            break
    rms = float(np.sqrt(np.mean(residual**2)))
    normal = (slopes * _soft(residual)[1][:, None]).T @ slopes
    error = float(np.sqrt(np.linalg.pinv(normal)[0, 0])) * max(rms, 1.0)
    return Rise(float(p[0]), error, float(np.exp(p[2])), float(np.exp(p[1])))


def fit_offset(travel: np.ndarray, force: np.ndarray, noise_n: float) -> tuple[float, float, float]:
    """(offset N, h N/m^1.5, c m/N) of the law with its first touch at travel 0 (n,) m and a force (n,) N that
    is off by a constant."""
    reach, top = max(float(travel.max()), 1e-6), max(float(np.ptp(force)), noise_n)
    start = np.array([float(force.min()), np.log(1.5 * top / reach**1.5), np.log(_FAR_SHARE * reach / top)])

    def missed(p: np.ndarray) -> np.ndarray:
        return (p[0] + contact_law(travel, np.exp(p[1]), np.exp(p[2])) - force) / noise_n

    span = np.array([np.inf, 8.0, 8.0])
    found = least_squares(missed, start, bounds=(start - span, start + span), loss="soft_l1", f_scale=_SOFT)
    return float(found.x[0]), float(np.exp(found.x[1])), float(np.exp(found.x[2]))


def _residual(
    p: np.ndarray, travel: np.ndarray, force: np.ndarray, noise_n: float
) -> tuple[np.ndarray, np.ndarray]:
    """Residuals (n,) in standard deviations and their derivatives (n, 3) by u0, ln c and ln h."""
    compliance, dent = np.exp(p[1]), np.exp(-2 / 3 * p[2])
    y = _cube_root(travel - p[0], dent, compliance)
    # dF/du, of the same cubic; the other derivatives follow from du = y^3 dc + y^2 d(dent)
    slope = 3 * y / np.maximum(3 * compliance * y + 2 * dent, 1e-30)
    by = np.column_stack([-slope, -slope * compliance * y**3, slope * 2 / 3 * dent * y**2])
    return (y**3 - force) / noise_n, by / noise_n


def _soft(residual: np.ndarray) -> tuple[float, np.ndarray]:
    """Cost and weights (n,) of the soft L1 loss at three standard deviations."""
    root = np.sqrt(1 + (residual / _SOFT) ** 2)
    return float(np.sum(root - 1)), 1 / root


@dataclass(frozen=True)
class Loading:
    """One loading: travel u (m) inwards from `origin` along -normal and push (N), both (k,)."""

    u: np.ndarray
    push: np.ndarray
    origin: np.ndarray
    normal: np.ndarray


def first_touches(loadings: Sequence[Loading], noise_n: float) -> tuple[np.ndarray, np.ndarray]:
    """(k,) m, travel at which each loading would have met the surface, and its standard error.

    Each loading's own law where it has four rows; then the law that all of them share, which a single row is
    enough for, both weighed by their errors. Where none has four rows, the law is that of all together.
    Raises ValueError where even they tell none.
    """
    own = [_own(each, noise_n) for each in loadings]
    known = [r for r in own if r is not None and np.isfinite(r.u0_error_m)]
    if not known:
        known = [_pooled(loadings, noise_n)]
    # a law's two stiffnesses trade with one another, so laws are ranked by how deep they go at one force
    force = float(np.median([each.push.max() for each in loadings]))
    log = np.log([_depth(r, force) for r in known])
    weight = np.array([max(r.u0_error_m, 1e-9) for r in known]) ** -2.0
    order = np.argsort(log)
    total = np.cumsum(weight[order])
    law = known[order[np.searchsorted(total, 0.5 * total[-1])]]
    differ = max(_ALIKE, float(spread(log)) if len(log) > 3 else 0.0)
    shift, error = np.empty(len(loadings)), np.empty(len(loadings))
    for i, (each, rise) in enumerate(zip(loadings, own, strict=True)):
        values = [_shared(each, law, differ, noise_n)]
        if rise is not None and np.isfinite(rise.u0_error_m):
            values.append((rise.u0_m, max(rise.u0_error_m, 1e-9)))
        at, sd = np.array(values).T
        share = sd**-2.0 / (sd**-2.0).sum()
        shift[i] = share @ at
        # what the two disagree by is an error too
        error[i] = np.hypot((sd**-2.0).sum() ** -0.5, float(np.sqrt(share @ (at - shift[i]) ** 2)))
    return shift, error


def _own(each: Loading, noise_n: float) -> Rise | None:
    if len(each.u) < 4 or np.ptp(each.u) <= 0:
        return None
    top = max(float(each.push.max()), 1e-12)
    # F^(2/3) is nearly straight: its zero is a guess
    root = np.cbrt(np.maximum(each.push, 0) / top) ** 2
    high = root > 0.2
    slope, level = (
        np.polyfit(each.u[high], root[high], 1) if high.sum() > 1 and np.ptp(each.u[high]) > 0 else (0, 0)
    )
    guess = -level / slope if slope > 0 else each.u.min()
    guess = float(np.clip(guess, each.u.max() - 10 * np.ptp(each.u), each.u.max() - 0.05 * np.ptp(each.u)))
    return fit_rise(each.u, each.push, noise_n, guess_m=guess)


def _pooled(loadings: Sequence[Loading], noise_n: float) -> Rise:
    """The law that loadings of few rows share, each with a first touch of its own. Raises ValueError where
    they have no three rows more than first touches."""
    pushed = [(each.u[rows], each.push[rows]) for each in loadings if (rows := each.push > 3 * noise_n).any()]
    of = np.repeat(np.arange(len(pushed)), [len(u) for u, _ in pushed])
    if len(of) < len(pushed) + 3:
        raise ValueError("the places have too few rows in contact")
    u, push = (np.concatenate(column) for column in zip(*pushed, strict=True))
    top, reach = float(push.max()), max(float(np.ptp(each[0])) for each in pushed)

    def missed(log: np.ndarray) -> np.ndarray:
        law = Rise(0.0, 0.0, float(np.exp(log[0])), float(np.exp(log[1])))
        slope = (_depth(law, 1.01 * push) - _depth(law, push)) / (0.01 * push)
        weight = 1 / slope
        off = u - _depth(law, push)
        mean = np.bincount(of, weights=off * weight**2) / np.bincount(of, weights=weight**2)
        # places of alike depths tell one number: which share is the far field's is then the usual one
        return np.append((off - mean[of]) * weight / noise_n, log[1] - start[1])

    start = np.array([np.log(1.5 * top / reach**1.5), np.log(_FAR_SHARE * reach / top)])
    found = least_squares(missed, start, bounds=(start - 8, start + 8), loss="soft_l1", f_scale=_SOFT)
    return Rise(0.0, 0.0, float(np.exp(found.x[0])), float(np.exp(found.x[1])))


def _depth(law: Rise, push: float | np.ndarray) -> np.ndarray:
    """m, how deep a law is at forces of N."""
    return np.asarray((push / law.hertz) ** (2 / 3) + law.compliance * push)


def _shared(each: Loading, law: Rise, differ: float, noise_n: float) -> tuple[float, float]:
    """First touch by a given law, from the rows whose force is above its noise; its standard error."""
    used = each.push > max(3 * noise_n, 0.1 * float(each.push.max()))
    if not used.any():
        return float(each.u.min()), float(np.ptp(each.u)) + 1e-3
    push, u = each.push[used], each.u[used]
    depth = _depth(law, push)
    slope = (_depth(law, 1.01 * push) - depth) / (0.01 * push)
    by_noise = noise_n * float(np.median(slope)) / np.sqrt(len(push))
    return float(np.median(u - depth)), float(np.hypot(by_noise, differ * float(np.median(depth))))
