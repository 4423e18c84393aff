"""How far a tip has gone around the foot of an object on its support."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.model.model import Model
from palpate.window.worker import level

SECTORS = 72
ENOUGH = 0.95
NEAR_M = 0.002
_SPACING_M = 0.0005


class BaseTracing:
    """Counts the directions, seen from the base's middle, in which the tip stood at the foot on the support.

    first, last: numbers of the first and the last tip that counted, None before there is one; later ones
    than those that closed the way around do not count. off_m: how far the tip last slid from the foot, where
    that was too far to count.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        base = model.mesh.points[model.mesh.fixed]
        self._middle = base.mean(axis=0)
        up = model.support.normal
        self._axes = np.column_stack([level(up), np.cross(up, level(up))])
        self._points = _outline(model)
        flat = (self._points - self._middle) @ self._axes
        self._foot, self._sector = cKDTree(flat), _sector(flat)
        self._seen = np.zeros(SECTORS, dtype=bool)
        self.first: int | None = None
        self.last: int | None = None
        self.off_m = 0.0

    def add(self, tips_m: np.ndarray, numbers: np.ndarray) -> None:
        """(n, 3) m, centres of the tip, and (n,) what each is counted by."""
        if self.done or not len(tips_m):
            return
        model = self._model
        height = model.support.height(tips_m)
        low = np.flatnonzero(height < model.tool.tip_radius_m)
        away = (tips_m[low] - self._middle) @ self._axes
        if not len(low):
            return
        off = self._foot.query(away)[0] - model.tool.tip_radius_m
        near = off < NEAR_M
        self.off_m = 0.0 if near.any() else float(off.min())
        at_foot, away = low[near], away[near]
        if not len(at_foot):
            return
        self._seen[_sector(away)] = True
        self.first = int(numbers[at_foot[0]]) if self.first is None else self.first
        self.last = int(numbers[at_foot[-1]])

    @property
    def foot(self) -> tuple[np.ndarray, np.ndarray]:
        """(k, 3) m, points along the foot, and (k,) whether the tip went past them."""
        return self._points, self._seen[self._sector]

    @property
    def share(self) -> float:
        """Of the way around, 0 to 1."""
        return float(self._seen.mean())

    @property
    def done(self) -> bool:
        """Enough to reconstruct the base from."""
        return self.share >= ENOUGH


def _sector(flat: np.ndarray) -> np.ndarray:
    """(n,) number of the direction in which (n, 2) lie."""
    return (np.arctan2(flat[:, 1], flat[:, 0]) / (2 * np.pi) * SECTORS).astype(int) % SECTORS


def _outline(model: Model) -> np.ndarray:
    """(k, 3) m, points close to one another along the rim of the base."""
    triangles = model.mesh.surface[:, :3]
    base = triangles[model.mesh.fixed[triangles].all(axis=1)]
    edges = np.sort(np.concatenate([base[:, [0, 1]], base[:, [1, 2]], base[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    ends = model.mesh.points[unique[count == 1]]
    steps = max(2, int(np.ceil(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max() / _SPACING_M)))
    share = np.linspace(0.0, 1.0, steps)[:, None, None]
    return ((1.0 - share) * ends[:, 0] + share * ends[:, 1]).reshape(-1, 3)
