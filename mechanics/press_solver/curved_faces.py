"""The surface that a tip feels, curved between its fine vertices: where the nodes of a mesh belong."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.kernels import kernel
from palpate.mechanics.shape.tetmesh import vertex_normals

_SMOOTH_COSINE = 0.85
"""A vertex normal further than some 32 degrees from a triangle's own belongs to a crease: it stays flat."""


class FeltSurface:
    """A closed surface of fine triangles, curved by its vertex normals; answers nearest-point questions.

    vertices: (v, 3) m. triangles: (k, 3), outward, none much longer than its neighbours. curved: False keeps
    the triangles flat. Between vertices the surface is the mean of the point and its projections onto the
    corners' tangent planes (Boubekeur & Alexa, Phong Tessellation, 2008, with their factor 1/2, which is
    exact for a paraboloid).
    """

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray, *, curved: bool = True) -> None:
        self.vertices = np.ascontiguousarray(vertices, dtype=float)
        self.triangles = np.ascontiguousarray(triangles, dtype=np.int64)
        corner = self.vertices[self.triangles]
        self._tree = cKDTree(corner.mean(axis=1))
        self._candidates = min(24, len(corner))
        normals = vertex_normals(self.vertices, self.triangles)[self.triangles]
        across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
        smooth = np.einsum("kci,ki->kc", normals, across) > _SMOOTH_COSINE
        self._normals = np.where(smooth[..., None] & curved, normals, 0.0)

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """(k, 3) m, the places of the surface nearest to points (k, 3) m."""
        points = np.ascontiguousarray(np.atleast_2d(points), dtype=float)
        _, near = self._tree.query(points, k=self._candidates)
        near = near.reshape(len(points), -1)
        found, weights = np.empty_like(points), np.empty_like(points)
        triangle = np.empty(len(points), dtype=np.int64)
        _nearest(points, near, self.vertices, self.triangles, found, triangle, weights)
        corner, normals = self.vertices[self.triangles[triangle]], self._normals[triangle]
        over = np.einsum("kci,kci->kc", found[:, None] - corner, normals)
        return found - 0.5 * np.einsum("kc,kc,kci->ki", weights, over, normals)


@kernel
def _nearest(points, near, vertices, triangles, found, triangle, weights):
    """The nearest point of the candidate triangles `near` (k, c) to each point (Ericson 2005, 5.1)."""
    for k in range(points.shape[0]):
        least = np.inf
        px, py, pz = points[k, 0], points[k, 1], points[k, 2]
        for c in range(near.shape[1]):
            t = near[k, c]
            i, j, l = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            ax, ay, az = vertices[i, 0], vertices[i, 1], vertices[i, 2]
            ux, uy, uz = vertices[j, 0] - ax, vertices[j, 1] - ay, vertices[j, 2] - az
            vx, vy, vz = vertices[l, 0] - ax, vertices[l, 1] - ay, vertices[l, 2] - az
            wx, wy, wz = px - ax, py - ay, pz - az
            uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
            uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
            area = uu * vv - uv * uv
            s, r = vv * uw - uv * vw, uu * vw - uv * uw
            if area > 0.0 and s >= 0.0 and r >= 0.0 and s + r <= area:
                s /= area
                r /= area
            else:
                # the nearest of the three edges
                best = np.inf
                s_best, r_best = 0.0, 0.0
                for edge in range(3):
                    if edge == 0:
                        at = min(max(uw / max(uu, 1e-300), 0.0), 1.0)
                        s, r = at, 0.0
                    elif edge == 1:
                        at = min(max(vw / max(vv, 1e-300), 0.0), 1.0)
                        s, r = 0.0, at
                    else:
                        at = (uu - uv + vw - uw) / max(uu + vv - 2 * uv, 1e-300)
                        at = min(max(at, 0.0), 1.0)
                        s, r = 1.0 - at, at
                    dx, dy, dz = wx - s * ux - r * vx, wy - s * uy - r * vy, wz - s * uz - r * vz
                    away = dx * dx + dy * dy + dz * dz
                    if away < best:
                        best, s_best, r_best = away, s, r
                s, r = s_best, r_best
            dx, dy, dz = wx - s * ux - r * vx, wy - s * uy - r * vy, wz - s * uz - r * vz
            away = dx * dx + dy * dy + dz * dz
            if away < least:
                least = away
                triangle[k] = t
                found[k, 0], found[k, 1], found[k, 2] = px - dx, py - dy, pz - dz
                weights[k, 0], weights[k, 1], weights[k, 2] = 1.0 - s - r, s, r
