"""Nearest points and normals on a closed triangle surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


class TriangleSurface:
    """A triangle surface that answers nearest-point questions; lengths in the caller's unit.

    vertices: (n, 3); faces: (m, 3), counter-clockwise from outside, edges short against the shape.
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, candidates: int = 24) -> None:
        self.vertices = np.asarray(vertices, dtype=float)
        self.faces = np.asarray(faces)
        self.corners = self.vertices[self.faces]
        cross = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        doubled = np.linalg.norm(cross, axis=1)
        self.areas = doubled / 2
        self.face_normals = cross / np.maximum(doubled, 1e-300)[:, None]
        self._tree = cKDTree(self.corners.mean(axis=1))
        self._candidates = min(candidates, len(self.faces))
        normals = np.zeros_like(self.vertices)
        for corner in range(3):
            np.add.at(normals, self.faces[:, corner], cross)
        self.vertex_normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(nearest points (k, 3), distances (k,), faces (k,))."""
        points = np.atleast_2d(points)
        _, near = self._tree.query(points, k=self._candidates)
        near = near.reshape(len(points), -1)
        found = _nearest_on_triangles(points[:, None, :], self.corners[near])
        distance = np.linalg.norm(found - points[:, None, :], axis=2)
        best = distance.argmin(axis=1)
        rows = np.arange(len(points))
        return found[rows, best], distance[rows, best], near[rows, best]

    def normals(self, points: np.ndarray) -> np.ndarray:
        """(k, 3) outward unit normals at surface points: the faces' vertex normals, interpolated."""
        points = np.atleast_2d(points)
        on, _, face = self.nearest(points)
        weights = _barycentric(on, self.corners[face])
        smooth = np.einsum("kc,kcx->kx", weights, self.vertex_normals[self.faces[face]])
        flat = self.face_normals[face]
        # vertex normals on a sharp rim belong to neither side
        spread = np.einsum("kcx,kx->kc", self.vertex_normals[self.faces[face]], flat).min(axis=1)
        normal = np.where((spread > 0.9)[:, None], smooth, flat)
        return normal / np.linalg.norm(normal, axis=1)[:, None]


def _barycentric(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    wu, wv = (w * u).sum(1), (w * v).sum(1)
    det = np.maximum(uu * vv - uv * uv, 1e-300)
    s, t = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    return np.clip(np.column_stack([1 - s - t, s, t]), 0.0, 1.0)


def _nearest_on_triangles(p: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Nearest points to p (k, 1, 3) on triangles (k, m, 3, 3): the best of the interior and the
    three edges.
    """
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    best, least = np.zeros_like(a + p), np.full((a + p).shape[:-1], np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        along = end - start
        share = ((p - start) * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-300)
        candidate = start + np.clip(share, 0, 1)[..., None] * along
        distance = ((candidate - p) ** 2).sum(-1)
        nearer = distance < least
        best, least = np.where(nearer[..., None], candidate, best), np.where(nearer, distance, least)
    u, v, w = b - a, c - a, p - a
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    wu, wv = (w * u).sum(-1), (w * v).sum(-1)
    det = np.maximum(uu * vv - uv * uv, 1e-300)
    s, t = (vv * wu - uv * wv) / det, (uu * wv - uv * wu) / det
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    return np.where(inside[..., None], a + s[..., None] * u + t[..., None] * v, best)
