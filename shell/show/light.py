"""How an object's surface takes light: the same in the window, on pages and in scenes of PyVista."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from palpate.mechanics.shape.nearest import facings, neighbours
from palpate.mechanics.shape.tetmesh import vertex_normals

CREASE_DEG = 80.0
"""An edge over which the surface turns by more is drawn sharp."""
ALIKE_DEG, SWEEPS = 12.0, 12
"""Normals that differ by less are smoothed, over so many triangles: a mesh's facets of 10 mm, cut finer, turn
by 5 degrees and are seen as patches; a rim turns by more and stays."""


@dataclass(frozen=True)
class LitSurface:
    """What is drawn of a surface of v points. at: (n,) which of them, each once on either side of a crease.
    triangles: (k, 3) of those n. normals, facets: (n, 3) unit, at rest: by which it is lit, and the mean of
    the triangles around."""

    at: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    facets: np.ndarray

    def turned(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) normals, about unit, where the surface's points (v, 3) m have moved: turned as its triangles
        have."""
        return self.normals + vertex_normals(points[self.at], self.triangles) - self.facets


def lit(points: np.ndarray, triangles: np.ndarray, side: np.ndarray | None = None) -> LitSurface:
    """The surface of points (v, 3) m and outward triangles (k, 3), smooth but for its creases.

    side: (k,) bool, the triangles that are not the foot's: where the two meet is a crease (None: all).
    """
    of, count = _joined(points, triangles, np.ones(len(triangles), dtype=bool) if side is None else side)
    at = np.empty(count, dtype=np.int64)
    at[of] = triangles
    facets = normals = vertex_normals(points[at], of)
    i, j = of[:, [0, 1, 2, 1, 2, 0]].ravel(), of[:, [1, 2, 0, 0, 1, 2]].ravel()
    around = sp.csr_matrix((np.full(len(i), 0.5), (i, j)), shape=(count, count))
    i, shared = np.repeat(np.arange(count), np.diff(around.indptr)), around.data
    for _ in range(SWEEPS):
        chord = np.linalg.norm(normals[i] - normals[around.indices], axis=1)
        around.data = shared * np.exp(-((chord / np.radians(ALIKE_DEG)) ** 2))
        normals = normals + around @ normals
        normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return LitSurface(at, of, normals, facets)


def _joined(points: np.ndarray, triangles: np.ndarray, side: np.ndarray) -> tuple[np.ndarray, int]:
    """(k, 3) numbers of triangles' corners, one for those that meet over edges without a crease; how many."""
    face, across = facings(points, triangles)[1], neighbours(triangles)
    smooth = np.einsum("kx,kex->ke", face, face[across]) > np.cos(np.radians(CREASE_DEG))
    row, edge = np.nonzero(smooth & (across >= 0) & (side[:, None] == side[across]))
    other, links = across[row, edge], []
    for corner in (edge, (edge + 1) % 3):
        same = (triangles[other] == triangles[row, corner][:, None]).argmax(axis=1)
        links.append((3 * row + corner, 3 * other + same))
    size = triangles.size
    graph = sp.coo_matrix((np.ones(2 * len(row)), np.hstack(links)), shape=(size, size))
    count, of = connected_components(graph, directed=False)
    return of.reshape(-1, 3).astype(np.int64), int(count)
