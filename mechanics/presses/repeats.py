"""Which presses repeat one place: sites by the data's own spacing."""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial.distance import cdist

SITE_M = 0.008
"""Presses further than this from one another are never repeats at one site."""
_SAME_FACE = 0.7
_REPEAT_M = 0.001
_TOUCHING_M = 1e-9


def sites_of(point: np.ndarray, normal: np.ndarray, reach_m: float = SITE_M) -> np.ndarray:
    """(k,) the site of each press, numbered in order of time: chains of presses (k, 3) m that lie nearer to
    one another than the cut, with outward normals (k, 3) that look the same way.

    The cut is the data's own: repeats scatter by a little and sites stand apart, so among the lengths of the
    shortest tree that joins the presses it lies in the widest gap (by ratio) between _REPEAT_M and `reach_m`,
    of those gaps that make no site wider than `reach_m`: a raster is a chain of places, not one.
    """
    if not len(point):
        return np.zeros(0, dtype=int)
    gap = cdist(point, point)
    alike = normal @ normal.T > _SAME_FACE
    near = np.where(alike, gap, np.inf)
    joined = np.where(np.isfinite(near), np.maximum(near, _TOUCHING_M), 0.0)
    edges = np.sort(minimum_spanning_tree(joined).data)
    steps = np.concatenate([[_REPEAT_M], edges[(edges > _REPEAT_M) & (edges < reach_m)], [reach_m]])
    ratios = steps[1:] / steps[:-1]
    # of equal gaps the widest places; the least cut where all make a site too wide
    order = np.argsort(-np.round(ratios, 12) - 1e-13 * np.arange(len(ratios)), kind="stable")
    for cut_m in [*steps[:-1][order], _REPEAT_M]:
        label = connected_components(near <= max(cut_m, _TOUCHING_M), directed=False)[1]
        if gap[label[:, None] == label].max() <= reach_m:
            break
    first = np.unique(label, return_index=True)[1]
    number = np.empty(len(first), dtype=int)
    number[np.argsort(first)] = np.arange(len(first))
    return number[label]
