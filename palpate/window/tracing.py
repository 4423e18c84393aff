"""Whether a session has traced the object's base: the tip went all around it on the support."""

from __future__ import annotations

import numpy as np

from mechanics.model import Model

SECTORS = 72
ENOUGH = 0.9


class BaseTracing:
    """Counts the directions, seen from the base's middle, in which the tip stood on the support."""

    def __init__(self, model: Model) -> None:
        self._model = model
        base = model.mesh.points[model.mesh.fixed]
        self._middle = base.mean(axis=0)
        up = model.support_normal
        self._e1 = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
        self._e1 /= np.linalg.norm(self._e1)
        self._e2 = np.cross(up, self._e1)
        self._reach = 2.0 * np.linalg.norm(base - self._middle, axis=1).max()
        self._seen = np.zeros(SECTORS, dtype=bool)

    def add(self, tips_m: np.ndarray) -> None:
        """(n, 3) m, centres of the tip."""
        if not len(tips_m):
            return
        model = self._model
        height = (tips_m - model.support_point) @ model.support_normal
        away = tips_m - self._middle
        x, y = away @ self._e1, away @ self._e2
        near = (height < model.tip_radius_m) & (np.hypot(x, y) < self._reach)
        sector = (np.arctan2(y[near], x[near]) / (2 * np.pi) * SECTORS).astype(int) % SECTORS
        self._seen[sector] = True

    @property
    def share(self) -> float:
        """Of the way around, 0 to 1."""
        return float(self._seen.mean())

    @property
    def done(self) -> bool:
        """Enough to reconstruct the base from."""
        return self.share >= ENOUGH
