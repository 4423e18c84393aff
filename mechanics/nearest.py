"""The nearest place of a triangulated surface to a point."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


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
