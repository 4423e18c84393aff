"""The compliance of an object where it is asked for: solved place by place, kept beside the MODEL.

What is solved are entries of the table of mechanics.compliance.surface_compliance, to the bit. There is no
table between places: one tip needs none.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from palpate.mechanics.compliance.compression import unit_loads
from palpate.mechanics.compliance.fine_corners import (
    EdgeMiddles,
    FineCorners,
    corners_of,
    interpolated,
    less_half_space,
    linear_at,
)
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.compliance.sites import patch_width
from palpate.mechanics.disk.store import read_arrays, write_arrays
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import CacheError
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import closest
from palpate.mechanics.shape.tetmesh import TetMesh

_NO_BLOCKS = np.zeros((0, 0, 3, 3), dtype=np.float32)
_KEPT = ("own_points", "own_normals", "own_triangles", "own_width_m", "own", "own_bracing")
_NO_FACTOR = np.zeros((0, 3, 0), dtype=np.float32)


class OnDemandCompliance:
    """nodes, own_points, own_normals, own_triangles, own_width_m, poisson_ratio, blocks, factor: those of
    SurfaceCompliance, the last two of no size; own: (v, 3, 3), own_bracing: (v,) 1/m, NaN where nothing was
    asked for yet.

    key: of all that the numbers depend on. fine: factorises; called when something is to be solved, and what
    it gives is kept for the last object alone. coarse: factorises the mesh itself. path: of the file that
    keeps what was solved, or None. rough: share of a force by which the elements that it is solved on miss
    finer ones, at 95 % of places.
    """

    blocks, factor = _NO_BLOCKS, _NO_FACTOR

    def __init__(
        self,
        mesh: TetMesh,
        poisson_ratio: float,
        fine: Callable[[], FineCorners],
        coarse: Callable[[], Solver],
        key: str,
        path: Path | None,
        rough: float = 0.0,
    ) -> None:
        self.rough = rough
        self.nodes = corners_of(mesh.quadratic())[0]
        self.poisson_ratio = np.array([float(poisson_ratio)])
        self._make_fine, self._make_coarse, self._key, self._path = fine, coarse, key, path
        arrays = self._kept()
        if not arrays:
            made = self._fine
            own, width = np.full((len(made.points), 3, 3), np.nan), np.array([made.width_m])
            new = (made.points, made.normals, made.triangles, width, own, own[:, 0, 0])
            arrays = dict(zip(_KEPT, new, strict=True))
        self.own_points, self.own_normals = arrays["own_points"], arrays["own_normals"]
        self.own_triangles, self.own_width_m = arrays["own_triangles"], arrays["own_width_m"]
        self.own, self.own_bracing = np.array(arrays["own"]), np.array(arrays["own_bracing"])
        self._middles: dict[int, np.ndarray] = {}

    def far_at(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """`SurfaceCompliance.far_at`, to the bit; what it needs is solved where it is not yet."""
        points, normals = np.atleast_2d(points), np.atleast_2d(normals)
        _, triangle, weights = closest(self.own_points, self.own_triangles, points)
        met = np.unique(triangle)
        new = np.array([t for t in met if t not in self._middles], dtype=np.int64)
        if len(new):
            self.solve(np.unique(np.concatenate([self._edges.corners(t) for t in new])))
            self._middles.update(zip(new.tolist(), self._edges(self.own, new), strict=True))
        middles = np.array([self._middles[t] for t in met])[np.searchsorted(met, triangle)]
        own = interpolated(self.own[self.own_triangles[triangle]], middles, weights)
        return less_half_space(own, normals, float(self.poisson_ratio[0]), float(self.own_width_m[0]))

    def bracing_at(self, points: np.ndarray) -> np.ndarray:
        """`SurfaceCompliance.bracing_at`, to the bit, of points that `far_at` was asked for."""
        return linear_at(points, self.own_points, self.own_triangles, self.own_bracing)

    @property
    def is_solved(self) -> np.ndarray:
        """(v,) bool, the corners that are."""
        return ~np.isnan(self.own[:, 0, 0])

    def ready(self) -> np.ndarray:
        """(g,) bool, the triangles of which `far_at` has nothing to solve."""
        solved = self.is_solved
        return np.array([bool(solved[corners].all()) for corners in self._around])

    def displacement(self, corner: int, force: np.ndarray) -> np.ndarray:
        """(t, 3) m Pa: motion of all corners for a force (3,) N on the object at one, times the modulus."""
        solver, average = self._between
        loads = unit_loads(average[corner : corner + 1])[:, :, 0] @ np.asarray(force, dtype=float)
        return average @ solver.solve(loads)

    @property
    def _fine(self) -> FineCorners:
        if self._key not in _last:
            _last.clear()
            _last[self._key] = self._make_fine()
        return _last[self._key]

    @cached_property
    def _edges(self) -> EdgeMiddles:
        return EdgeMiddles(self.own_points, self.own_triangles)

    @cached_property
    def _around(self) -> list[np.ndarray]:
        """The corners whose values count for each triangle."""
        return [self._edges.corners(t) for t in range(len(self.own_triangles))]

    @cached_property
    def _between(self) -> tuple[Solver, sp.csr_matrix]:
        """The mesh's own solver and the patches (t, n) of its corners."""
        solver = self._make_coarse()
        sampler = PatchSampler(solver.mesh, patch_width(solver.mesh))
        return solver, sampler.matrix(solver.mesh.points[self.nodes])

    def solve(self, corners: np.ndarray, progress: Progress = silent) -> None:
        """Solve those of the corners that are not solved yet, and keep them."""
        new = corners[np.isnan(self.own[corners, 0, 0])]
        if not len(new):
            return
        self.own[new], self.own_bracing[new] = self._fine.own(new, progress)
        kept = self._kept()
        if kept:  # what another process added meanwhile
            more = np.isnan(self.own[:, 0, 0]) & ~np.isnan(kept["own"][:, 0, 0])
            self.own[more], self.own_bracing[more] = kept["own"][more], kept["own_bracing"][more]
        arrays = {name: getattr(self, name) for name in _KEPT}
        if self._path is None:
            _unwritten.clear()
            _unwritten[self._key] = arrays
            return
        with suppress(OSError):  # a full or read-only disk: the numbers in memory serve as well
            write_arrays(self._path, self._key, arrays)

    def _kept(self) -> dict[str, np.ndarray]:
        """The arrays that were kept; none where they are absent, damaged or of other content."""
        if self._path is None:
            return _unwritten.get(self._key, {})
        try:
            return read_arrays(self._path, self._key)
        except CacheError:
            return {}


_last: dict[str, FineCorners] = {}
"""The factorisation of the last object that something was solved of: who presses it again waits for the
solves alone."""

_unwritten: dict[str, dict[str, np.ndarray]] = {}
"""What was solved of the last object that has no file."""
