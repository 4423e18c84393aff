"""A smooth field of stiffness: a Gaussian process of the logarithm of Young's modulus over an object.

Few numbers say how it varies: standard deviation, and length over which places are alike (Matern 5/2). What
is unknown are its values at places that are spread over the object, the touched ones first; between them it
is kriged. A press tells of a weighted mean of the field, by the share of its compliance that lies in each
element and under its tip (`Shares`), so that depth is resolved as far as presses resolve it. Standard
deviation, length, and how much places scatter without any field, are those of the greatest restricted
likelihood.
Source: Rasmussen and Williams, Gaussian Processes for Machine Learning, chapters 2, 4, 5 and 8.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist

from palpate.mechanics.statistics import matern_5_2

LEAST_LENGTH_M = 0.003
LENGTHS = 9
"""Lengths that are tried, from half the touched places' spacing to one and a half times the object's size."""
INNER_PLACES = 40
"""At most, inside the object, beside the touched ones."""
TIP_DEPTH_IN_RADII = 0.5
"""Below the surface, where a dent's own modulus is taken: about the middle of its strain energy."""
_JITTER = 1e-8
_SD_LIMITS = (0.01, 2.0)
_SCATTER_LIMITS = (0.003, 1.0)


@dataclass(frozen=True)
class SmoothField:
    """places: (c, 3) m. log_ratio: (c,) of the modulus there over the object's. length_m: of the kernel."""

    places: np.ndarray
    log_ratio: np.ndarray
    length_m: float

    def at(self, points: np.ndarray) -> np.ndarray:
        """(k,) log ratio at points (k, 3) m: kriged, and 0 (the object's own modulus) far from all places."""
        own = correlation(self.places, self.places, self.length_m) + _JITTER * np.eye(len(self.places))
        weights = cho_solve(cho_factor(own), self.log_ratio)
        return correlation(points, self.places, self.length_m) @ weights


@dataclass(frozen=True)
class Shares:
    """Of how p presses tell of a field: nodes (k, 3) m, where it counts, and weight (p, k) of each, rows sum
    to 1."""

    nodes: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class Views:
    """How p presses see the values of a field at places (c, 3) m, for each of l lengths that are tried.

    drawn: (l, p, c), kriged to the nodes and summed by the presses' shares. own: (l, c, c) correlation of the
    places. What presses felt is not in it: fits to some of them share it.
    """

    places: np.ndarray
    lengths_m: np.ndarray
    drawn: np.ndarray
    own: np.ndarray

    def of(self, presses: np.ndarray) -> Views:
        """Of some of the presses, by number."""
        return replace(self, drawn=self.drawn[:, presses])


@dataclass(frozen=True)
class Prior:
    """Of a field: log_sd, its standard deviation; length_m; scatter: of places beside it, from one to
    another."""

    log_sd: float
    length_m: float
    scatter: float


@dataclass(frozen=True)
class FieldEstimate:
    """A field from presses.

    prior: the likeliest. gain: log likelihood by which it is likelier than places that scatter at random.
    site: (s,) numbers of the sites. left_out: (s,) what each differs from the others' prediction of it, in
    log modulus; scattered: (s,) the same where no field is taken. foretold: (s,) ln of that prediction.
    level, level_sd: ln of the object's modulus, and its standard error.
    field: its mean. covariance: (c, c) of ln E at its places. felt: standard deviation of ln E that the field
    says from site to site.
    """

    prior: Prior
    gain: float
    site: np.ndarray
    left_out: np.ndarray
    scattered: np.ndarray
    foretold: np.ndarray
    level: float
    level_sd: float
    field: SmoothField
    covariance: np.ndarray
    felt: float

    @property
    def sd(self) -> np.ndarray:
        """(c,) standard deviation of ln E at the field's places."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def explained(self) -> float:
        """Share of the sites' scatter that the field predicts at sites that were left out."""
        return 1 - float((self.left_out**2).sum() / max((self.scattered**2).sum(), 1e-300))


def correlation(a: np.ndarray, b: np.ndarray, length_m: float) -> np.ndarray:
    """(n, k) of points a (n, 3) and b (k, 3) m: Matern 5/2."""
    return matern_5_2(cdist(a, b), length_m)


def kriging(points: np.ndarray, places: np.ndarray, length_m: float) -> np.ndarray:
    """(k, c) by which values at places (c, 3) give those at points (k, 3)."""
    own = correlation(places, places, length_m) + _JITTER * np.eye(len(places))
    return cho_solve(cho_factor(own), correlation(places, points, length_m)).T


def places_of(touched: np.ndarray, inside: np.ndarray, most: int = INNER_PLACES) -> np.ndarray:
    """(c, 3) m: the touched places (q, 3), and of `inside` (m, 3) those farthest from all before.

    Inner places come no closer to others than half the touched ones' spacing.
    """
    least = 0.5 * spacing(touched)
    chosen = list(touched)
    away = cdist(inside, touched).min(axis=1)
    for _ in range(min(most, len(inside))):
        farthest = int(np.argmax(away))
        if away[farthest] < least:
            break
        chosen.append(inside[farthest])
        away = np.minimum(away, np.linalg.norm(inside - inside[farthest], axis=1))
    return np.array(chosen)


def spacing(points: np.ndarray) -> float:
    """m, median distance of points (q, 3) to their nearest neighbour."""
    if len(points) < 2:
        return LEAST_LENGTH_M
    apart = cdist(points, points) + np.diag(np.full(len(points), np.inf))
    return float(np.median(apart.min(axis=1)))


def views_of(shares: Shares, places: np.ndarray, lengths_m: np.ndarray) -> Views:
    """What presses of these shares see of places (c, 3) m."""
    apart, own = cdist(shares.nodes, places), []
    drawn = np.empty((len(lengths_m), len(shares.weight), len(places)))
    for k, length in enumerate(lengths_m):
        own.append(correlation(places, places, length))
        # the presses' sums before the kriging, as presses are fewer than nodes
        summed = shares.weight @ matern_5_2(apart, length)
        drawn[k] = cho_solve(cho_factor(own[k] + _JITTER * np.eye(len(places))), summed.T).T
    return Views(places, np.asarray(lengths_m, dtype=float), drawn, np.array(own))


def estimate(log_modulus: np.ndarray, error: np.ndarray, site: np.ndarray, views: Views) -> FieldEstimate:
    """The likeliest field of presses whose own moduli are known.

    log_modulus: (p,) of each press, as if the object were of one modulus. error: (p,) standard error.
    site: (p,) number of its place; presses of one site share that place's own scatter. views: of the presses.
    """
    y, cover, mean = _by_site(log_modulus, error, site)
    places, flat = views.places, np.zeros((len(y), len(y)))
    nothing = _searched(y, cover, flat, (np.log(0.05),))
    best = None
    for length, seen, own in zip(views.lengths_m, views.drawn, views.own, strict=True):
        drawn = mean @ seen
        kernel = drawn @ own @ drawn.T
        found = _searched(y, cover, kernel, (np.log(0.2), np.log(0.05)))
        if best is None or found[0] > best[0]:
            best = (*found, length, drawn, own, kernel)
    assert best is not None
    likelihood, (log_sd, scatter), length, drawn, own, kernel = best
    whole = cover + scatter**2 * np.eye(len(y)) + log_sd**2 * kernel
    level, inverse, rest = _levelled(y, whole)
    shared = log_sd**2 * own @ drawn.T
    likeliest = shared @ rest
    # of ln E, whose level is unknown as well
    precise = np.linalg.inv(whole)
    unlevelled = 1 - shared @ precise.sum(axis=1)
    covariance = log_sd**2 * own - shared @ precise @ shared.T
    covariance = covariance + np.outer(unlevelled, unlevelled) / precise.sum()
    apart = cover + nothing[1][0] ** 2 * np.eye(len(y))
    _, plain, plain_rest = _levelled(y, apart)
    left_out = rest / _left_out_weight(inverse)
    return FieldEstimate(
        Prior(float(log_sd), float(length), float(scatter)),
        float(likelihood - nothing[0]),
        np.unique(site),
        left_out,
        plain_rest / _left_out_weight(plain),
        y - left_out,
        float(level),
        float(1 / np.sqrt(precise.sum())),
        SmoothField(places, likeliest, float(length)),
        covariance,
        float(np.std(drawn @ likeliest)),
    )


def _by_site(y: np.ndarray, error: np.ndarray, site: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(value (s,), covariance (s, s), weights (s, p) of the presses) of the sites' means by precision."""
    names, number = np.unique(site, return_inverse=True)
    precision = 1 / error**2
    total = np.bincount(number, weights=precision)
    mean = np.zeros((len(names), len(y)))
    mean[number, np.arange(len(y))] = precision / total[number]
    return mean @ y, np.diag(1 / total), mean


def lengths_of(touched: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """(LENGTHS,) m, to be tried where places (q, 3) were touched on an object of nodes (k, 3)."""
    size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    return np.geomspace(max(0.5 * spacing(touched), LEAST_LENGTH_M), 1.5 * size, LENGTHS)


def _searched(
    y: np.ndarray, cover: np.ndarray, kernel: np.ndarray, start: tuple[float, ...]
) -> tuple[float, tuple[float, ...]]:
    """(log likelihood, (log_sd, scatter) or (scatter,)) at its greatest; restricted, so that the level is
    free."""
    from scipy.optimize import minimize  # here: to render a field needs none

    field = len(start) == 2
    limits = [np.log(_SD_LIMITS)] * field + [np.log(_SCATTER_LIMITS)]

    def worse(x: np.ndarray) -> float:
        whole = cover + np.exp(2 * x[-1]) * np.eye(len(y))
        if field:
            whole = whole + np.exp(2 * x[0]) * kernel
        try:
            factor = cho_factor(whole, lower=True)
        except np.linalg.LinAlgError:
            return 1e9
        ones = cho_solve(factor, np.ones(len(y)))
        total = ones.sum()
        rest = y - (ones @ y) / total
        return float(
            np.log(np.diag(factor[0])).sum() + 0.5 * np.log(total) + 0.5 * rest @ cho_solve(factor, rest)
        )

    found = minimize(
        worse, start, method="Nelder-Mead", bounds=limits, options={"xatol": 0.02, "fatol": 0.01}
    )
    return -float(found.fun), tuple(float(v) for v in np.exp(found.x))


def _levelled(y: np.ndarray, whole: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """(level, inverse with the level projected out (s, s), that of y (s,))."""
    inverse = np.linalg.inv(whole)
    ones = inverse.sum(axis=1)
    level = float(ones @ y / ones.sum())
    projected = inverse - np.outer(ones, ones) / ones.sum()
    return level, projected, projected @ y


def _left_out_weight(projected: np.ndarray) -> np.ndarray:
    """(s,) by which the weighed residuals of a fit of all become those of each left out."""
    return np.maximum(np.diag(projected), 1e-300)
