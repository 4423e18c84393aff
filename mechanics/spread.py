"""A table over a dense surface from solutions at some of its corners: where to solve, what lies between."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from mechanics.sites import tangents

_NEIGHBOURS = 14
_SAME_SIDE = 0.5  # least cosine between the normals of two corners that may speak for one another


def spaced_corners(points: np.ndarray, normals: np.ndarray, spacing_m: float) -> np.ndarray:
    """Indices (s,), ascending, of corners (t, 3) at least `spacing_m` apart that leave none further away.

    Sharp corners come first, so that edges are met.
    """
    tree = cKDTree(points)
    _, near = tree.query(points, k=min(9, len(points)))
    bent = np.einsum("tx,tkx->tk", normals, normals[near]).min(axis=1)
    open_ = np.ones(len(points), dtype=bool)
    chosen = []
    for i in np.argsort(bent, kind="stable"):
        if open_[i]:
            chosen.append(i)
            open_[tree.query_ball_point(points[i], spacing_m)] = False
    return np.sort(chosen)


def spread(points: np.ndarray, normals: np.ndarray, chosen: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(t, ...) values at all corners from those (s, ...) at the chosen ones, which keep theirs.

    A plane fitted over the nearest chosen corners on the same side, weighted by nearness.
    """
    flat = values.reshape(len(chosen), -1)
    result = np.empty((len(points), flat.shape[1]))
    tree = cKDTree(points[chosen])
    distance, near = tree.query(points, k=min(_NEIGHBOURS, len(chosen)))
    for i, normal in enumerate(normals):
        found = near[i][normals[chosen[near[i]]] @ normal > _SAME_SIDE]
        if not len(found):
            result[i] = flat[near[i][0]]
            continue
        offset = points[chosen[found]] - points[i]
        reach = distance[i][min(5, len(near[i]) - 1)]
        weight = np.exp(-(offset**2).sum(axis=1) / (0.5 * reach**2 + 1e-300))
        u, v = tangents(normal)
        design = np.stack([np.ones(len(found)), offset @ u / reach, offset @ v / reach], axis=1)
        normal_matrix = (design * weight[:, None]).T @ design + weight.sum() * np.diag([0.0, 1e-4, 1e-4])
        result[i] = np.linalg.solve(normal_matrix, (design * weight[:, None]).T @ flat[found])[0]
    result[chosen] = flat
    return result.reshape(len(points), *values.shape[1:])
