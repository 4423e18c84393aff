"""Triangles of a contact surface: cut at points of their edges, and the pseudonormals of their vertices."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.shape.nearest import facings

_NARROWER, _WIDER = 0.97, 1.15
"""Widths from a rim within and beyond which the ends of an edge that is cut lie. Of edges from the rim alone,
a vertex 0.9 widths beside it carried its turned normal to the next one: 1.4 widths beside a wedge's rim a
force was 7 % off."""
_PATTERNS = tuple(
    np.array(p)
    for p in (
        [[0, 1, 2]],
        [[0, 3, 2], [3, 1, 2]],
        [[3, 1, 4], [0, 3, 4], [0, 4, 2]],
        [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    )
)
"""Triangles of corners 0 to 2 and points on the edges 01, 12, 20, by how many of these are cut."""


def edges_of(triangles: np.ndarray) -> np.ndarray:
    """(e, 2) vertices of the edges of triangles (k, 3), each once, the lower first, sorted."""
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.unique(np.sort(ends, axis=1), axis=0)


def cut_beside(
    vertices: np.ndarray,
    triangles: np.ndarray,
    free: np.ndarray,
    weights: np.ndarray,
    on_rim: np.ndarray,
    line: cKDTree,
    width_m: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """`cut` triangles (free (k,): 1 where they may be touched) `width_m` beside a rim: points `line` along
    it, and on_rim (v,) bool, the vertices that lie on it."""
    touch = triangles[free > 0]
    ends = edges_of(touch)
    both = on_rim[ends].all(axis=1)
    across = line.query(vertices[ends[both]].mean(axis=1))[0] > 0.4 * width_m
    away = line.query(vertices)[0] / width_m
    away[on_rim] = 0.0
    low, high = np.sort(away[ends], axis=1).T
    passing = (low < _NARROWER) & (high > _WIDER)
    share = (1 - away[ends[passing, 0]]) / (away[ends[passing, 1]] - away[ends[passing, 0]])
    ends = np.concatenate([ends[both][across], ends[passing]])
    return cut(vertices, triangles, weights, ends, np.concatenate([np.full(across.sum(), 0.5), share]))


def pseudonormals(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(v, 3) unit: means of the triangles' normals around each vertex, by their angles there."""
    p, (_, face) = vertices[triangles], facings(vertices, triangles)
    total = np.zeros_like(vertices)
    for c in range(3):
        a, b = p[:, (c + 1) % 3] - p[:, c], p[:, (c + 2) % 3] - p[:, c]
        cosine = np.einsum("ij,ij->i", a, b) / np.maximum(
            np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1), 1e-300
        )
        np.add.at(total, triangles[:, c], np.arccos(np.clip(cosine, -1, 1))[:, None] * face)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)


def cut(
    vertices: np.ndarray,
    triangles: np.ndarray,
    weights: np.ndarray,
    ends: np.ndarray,
    share: np.ndarray | float = 0.5,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Triangles cut at points of edges (e, 2), ends ascending: two for one such edge, three for two.

    share: (e,) of the way from the first end. Vertices with those points behind them, triangles, the given
    one (k,) that each lies in, and weights (k, 3, 3) at its corners.
    """
    n, share = len(vertices), np.broadcast_to(share, (len(ends),))
    key = ends[:, 0] * np.int64(n) + ends[:, 1]
    order = np.argsort(key)
    after = np.roll(triangles, -1, axis=1)
    wanted = np.minimum(triangles, after) * np.int64(n) + np.maximum(triangles, after)
    place = np.minimum(np.searchsorted(key[order], wanted), max(len(key) - 1, 0))
    number = np.where(key[order][place] == wanted, order[place], -1) if len(key) else np.full(after.shape, -1)
    part = share[number] if len(key) else np.zeros(after.shape)
    part = np.where(triangles < after, part, 1 - part)
    count = (number >= 0).sum(axis=1)
    # turned so that the first edge is cut, and of two the second as well
    first = np.where(count == 2, ((number < 0).argmax(axis=1) + 1) % 3, (number >= 0).argmax(axis=1))
    turn = (first[:, None] + np.arange(3)) % 3
    rows = np.arange(len(triangles))[:, None]
    six = np.concatenate([triangles[rows, turn], n + number[rows, turn]], axis=1)
    corner, way = weights[rows, turn], part[rows, turn][..., None]
    six_weights = np.concatenate([corner, corner + way * (np.roll(corner, -1, axis=1) - corner)], axis=1)
    new, within, new_weights = [], [], []
    for cuts, pattern in enumerate(_PATTERNS):
        own = np.flatnonzero(count == cuts)
        new.append(six[own][:, pattern].reshape(-1, 3))
        within.append(np.repeat(own, len(pattern)))
        new_weights.append(six_weights[own][:, pattern].reshape(-1, 3, weights.shape[2]))
    start, stop = vertices[ends.T]
    points = np.vstack([vertices, start + share[:, None] * (stop - start)])
    return points, np.concatenate(new), np.concatenate(within), np.concatenate(new_weights)
