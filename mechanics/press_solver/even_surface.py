"""A file's surface in small triangles that are cut apart along creases: what a felt surface is made of.

A file is as coarse as its maker left it: 12 triangles for a box, strips as long as a wall for a cylinder.
Vertex normals of such triangles bend plane faces, and the nearest of them is not the one whose middle is.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.shape.true_shape import TrueShape

LONGEST_M = 0.003
"""Longest edge."""
_SAME_M, _SAME_TURN = 1.2345e-8, 1.2345e-3
"""Corners this near, whose normals are this near, are one vertex; no round parts of a file's own lengths."""


def even_surface(
    vertices: np.ndarray, triangles: np.ndarray, longest_m: float = LONGEST_M
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) m and triangles (k, 3) on the shape whose file is (v, 3) m and (m, 3), closed, outward.

    Triangles are halved until no edge of theirs in the file's plane exceeds longest_m. What is new lies on
    the curved shape (mechanics.shape.true_shape), and the two sides of a crease share no vertices.
    """
    shape = TrueShape(vertices, triangles)
    corner = shape.vertices[shape.triangles]
    parent, weights = np.arange(len(corner)), np.tile(np.eye(3), (len(corner), 1, 1))
    while True:
        flat = np.einsum("kcw,kwx->kcx", weights, corner[parent])
        length = np.linalg.norm(np.roll(flat, -1, axis=1) - flat, axis=2)
        # neighbours agree on what is too long, so no corner ends on another's edge
        long = np.flatnonzero(length.max(axis=1) > longest_m * (1 + 1e-9))
        if not len(long):
            break
        turned = (length[long].argmax(axis=1)[:, None] + np.arange(3)) % 3
        start, end, tip = np.moveaxis(weights[long[:, None], turned], 1, 0)
        middle = (start + end) / 2
        weights[long] = np.stack([start, middle, tip], axis=1)
        weights = np.concatenate([weights, np.stack([middle, end, tip], axis=1)])
        parent = np.concatenate([parent, parent[long]])
    points, normals = shape.on(np.repeat(parent, 3), weights.reshape(-1, 3))
    key = np.rint(np.hstack([points / _SAME_M, normals / _SAME_TURN])).astype(np.int64)
    _, first, vertex = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return points[first], vertex.reshape(-1, 3)
