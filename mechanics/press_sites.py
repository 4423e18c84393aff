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
    shortest tree that joins the presses it lies in the widest gap (by ratio) between _REPEAT_M and `reach_m`.
    """
    if not len(point):
        return np.zeros(0, dtype=int)
    gap = cdist(point, point)
    gap[normal @ normal.T <= _SAME_FACE] = np.inf
    joined = np.where(np.isfinite(gap), np.maximum(gap, _TOUCHING_M), 0.0)
    edges = np.sort(minimum_spanning_tree(joined).data)
    steps = np.concatenate([[_REPEAT_M], edges[(edges > _REPEAT_M) & (edges < reach_m)], [reach_m]])
    ratios = steps[1:] / steps[:-1]
    cut_m = steps[:-1][ratios >= ratios.max() - 1e-12][-1]
    label = connected_components(gap <= max(cut_m, _TOUCHING_M), directed=False)[1]
    first = np.unique(label, return_index=True)[1]
    order = np.empty(len(first), dtype=int)
    order[np.argsort(first)] = np.arange(len(first))
    return order[label]
