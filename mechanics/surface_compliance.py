"""The compliance that a servo interpolates: the give of the surface under a Gaussian patch, corner by corner.

Entry (i, j) is the mean displacement under the patch at corner i for a unit force on the patch at corner
j. Between
corners it is interpolated with barycentric weights; what that flattens, the peak of the half-space under
one's own
patch, is known in closed form and is taken out at the corners and nowhere put back: the far field is
what remains.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numba import njit
from scipy.special import ive

from mechanics.patch import PatchSampler
from mechanics.progress import Progress, silent
from mechanics.sites import PATCH_WIDTH_IN_MESH_SIZES, mean_curvature, typical_edge
from mechanics.solver import Solver
from mechanics.tetmesh import TetMesh, vertex_normals

_CORNERS = 16  # patches solved at once


@dataclass(frozen=True)
class SurfaceCompliance:
    """Unit modulus, device frame, SI units; t corners of the touchable surface (the rim at the base
    included).

    nodes: (t,) of the mesh. points, normals: (t, 3). curvature: (t,) 1/m, mean, convex positive.
    triangles: (f, 3) into the corners, outward. blocks: (t, t, 3, 3) float32, 1/m, symmetric as a whole.
    peaks: (f, 3) 1/m, the half-space's normal compliance between corners 01, 12, 20 of each triangle.
    patch_width_m, poisson_ratio: (1,). Rounding to float32 moves a block by less than 1e-7 of its norm.
    """

    nodes: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    curvature: np.ndarray
    triangles: np.ndarray
    blocks: np.ndarray
    peaks: np.ndarray
    patch_width_m: np.ndarray
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

    @property
    def own_peak(self) -> float:
        """Normal compliance of a half-space under its own patch, 1/m: (1 - nu^2) / (2 sqrt(pi) s)."""
        return float((1 - self.poisson_ratio[0] ** 2) / (2 * np.sqrt(np.pi) * self.patch_width_m[0]))

    @property
    def sideways_ratio(self) -> float:
        """Tangential over normal compliance of a half-space: (2 - nu) / (2 (1 - nu))."""
        return float((2 - self.poisson_ratio[0]) / (2 * (1 - self.poisson_ratio[0])))

    def far(self, triangle: int, barycentric: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """(3, 3) far-field compliance 1/m at one point: what TouchSites.far holds for a site there."""
        out = np.empty((3, 3))
        far_block(
            self.blocks,
            self.triangles[triangle],
            np.asarray(barycentric, dtype=float),
            np.asarray(normal, dtype=float),
            self.peaks[triangle],
            self.own_peak,
            self.sideways_ratio,
            out,
        )
        return out

    def displacement(self, triangle: int, barycentric: np.ndarray, force: np.ndarray) -> np.ndarray:
        """(t, 3) m Pa: motion of all corners for a force (3,) N on the object at one point, times the
        modulus."""
        corners = self.triangles[triangle]
        mixed = np.einsum("c,icab->iab", np.asarray(barycentric), self.blocks[:, corners].astype(float))
        return mixed @ np.asarray(force, dtype=float)


@njit(cache=True, error_model="numpy")
def between_block(blocks, corners_p, weights_p, corners_q, weights_q, out):
    """out (3, 3) 1/m: displacement at p a unit force at q, interpolated; corners (3,), weights (3,)
    barycentric."""
    out[:] = 0.0
    for i in range(3):
        for j in range(3):
            w = weights_p[i] * weights_q[j]
            block = blocks[corners_p[i], corners_q[j]]
            for a in range(3):
                for b in range(3):
                    out[a, b] += w * block[a, b]


@njit(cache=True, error_model="numpy")
def far_block(blocks, corners, weights, normal, peaks, own_peak, sideways_ratio, out):
    """out (3, 3) 1/m: far-field compliance at one point; peaks (3,) of its triangle, normal (3,) unit."""
    between_block(blocks, corners, weights, corners, weights, out)
    peak = own_peak * (weights[0] ** 2 + weights[1] ** 2 + weights[2] ** 2)
    peak += 2.0 * (
        weights[0] * weights[1] * peaks[0]
        + weights[1] * weights[2] * peaks[1]
        + weights[2] * weights[0] * peaks[2]
    )
    for a in range(3):
        out[a, a] -= peak * sideways_ratio
        for b in range(3):
            out[a, b] -= peak * (1.0 - sideways_ratio) * normal[a] * normal[b]
    for a in range(3):
        for b in range(a):
            mean = 0.5 * (out[a, b] + out[b, a])
            out[a, b] = mean
            out[b, a] = mean


def half_space_between(distance_m: np.ndarray, poisson_ratio: float, width_m: float) -> np.ndarray:
    """Normal compliance 1/m between two Gaussian patches of a half-space, unit modulus, centres a
    distance apart.

    (1 - nu^2) / (2 sqrt(pi) s) exp(-q) I0(q) with q = r^2 / (8 s^2); (1 - nu^2) / (pi r) far away
    (Boussinesq).
    """
    q = np.asarray(distance_m) ** 2 / (8 * width_m**2)
    return (1 - poisson_ratio**2) / (2 * np.sqrt(np.pi) * width_m) * ive(0, q)


def surface_compliance(
    mesh: TetMesh,
    poisson_ratio: float,
    modulus_ratio: np.ndarray | None = None,
    *,
    patch_width_m: float | None = None,
    solver: Solver | None = None,
    progress: Progress = silent,
) -> SurfaceCompliance:
    """Solve for a patch at every corner of the touchable surface. mesh: quadratic; width: None, 0.8 edges."""
    triangles = mesh.touchable_surface[:, :3]
    nodes, local = np.unique(triangles, return_inverse=True)
    local = local.reshape(-1, 3)
    points = mesh.points[nodes]
    normals = vertex_normals(mesh.points, triangles)[nodes]
    width = patch_width_m or PATCH_WIDTH_IN_MESH_SIZES * typical_edge(mesh)
    solver = solver or Solver(mesh, poisson_ratio, modulus_ratio)
    sampler = PatchSampler(mesh, width)
    average = sampler.matrix(points)
    t = len(nodes)
    blocks = np.empty((t, t, 3, 3), dtype=np.float32)
    for start in range(0, t, _CORNERS):
        part = slice(start, min(start + _CORNERS, t))
        count = part.stop - start
        loads = np.zeros((len(mesh.points), 3, count, 3))
        dense = average[part].toarray().T
        for axis in range(3):
            loads[:, axis, :, axis] = dense
        moved = solver.solve(loads.reshape(len(mesh.points), 3, 3 * count))
        means = average @ moved.reshape(len(mesh.points), -1)
        blocks[:, part] = means.reshape(t, 3, count, 3).transpose(0, 2, 1, 3)
        progress("surface compliance", part.stop / t)
    _symmetrise(blocks)
    corners = points[local]
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    return SurfaceCompliance(
        nodes=nodes,
        points=points,
        normals=normals,
        curvature=mean_curvature(mesh, points, normals),
        triangles=local,
        blocks=blocks,
        peaks=half_space_between(sides, poisson_ratio, width),
        patch_width_m=np.array([width]),
        poisson_ratio=np.array([poisson_ratio]),
    )


def _symmetrise(blocks: np.ndarray) -> None:
    for i in range(len(blocks)):
        mean = 0.5 * (blocks[i, i:] + blocks[i:, i].transpose(0, 2, 1))
        blocks[i, i:] = mean
        blocks[i:, i] = mean.transpose(0, 2, 1)
