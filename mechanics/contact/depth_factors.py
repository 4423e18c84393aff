"""What a law's force at a place is multiplied by, along the depth, where presses are solved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.law_errors import Stiffness

_DEGREE = 3


@dataclass(frozen=True)
class DepthFactors:
    """Of k places. cubic: (k, 4) factor as a polynomial, ascending, in the depth over `deepest_m`.
    shallowest_m, deepest_m: (k,) m; beyond them the factor is as there. solved: (k,) bool; the others are 1.
    """

    cubic: np.ndarray
    shallowest_m: np.ndarray
    deepest_m: np.ndarray
    solved: np.ndarray

    @classmethod
    def none(cls, count: int) -> DepthFactors:
        """Factors of 1 at `count` places."""
        cubic = np.zeros((count, _DEGREE + 1))
        cubic[:, 0] = 1.0
        return cls(cubic, np.zeros(count), np.ones(count), np.zeros(count, dtype=bool))

    @classmethod
    def fitted(
        cls, count: int, presses: Mapping[int, tuple[np.ndarray, np.ndarray, np.ndarray]]
    ) -> DepthFactors:
        """Least squares, weighed by the force. presses: at some of `count` places, depths (d,) m, the law's
        and the solved force (d,) N."""
        found = cls.none(count)
        for place, (depth, law, solved) in presses.items():
            degree = min(_DEGREE, len(depth) - 1)
            at = np.polynomial.polynomial.polyfit(depth / depth[-1], solved / law, degree, w=law)
            found.cubic[place] = 0.0
            found.cubic[place, : degree + 1] = at
            found.shallowest_m[place], found.deepest_m[place] = depth[0], depth[-1]
            found.solved[place] = True
        return found

    def of(self, rows: slice | np.ndarray) -> DepthFactors:
        """Those of some places, in order."""
        return DepthFactors(
            self.cubic[rows], self.shallowest_m[rows], self.deepest_m[rows], self.solved[rows]
        )

    def law_error(self, usual: float | np.ndarray) -> np.ndarray:
        """(k,) standard error of the law as a share of the force: the usual one where nothing is solved."""
        return np.where(self.solved, np.minimum(usual, Stiffness.solved.value), usual)

    def at(self, place: np.ndarray, depth_m: np.ndarray) -> np.ndarray:
        """(n,) factors at places (n,) and depths (n,) m."""
        deepest, cubic = self.deepest_m[place], self.cubic[place]
        within = np.clip(depth_m, self.shallowest_m[place], deepest) / deepest
        return ((cubic[:, 3] * within + cubic[:, 2]) * within + cubic[:, 1]) * within + cubic[:, 0]
