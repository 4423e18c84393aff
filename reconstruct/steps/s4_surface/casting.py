"""Contacts cast onto the reconstructed surface (paper, section 2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from palpate.mechanics.shape.tetmesh import vertex_normals
from palpate.mechanics.shape.true_shape import TrueShape


@dataclass(frozen=True)
class CastPoints:
    """Nearest surface points (k, 3) m, outward unit normals there (k, 3), triangle (k,)."""

    points: np.ndarray
    normals: np.ndarray
    triangle: np.ndarray

    def on(self, shape: TrueShape | None) -> CastPoints:
        """The same on the shape that the surface draws; themselves where none is known."""
        if shape is None:
            return self
        return CastPoints(*shape.foot(self.points, self.normals), self.triangle)

    def of(self, chosen: np.ndarray) -> CastPoints:
        """Only some of them, (k,) bool."""
        return CastPoints(self.points[chosen], self.normals[chosen], self.triangle[chosen])


def cast(
    vertices: np.ndarray,
    triangles: np.ndarray,
    points: np.ndarray,
    measured_normals: np.ndarray | None = None,
) -> CastPoints:
    """Nearest points of a triangle surface (outward by the right-hand rule), smooth normals between vertices.

    With measured normals (k, 3), triangles that face away from a contact's normal by more than 75 degrees are
    passed over, so that a touch beside an edge stays on its own face.
    """
    triangles = triangles[:, :3]
    corners = vertices[triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-300)
    smooth = vertex_normals(vertices, triangles)
    where = np.empty_like(points)
    normals = np.empty_like(points)
    chosen = np.empty(len(points), dtype=int)
    for i, point in enumerate(points):
        allowed = np.arange(len(triangles))
        if measured_normals is not None:
            allowed = np.flatnonzero(facing @ measured_normals[i] > np.cos(np.radians(75)))
            allowed = allowed if len(allowed) else np.arange(len(triangles))
        # not mechanics.shape.nearest: every contact has triangles of its own to choose among
        nearest = trimesh.triangles.closest_point(corners[allowed], np.tile(point, (len(allowed), 1)))
        best = int(np.argmin(np.linalg.norm(nearest - point, axis=1)))
        where[i], chosen[i] = nearest[best], allowed[best]
        share = trimesh.triangles.points_to_barycentric(corners[[chosen[i]]], where[[i]])[0]
        # vertex normals of an edge lean over it: only those near the triangle's own take part
        near = smooth[triangles[chosen[i]]] @ facing[chosen[i]] > np.cos(np.radians(30))
        normal = (np.where(near, share, 0.0)[:, None] * smooth[triangles[chosen[i]]]).sum(axis=0)
        normal = facing[chosen[i]] if np.linalg.norm(normal) < 0.2 else normal
        normals[i] = normal / np.linalg.norm(normal)
    return CastPoints(where, normals, chosen)
