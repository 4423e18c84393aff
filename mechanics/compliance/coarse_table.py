"""The compliance of an object of which some places are solved: what they tell of all the others.

The far field is smooth over a surface: kriged between some two hundred places that lie as far from one
another as they can, it serves for a first touch. Where all that counts for a triangle is solved, it is the
very number of mechanics.compliance.surface_compliance, to the bit.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial import cKDTree

from palpate.mechanics.compliance.fine_corners import less_half_space, linear_at
from palpate.mechanics.compliance.on_demand import OnDemandCompliance
from palpate.mechanics.compliance.smooth_field import correlation, spacing
from palpate.mechanics.errors import MeshError
from palpate.mechanics.shape.nearest import closest, farthest_apart

PLACES = 200
"""By which a first table is made."""
_LENGTH_IN_SPACINGS, _JITTER = 2.0, 1e-6
_SIX = np.triu_indices(3)
_ROWS = 2000  # kriged at once


class CoarseCompliance:
    """nodes, own_points, own_normals, own_triangles, own_width_m, poisson_ratio, blocks, factor: those of
    OnDemandCompliance. known: (n,) numbers of the corners that are solved. first: (p,) those of
    `first_places`. rough: that of OnDemandCompliance.

    A snapshot of `solved`, whose first places must be known: raises MeshError where they are not.
    """

    def __init__(self, solved: OnDemandCompliance) -> None:
        self.rough = solved.rough
        self.nodes, self.poisson_ratio = solved.nodes, solved.poisson_ratio
        self.own_points, self.own_normals = solved.own_points, solved.own_normals
        self.own_triangles, self.own_width_m = solved.own_triangles, solved.own_width_m
        self.blocks, self.factor = solved.blocks, solved.factor
        self._solved = solved
        self.known = np.flatnonzero(solved.is_solved)
        self.first = first_places(solved.own_points)
        if not solved.is_solved[self.first].all():
            raise MeshError("a coarse table needs its first places solved: solve them before")
        points, normals = self.own_points[self.known], self.own_normals[self.known]
        self._far = less_half_space(
            solved.own[self.known], normals, float(self.poisson_ratio[0]), float(self.own_width_m[0])
        )
        self._length_m = _LENGTH_IN_SPACINGS * spacing(self.own_points[self.first])
        alike = _alike(points, normals, points, normals, self._length_m)
        alike[np.diag_indices(len(alike))] += _JITTER
        factor = cho_factor(alike)
        self._inverse = cho_solve(factor, np.eye(len(alike)))
        six = self._far[:, _SIX[0], _SIX[1]]
        ones = self._inverse.sum(axis=1)
        self._level = ones @ six / ones.sum()
        self._weights = self._inverse @ (six - self._level)
        unsolved = np.flatnonzero(~solved.is_solved)
        self._bracing = np.array(solved.own_bracing)
        self._bracing[unsolved] = self._bracing[
            self.known[cKDTree(points).query(self.own_points[unsolved])[1]]
        ]
        self._ready = solved.ready()

    @property
    def solved_share(self) -> float:
        """Of all corners, those that are solved."""
        return len(self.known) / len(self.own_points)

    def far_at(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(k, 3, 3) 1/m at surface points (k, 3) with normals (k, 3): `SurfaceCompliance.far_at` where that
        is known, else kriged."""
        points, normals = np.atleast_2d(points), np.atleast_2d(normals)
        triangle = closest(self.own_points, self.own_triangles, points)[1]
        ready = self._ready[triangle]
        far = np.empty((len(points), 3, 3))
        if ready.any():
            far[ready] = self._solved.far_at(points[ready], normals[ready])
        rest = np.flatnonzero(~ready)
        for start in range(0, len(rest), _ROWS):
            rows = rest[start : start + _ROWS]
            alike = _alike(
                points[rows],
                normals[rows],
                self.own_points[self.known],
                self.own_normals[self.known],
                self._length_m,
            )
            far[rows] = _tensor(self._level + alike @ self._weights)
        return far

    def bracing_at(self, points: np.ndarray) -> np.ndarray:
        """(k,) 1/m, as SurfaceCompliance has it; of corners that are not solved that of the nearest one that
        is."""
        return linear_at(points, self.own_points, self.own_triangles, self._bracing)

    def left_out(self) -> tuple[np.ndarray, np.ndarray]:
        """(p, 3, 3) each, 1/m, at the `first` places: the far field, and what the others alone tell of it;
        the same two where all around a place is solved."""
        projected = self._inverse - np.outer(self._inverse.sum(axis=1), self._inverse.sum(axis=1)) / max(
            float(self._inverse.sum()), 1e-300
        )
        rows = np.searchsorted(self.known, self.first)
        six = self._far[:, _SIX[0], _SIX[1]]
        missed = (projected[rows] @ six) / np.maximum(np.diag(projected)[rows], 1e-300)[:, None]
        around = np.ones(len(self.own_points), dtype=bool)
        around[self.own_triangles[~self._ready].ravel()] = False
        missed[around[self.first]] = 0.0
        return self._far[rows], self._far[rows] - _tensor(missed)

    def displacement(self, corner: int, force: np.ndarray) -> np.ndarray:
        """(t, 3) m Pa: nothing is known between places."""
        return np.zeros((len(self.nodes), 3))


def first_places(points: np.ndarray) -> np.ndarray:
    """(p,) ascending numbers of at most PLACES of points (v, 3), each the farthest from those before."""
    return np.sort(farthest_apart(points, PLACES))


def _alike(
    a: np.ndarray, a_normals: np.ndarray, b: np.ndarray, b_normals: np.ndarray, length_m: float
) -> np.ndarray:
    """Correlation (n, k) of the far fields of places: near one another and facing alike."""
    return correlation(a, b, length_m) * (1 + a_normals @ b_normals.T) / 2


def _tensor(six: np.ndarray) -> np.ndarray:
    """(k, 3, 3) of the upper triangles (k, 6)."""
    tensor = np.empty((len(six), 3, 3))
    tensor[:, _SIX[0], _SIX[1]] = tensor[:, _SIX[1], _SIX[0]] = six
    return tensor
