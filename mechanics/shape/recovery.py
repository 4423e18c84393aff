"""A nodal field between the corners of a surface: its second derivatives, from the corners around.

Beside an edge the compliance of a place bends within one triangle of 5 mm; linear interpolation is felt.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

_SAME_FACE = np.cos(np.radians(40))
_ENOUGH = 10  # corners for the six coefficients of a quadratic


def edge_middles(points: np.ndarray, triangles: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(g, 3, ...): at the middles of the edges 01, 12, 20 of triangles (g, 3), from nodal values (v, ...).

    A quadratic polynomial in the triangle's plane is fitted to the corners around it, those beyond a sharp
    edge left out; its second derivatives correct the mean of an edge's ends. Fewer than 7 corners: the mean.
    """
    v = len(points)
    flat = values.reshape(v, -1)
    ends = flat[triangles]
    middles = 0.5 * (ends + np.roll(ends, -1, axis=1))
    links = sp.csr_matrix(
        (np.ones(triangles.size), (triangles.ravel(), np.repeat(np.arange(len(triangles)), 3)))
    )
    around = (links.T @ links).tocsr()  # triangles that share a corner
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for t in range(len(triangles)):
        near = around.indices[around.indptr[t] : around.indptr[t + 1]]
        near = near[normals[near] @ normals[t] > _SAME_FACE]
        nodes = np.unique(triangles[near])
        if len(nodes) < _ENOUGH:  # in a corner of a face: one ring further
            near = np.unique(around[near].indices)
            near = near[normals[near] @ normals[t] > _SAME_FACE]
            nodes = np.unique(triangles[near])
        if len(nodes) < 7:
            continue
        u = corners[t, 1] - corners[t, 0]
        size = np.linalg.norm(u)
        frame = np.stack([u / size, np.cross(normals[t], u / size)]) / size
        x, y = frame @ (points[nodes] - corners[t].mean(axis=0)).T
        weight = 1 / (0.5 + x * x + y * y)
        columns = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
        fit = np.linalg.lstsq(columns * weight[:, None], flat[nodes] * weight[:, None], rcond=1e-8)[0]
        dx, dy = frame @ (np.roll(corners[t], -1, axis=0) - corners[t]).T
        bend = np.stack([dx * dx, dx * dy, dy * dy], axis=1) @ fit[3:]
        middles[t] -= 0.25 * bend
    return middles.reshape(len(triangles), 3, *values.shape[1:])
