"""The compliance that a servo interpolates, for unit Young's modulus; two tables, since two things are
asked.

How one place gives under its own touch (`own`): sharp near edges and the base, so it is computed with a
patch as narrow as a contact, at the corners of a surface finer than the mesh's. How a touch moves the rest
of the
object (`blocks`): smooth, so a patch as wide as the mesh's own elements and the mesh's own corners serve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
import scipy.sparse as sp
from numba import njit
from scipy.spatial import cKDTree

from mechanics.patch import PatchSampler, half_space_compliance
from mechanics.progress import Progress, silent
from mechanics.sites import mean_curvature, patch_width, touch_solver
from mechanics.solver import Solver
from mechanics.support import Support
from mechanics.tetmesh import TetMesh, vertex_normals

_CORNERS = 32  # patches solved at once


@dataclass(frozen=True)
class SurfaceCompliance:
    """Device frame, SI units; the touchable surface with its rim at the base.

    Coarse, t corners of the mesh: nodes (t,), points, normals (t, 3), curvature (t,) 1/m mean and convex
    positive, triangles (f, 3) into them, blocks (t, t, 3, 3) float32, 1/m: displacement of the patch at i
    for a unit force on the patch at j; symmetric as a whole. patch_width_m: (1,).
    Fine, v corners: own_points, own_normals (v, 3), own_curvature (v,), own_triangles (g, 3) into them, own
    (v, 3, 3), 1/m: displacement of the patch at i for a unit force on itself. own_width_m: (1,).
    poisson_ratio: (1,). Rounding to float32 moves a block by less than 1e-7 of its greatest entry.
    """

    nodes: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    curvature: np.ndarray
    triangles: np.ndarray
    blocks: np.ndarray
    patch_width_m: np.ndarray
    own_points: np.ndarray
    own_normals: np.ndarray
    own_curvature: np.ndarray
    own_triangles: np.ndarray
    own: np.ndarray
    own_width_m: np.ndarray
    poisson_ratio: np.ndarray

    def __post_init__(self) -> None:
        for field in fields(self):
            getattr(self, field.name).setflags(write=False)

    def arrays(self) -> dict[str, np.ndarray]:
        """The fields by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> SurfaceCompliance:
        """The inverse of `arrays`."""
        return cls(**arrays)

    def far_at(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(k, 3, 3) far-field compliance, 1/m, at surface points (k, 3) with normals (k, 3).

        Interpolated in the nearest fine triangle; what TouchSites.far holds for a site there.
        """
        points, normals = np.atleast_2d(points), np.atleast_2d(normals)
        triangle, weights = closest_on_triangles(points, self.own_points, self.own_triangles)
        own = np.einsum("kc,kcab->kab", weights, self.own[self.own_triangles[triangle]])
        nu, width = float(self.poisson_ratio[0]), float(self.own_width_m[0])
        return own - np.array([half_space_compliance(n, nu, width) for n in normals])

    def displacement(self, triangle: int, barycentric: np.ndarray, force: np.ndarray) -> np.ndarray:
        """(t, 3) m Pa: motion of all corners for a force (3,) N on the object, times the modulus."""
        corners = self.triangles[triangle]
        mixed = np.einsum("c,icab->iab", np.asarray(barycentric), self.blocks[:, corners].astype(float))
        return mixed @ np.asarray(force, dtype=float)


@njit(cache=True, error_model="numpy")
def between_block(blocks, corners_p, weights_p, corners_q, weights_q, out):
    """out (3, 3) 1/m: displacement at p a unit force at q; corners (3,), weights (3,) barycentric."""
    out[:] = 0.0
    for i in range(3):
        for j in range(3):
            w = weights_p[i] * weights_q[j]
            block = blocks[corners_p[i], corners_q[j]]
            for a in range(3):
                for b in range(3):
                    out[a, b] += w * block[a, b]


def closest_on_triangles(
    points: np.ndarray, corners: np.ndarray, triangles: np.ndarray, *, candidates: int = 24
) -> tuple[np.ndarray, np.ndarray]:
    """Nearest triangle (k,) and barycentric weights (k, 3) of the nearest point on it, for points (k, 3).

    Among the triangles with the nearest centres; weights are not negative and sum to 1.
    """
    p = corners[triangles]
    count = min(candidates, len(triangles))
    _, near = cKDTree(p.mean(axis=1)).query(points, k=count)
    near = np.asarray(near).reshape(len(points), count)
    best = np.full(len(points), np.inf)
    chosen = np.zeros(len(points), dtype=np.int64)
    weights = np.zeros((len(points), 3))
    for k in range(count):
        w = _closest_weights(points, p[near[:, k]])
        distance = np.linalg.norm(np.einsum("kc,kcx->kx", w, p[near[:, k]]) - points, axis=1)
        better = distance < best - 1e-12
        best[better], chosen[better], weights[better] = distance[better], near[better, k], w[better]
    return chosen, weights


def _closest_weights(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(k, 3) barycentric weights of the point of each triangle (k, 3, 3) nearest to its point (k, 3)."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    wu, wv = (w * u).sum(1), (w * v).sum(1)
    det = uu * vv - uv * uv
    s, t = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    weights = np.stack([1 - s - t, s, t], axis=1)
    outside = (weights < 0).any(axis=1)
    best = np.full(len(points), np.inf)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        side = triangles[:, j] - triangles[:, i]
        f = np.clip(((points - triangles[:, i]) * side).sum(1) / (side * side).sum(1), 0, 1)
        distance = np.linalg.norm(points - triangles[:, i] - f[:, None] * side, axis=1)
        use = outside & (distance < best)
        best[use] = distance[use]
        weights[use] = 0
        weights[use, i], weights[use, j] = 1 - f[use], f[use]
    return weights


def surface_compliance(
    mesh: TetMesh,
    poisson_ratio: float,
    modulus_ratio: np.ndarray | None = None,
    *,
    support: Support | None = None,
    progress: Progress = silent,
) -> SurfaceCompliance:
    """Compute both tables. mesh: linear or quadratic; modulus_ratio: (m,) or None; support: None, bonded."""
    coarse = Solver(mesh.quadratic(), poisson_ratio, modulus_ratio, support=support)
    nodes, triangles = _corners(coarse.mesh)
    points = coarse.mesh.points[nodes]
    width = patch_width(coarse.mesh)
    blocks = patch_blocks(coarse, points, width, lambda f: progress("give between places", 0.3 * f))
    curvature = mean_curvature(mesh, points, normals := _normals(coarse.mesh, nodes))
    del coarse
    fine = touch_solver(mesh, poisson_ratio, modulus_ratio, support=support)
    own_nodes, own_triangles = _corners(fine.mesh)
    own_points = fine.mesh.points[own_nodes]
    own_normals = _normals(fine.mesh, own_nodes)
    own_width = patch_width(fine.mesh)
    own = own_blocks(fine, own_points, own_width, lambda f: progress("give of each place", 0.3 + 0.7 * f))
    return SurfaceCompliance(
        nodes=nodes,
        points=points,
        normals=normals,
        curvature=curvature,
        triangles=triangles,
        blocks=blocks,
        patch_width_m=np.array([width]),
        own_points=own_points,
        own_normals=own_normals,
        own_curvature=mean_curvature(mesh, own_points, own_normals),
        own_triangles=own_triangles,
        own=own,
        own_width_m=np.array([own_width]),
        poisson_ratio=np.array([float(poisson_ratio)]),
    )


def _corners(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray]:
    """Corner nodes (t,) of the touchable surface, and its triangles (f, 3) into them."""
    nodes, local = np.unique(mesh.touchable_surface[:, :3], return_inverse=True)
    return nodes, local.reshape(-1, 3)


def _normals(mesh: TetMesh, nodes: np.ndarray) -> np.ndarray:
    return vertex_normals(mesh.points, mesh.touchable_surface[:, :3])[nodes]


def patch_blocks(
    solver: Solver, points: np.ndarray, width: float, tell: Callable[[float], None] = lambda share: None
) -> np.ndarray:
    """(t, t, 3, 3) float32, 1/m: mean displacement of the patch at i for a unit force on the patch at j."""
    mesh = solver.mesh
    average = PatchSampler(mesh, width).matrix(points)
    t = len(points)
    blocks = np.empty((t, t, 3, 3), dtype=np.float32)
    for start in range(0, t, _CORNERS):
        part = slice(start, min(start + _CORNERS, t))
        count = part.stop - start
        moved = solver.solve(_loads(average[part]).reshape(len(mesh.points), 3, 3 * count))
        means = average @ moved.reshape(len(mesh.points), -1)
        blocks[:, part] = means.reshape(t, 3, count, 3).transpose(0, 2, 1, 3)
        tell(part.stop / t)
    for i in range(t):
        mean = 0.5 * (blocks[i, i:] + blocks[i:, i].transpose(0, 2, 1))
        blocks[i, i:] = mean
        blocks[i:, i] = mean.transpose(0, 2, 1)
    return blocks


def own_blocks(
    solver: Solver, points: np.ndarray, width: float, tell: Callable[[float], None] = lambda share: None
) -> np.ndarray:
    """(t, 3, 3) 1/m: mean displacement of every patch for a unit force on itself."""
    average = PatchSampler(solver.mesh, width).matrix(points)
    own = np.empty((len(points), 3, 3))
    for start in range(0, len(points), _CORNERS):
        part = slice(start, min(start + _CORNERS, len(points)))
        count = part.stop - start
        loads = _loads(average[part]).reshape(-1, count, 3)
        own[part] = solver.quadratic_forms(loads[solver.free])
        tell(part.stop / len(points))
    return own


def _loads(average: sp.csr_matrix) -> np.ndarray:
    """(n, 3, k, 3) nodal forces of unit loads x, y, z on each of k patches, from weights (k, n)."""
    dense = average.toarray().T
    loads = np.zeros((len(dense), 3, dense.shape[1], 3))
    for axis in range(3):
        loads[:, axis, :, axis] = dense
    return loads
