"""The smooth load patch of a tip: a Gaussian of width s on the surface, and the half-space under it.

A point load on a solid is singular; spread over a Gaussian, load and mean displacement (under the same
weight) are finite and meet mesh elements of the size of s without trouble. What the patch smears out,
the local dent, is put back in closed form (mechanics.contact.dent); hence the compliance of a half-space
under the same patch is subtracted.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from palpate.mechanics.errors import MeshError
from palpate.mechanics.shape.nearest import triangle_areas
from palpate.mechanics.shape.tetmesh import TetMesh

REACH = 4.0  # patch widths beyond which the Gaussian (3e-4) is left out
PATCH_WIDTH_M, PATCH_SHARE = 0.004, 1 / 30

# Dunavant's 7 points of degree 5
_A1, _A2 = 0.797426985353087, 0.059715871789770
_POINTS = np.array(
    [
        [1 / 3, 1 / 3, 1 / 3],
        *([_A1 if i == j else (1 - _A1) / 2 for j in range(3)] for i in range(3)),
        *([_A2 if i == j else (1 - _A2) / 2 for j in range(3)] for i in range(3)),
    ]
)
_WEIGHTS = np.array([0.225] + [0.125939180544827] * 3 + [0.132394152788506] * 3)


def triangle_shapes(order: int, barycentric: np.ndarray) -> np.ndarray:
    """Shape functions (q, 3 or 6) of a triangle at barycentric points (q, 3); VTK's order."""
    if order == 1:
        return barycentric
    l0, l1, l2 = barycentric.T
    return np.stack(
        [l0 * (2 * l0 - 1), l1 * (2 * l1 - 1), l2 * (2 * l2 - 1), 4 * l0 * l1, 4 * l1 * l2, 4 * l2 * l0],
        axis=1,
    )


def usual_width(mesh: TetMesh) -> float:
    """The width, m, of the patch of a touch where the elements are fine enough for it: PATCH_WIDTH_M, on a
    small object PATCH_SHARE of its diagonal."""
    return min(PATCH_WIDTH_M, PATCH_SHARE * float(np.linalg.norm(np.ptp(mesh.points, axis=0))))


class PatchSampler:
    """Quadrature points on a mesh's whole boundary, fine enough for Gaussian patches of width `width_m`.

    weights(point) gives the consistent nodal weights of the patch centred there.
    """

    def __init__(self, mesh: TetMesh, width_m: float) -> None:
        if not width_m > 0:
            raise MeshError(f"the patch width is {width_m} m; it must be greater than 0")
        self.mesh = mesh
        self.width_m = width_m
        triangles = mesh.touchable_surface
        corners = mesh.points[triangles[:, :3]]
        edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
        parts = max(1, int(np.ceil(edge / width_m)))
        barycentric, weights = _subdivided(parts)
        shapes = triangle_shapes(mesh.order, barycentric)
        area = triangle_areas(mesh.points, triangles)
        self._triangles = triangles
        self._shapes = shapes
        self._positions = np.einsum("qc,tcx->tqx", barycentric, corners)
        self._areas = area[:, None] * weights
        self._centres = corners.mean(axis=1)
        self._radii = np.linalg.norm(corners - self._centres[:, None], axis=2).max(axis=1)

    def weights(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(nodes, weights) of the patch centred at `point` (3,) m: positive quadrature, weights sum to 1.

        A force F on the patch loads node i with weights[i] * F; the mean displacement is weights . u.
        """
        near, density = self._density(point)
        local = density @ self._shapes
        nodes, inverse = np.unique(self._triangles[near], return_inverse=True)
        total = np.bincount(inverse.ravel(), weights=local.ravel())
        total_sum = total.sum()
        if not total_sum > 0:
            raise MeshError(
                f"the patch at {np.round(point, 5)} meets no surface: is the point on the object?"
            )
        return nodes, total / total_sum

    def triangle_mean(self, point: np.ndarray, values: np.ndarray) -> float:
        """Mean under the patch at `point` of a value a triangle of the touchable surface."""
        near, weights = self.triangle_weights(point)
        return float(weights @ values[near])

    def triangle_weights(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(triangles of the touchable surface (k,), their weights (k,), which sum to 1) under the patch."""
        near, density = self._density(point)
        return near, density.sum(axis=1) / density.sum()

    def _density(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(triangles that the patch meets (k,), its unscaled weight at their quadrature points (k, q))."""
        reach = REACH * self.width_m
        near = np.flatnonzero(np.linalg.norm(self._centres - point, axis=1) < reach + self._radii)
        if not len(near):
            raise MeshError(f"no touchable surface within {reach:.3g} m of {np.round(point, 5)}")
        squared = ((self._positions[near] - point) ** 2).sum(axis=2)
        return near, np.exp(-squared / (2 * self.width_m**2)) * self._areas[near]

    def matrix(self, points: np.ndarray) -> sp.csr_matrix:
        """(k, n) rows of patch weights over all nodes: the smoothing that turns nodal values into patch
        means."""
        rows, columns, values = [], [], []
        for k, point in enumerate(points):
            nodes, weights = self.weights(point)
            rows.append(np.full(len(nodes), k))
            columns.append(nodes)
            values.append(weights)
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sp.csr_matrix(entries, shape=(len(points), len(self.mesh.points)))


def _subdivided(parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Barycentric quadrature of a triangle cut into parts^2 equal ones; weights sum to 1."""
    points, weights = [], []
    for i in range(parts):
        for j in range(parts - i):
            a = np.array([i, j, parts - i - j]) / parts
            step = np.array([[0, 0, 0], [1, 0, -1], [0, 1, -1]]) / parts
            points.append(_POINTS @ (a + step))
            weights.append(_WEIGHTS)
            if i + j < parts - 1:
                down = np.array([[1, 1, -2], [1, 0, -1], [0, 1, -1]]) / parts
                points.append(_POINTS @ (a + down))
                weights.append(_WEIGHTS)
    total = np.concatenate(weights)
    return np.concatenate(points), total / total.sum()


def half_space_compliance(normal: np.ndarray, poisson_ratio: float, width_m: float) -> np.ndarray:
    """(..., 3, 3) mean displacement a unit force of a half-space under a Gaussian patch, unit modulus, 1/m.

    normal: (..., 3) unit normals.
    Load and mean share the weight exp(-r^2 / 2 s^2) / (2 pi s^2).
    Along the normal (Boussinesq): (1 - nu^2) / (2 sqrt(pi) s).
    Across it (Cerruti, averaged over directions): (1 + nu)(2 - nu) / (4 sqrt(pi) s).
    The coupling of the two averages to zero.
    """
    nu = poisson_ratio
    along = (1 - nu**2) / (2 * np.sqrt(np.pi) * width_m)
    across = (1 + nu) * (2 - nu) / (4 * np.sqrt(np.pi) * width_m)
    nn = normal[..., :, None] * normal[..., None, :]
    return along * nn + across * (np.eye(3) - nn)
