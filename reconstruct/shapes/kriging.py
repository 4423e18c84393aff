"""What a fitted shape leaves unexplained, spread over its surface with its uncertainty (a Gaussian process).

The true surface lies g(p) outside the fitted one. Each touch measures g at its foot, up to an error; g is
smooth along the surface and says little across an edge (its covariance falls with distance and with the turn
of the normal). The shape's parameters stay uncertain beside it: their slopes enter the same covariance
(universal kriging), so that held-out errors and the uncertainty of places that nobody touched are in closed
form. Rasmussen & Williams, Gaussian Processes for Machine Learning, eqs. 2.25-2.26, 2.42 and 5.12.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from palpate.mechanics.statistics import matern_3_2, spread_about_zero
from palpate.reconstruction.shapes.fit import LEAN_SPREAD_M, OUTLINE_ERROR_M, ShapeEvidence, residuals
from palpate.reconstruction.shapes.shape import Shape, gradient, parameter_slopes

_TURN = 0.6
"""Covariance falls to 1/e^(1/2) where normals differ by this chord (0.6: 35 degrees)."""


@dataclass(frozen=True)
class FieldPrior:
    """Standard deviation of g on walls and on tops (m), its correlation length (m), and the touches' error
    (m)."""

    wall_m: float
    top_m: float
    length_m: float
    touch_m: float

    def covariance(self, p: np.ndarray, n: np.ndarray, q: np.ndarray, m: np.ndarray) -> np.ndarray:
        """(k, l) m^2 between g at points p (k, 3) with normals n and at q (l, 3) with normals m."""
        apart = ((p[:, None] - q) ** 2).sum(axis=2)
        turn = ((n[:, None] - m) ** 2).sum(axis=2) / _TURN**2
        variance = self.size(n)[:, None] * self.size(m)
        return matern_3_2(apart, self.length_m, variance=variance, fall=0.5 * turn)

    def size(self, n: np.ndarray) -> np.ndarray:
        """(k,) m, standard deviation of g where the normal is n (k, 3)."""
        top = np.clip((n[:, 2] - 0.5) / 0.4, 0, 1)
        return (1 - top) * self.wall_m + top * self.top_m


@dataclass(frozen=True)
class Explained:
    """A fitted shape with its residual field. lean_m: of the tracing. law: how large and how smooth g is."""

    shape: Shape
    seen: ShapeEvidence
    lean_m: float
    law: FieldPrior

    @property
    def free(self) -> bool:
        """Whether a residual field is used at all."""
        return max(self.law.wall_m, self.law.top_m) > 1e-6

    @property
    def complexity(self) -> int:
        """Assumptions: the shape's, and three more for a free field."""
        return self.shape.complexity + 3 * self.free

    @property
    def name(self) -> str:
        """The shape's name, with '+' where a free field corrects it."""
        return self.shape.name + ("+" if self.free else "")

    @cached_property
    def gap(self) -> np.ndarray:
        """(m + k,) m: how far the true surface lies outside the shape, seen at each touch and outline
        point."""
        return np.concatenate(residuals(self.shape, self.seen, self.lean_m))

    @cached_property
    def feet(self) -> tuple[np.ndarray, np.ndarray]:
        """Surface points and normals (m + k, 3) of all touches."""
        centres = np.vstack([self.seen.centres, self.seen.outline])
        normals = gradient(self.shape, centres)
        return centres - (self.seen.tip_radius_m + self.gap[:, None]) * normals, normals

    @cached_property
    def slopes(self) -> np.ndarray:
        """(m + k, p + 1) of the gap with each parameter, in its prior standard deviations, and with the
        lean."""
        centres = np.vstack([self.seen.centres, self.seen.outline])
        spread = np.array([p.spread for p in self.shape.parameters])
        lean = np.concatenate([np.zeros(len(self.seen.centres)), np.ones(len(self.seen.outline))])
        # an outline that folds has slopes without end: no gap changes by more than a metre
        slopes = np.clip(parameter_slopes(self.shape, centres) * spread, -1.0, 1.0)
        return np.column_stack([slopes, lean * LEAN_SPREAD_M])

    @cached_property
    def _matrix(self) -> np.ndarray:
        error = np.concatenate(
            [
                np.hypot(self.seen.error_m, self.law.touch_m),
                np.full(len(self.seen.outline), np.hypot(OUTLINE_ERROR_M, self.law.touch_m)),
            ]
        )
        return self.law.covariance(*self.feet, *self.feet) + self.slopes @ self.slopes.T + np.diag(error**2)

    @cached_property
    def _factor(self) -> tuple[np.ndarray, bool]:
        return cho_factor(self._matrix, lower=True)

    @cached_property
    def log_likelihood(self) -> float:
        """Of all gaps, with the parameters and g integrated out."""
        return float(
            -0.5 * self.gap @ cho_solve(self._factor, self.gap) - np.log(np.diag(self._factor[0])).sum()
        )

    @cached_property
    def held_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Per place, predicted without it: root mean square error (m) of its touches that are not bad, and
        log density."""
        inverse = cho_solve(self._factor, np.eye(len(self.gap)))
        weighted = inverse @ self.gap
        error, density = [], []
        far = max(_FAR_M, float(np.median(self.seen.error_m)))
        for site in np.unique(self.seen.sites):
            own = np.flatnonzero(self.seen.sites == site)
            block = inverse[np.ix_(own, own)]
            miss = np.linalg.solve(block, weighted[own])
            good = self.seen.error_m[own] <= far
            if good.any():
                error.append(np.sqrt(np.mean(miss[good] ** 2)))
            # Gaussian, but a miss beyond four deviations counts linearly: one bad press must not decide
            square = miss @ block @ miss / len(own)
            square = min(square, 8 * np.sqrt(max(square, 1e-12)) - 16) if square > 16 else square
            logdet = np.linalg.slogdet(block)[1] / len(own)
            density.append(-0.5 * square + 0.5 * logdet)
        return np.array(error), np.array(density)

    @cached_property
    def misses(self) -> np.ndarray:
        """(m,) m, error of each touch as all the others predict it (repeats at its place included)."""
        inverse = cho_solve(self._factor, np.eye(len(self.gap)))
        return ((inverse @ self.gap) / np.diag(inverse))[: len(self.seen.centres)]

    def field(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far the true surface lies outside the shape at its points (k, 3) with normals: mean m, variance
        m^2."""
        slopes, across = self._across(points, normals)
        own = self.law.size(normals) ** 2 + (slopes**2).sum(axis=1)
        variance = own - np.einsum("ij,ji->i", across, cho_solve(self._factor, across.T))
        return across @ cho_solve(self._factor, self.gap), np.maximum(variance, 0.0)

    def mean(self, points: np.ndarray, normals: np.ndarray, gap: np.ndarray) -> np.ndarray:
        """The field's mean (k,) m if the touches and the outline had these gaps (m + k,)."""
        return self._across(points, normals)[1] @ cho_solve(self._factor, gap)

    def _across(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        spread = np.array([p.spread for p in self.shape.parameters])
        # asked a little outside, where the shapes' distances are right
        slopes = parameter_slopes(self.shape, points + 1e-4 * normals) * spread
        return slopes, self.law.covariance(points, normals, *self.feet) + slopes @ self.slopes[:, :-1].T


_FAR, _FAR_M, _BAD_AT_MOST = 6.0, 0.0006, 0.15
"""A touch is bad that lies six typical deviations and 0.6 mm off, if they are at most 15 % of all."""

_TOUCH_M = (2e-5, 1e-4, 3e-4, 1e-3)
_FIELD_M = (0.0003, 0.001, 0.003, 0.01)
_LENGTH_M = (0.02, 0.04, 0.08)


def explain(shape: Shape, lean_m: float, seen: ShapeEvidence, *, free: bool) -> Explained:
    """The residual field of greatest likelihood; without one (free false) only the touches' error is sought.

    Touches that lie far off while all others agree are given their own error, so that a bad press neither
    bends the surface nor counts against a shape more than once.
    """
    found = _explain(shape, lean_m, seen, free=free)
    touches = len(seen.centres)
    miss = found.misses if free else found.gap[:touches]
    typical = spread_about_zero(miss)
    bad = np.abs(miss) > max(_FAR * typical, _FAR_M)
    if not 0 < bad.sum() <= _BAD_AT_MOST * touches:
        return found
    error = np.where(bad, np.maximum(np.abs(miss), seen.error_m), seen.error_m)
    return _explain(shape, lean_m, replace(seen, error_m=error), free=free)


def _explain(shape: Shape, lean_m: float, seen: ShapeEvidence, *, free: bool) -> Explained:
    start = Explained(shape, seen, lean_m, FieldPrior(0.0, 0.0, 0.03, _TOUCH_M[0]))
    shared = {name: getattr(start, name) for name in ("gap", "feet", "slopes")}

    def with_law(law: FieldPrior) -> Explained:
        found = replace(start, law=law)
        found.__dict__.update(shared)
        return found

    if not free:
        return max(
            (with_law(FieldPrior(0.0, 0.0, 0.03, t)) for t in _TOUCH_M), key=lambda e: e.log_likelihood
        )
    best = with_law(FieldPrior(_FIELD_M[1], _FIELD_M[1], _LENGTH_M[1], _TOUCH_M[1]))
    for _ in range(3):
        before = best.law
        for name, levels in (
            ("both", _FIELD_M),
            ("length_m", _LENGTH_M),
            ("touch_m", _TOUCH_M),
            ("top_m", (*_FIELD_M, 1e-5) if shape.faceted else ()),
            ("wall_m", (*_FIELD_M, 1e-5) if shape.faceted else ()),
        ):
            for level in levels:
                change = {"wall_m": level, "top_m": level} if name == "both" else {name: level}
                trial = with_law(replace(best.law, **change))
                if trial.log_likelihood > best.log_likelihood:
                    best = trial
        if best.law == before:
            break
    return best
