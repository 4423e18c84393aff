"""Closest point on triangles: a flat tree of boxes, searched without allocation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.mechanics.kernels import kernel

_LEAF = 4
STACK = 128
"""Length of the search's stack; the tree is balanced, so its depth is log2 of the triangles."""


class Bvh(NamedTuple):
    """low, high: (b, 3) box corners. left, right: (b,) children, -1 in a leaf.

    start, held: (b,) the leaf's part of order, held 0 in inner boxes. order: (k,) triangles.
    """

    low: np.ndarray
    high: np.ndarray
    left: np.ndarray
    right: np.ndarray
    start: np.ndarray
    held: np.ndarray
    order: np.ndarray


def build_bvh(corners: np.ndarray) -> Bvh:
    """Median splits along the longest side; corners (k, 3, 3) m. The same triangles give the same tree."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    order, levels = _levels((low + high) / 2)
    # boxes are numbered parents first, then all of the left child's, then the right one's
    counts = [np.ones(len(begin), dtype=np.int64) for begin, _ in levels]
    splits = [end - begin > _LEAF for begin, end in levels]
    for depth in range(len(levels) - 2, -1, -1):
        counts[depth][splits[depth]] += counts[depth + 1].reshape(-1, 2).sum(axis=1)
    total = int(counts[0][0])
    left, right, start, held = np.full((4, total), -1)
    box_low, box_high = np.empty((2, total, 3))
    number = np.zeros(1, dtype=np.int64)
    for (begin, end), split, below in zip(levels, splits, [*counts[1:], np.zeros(0, int)], strict=True):
        start[number], held[number] = begin, np.where(split, 0, end - begin)
        parts = np.column_stack([begin, end]).ravel()[:-1]  # what lies between two boxes is dropped again
        box_low[number] = np.minimum.reduceat(low[order[: end[-1]]], parts)[::2]
        box_high[number] = np.maximum.reduceat(high[order[: end[-1]]], parts)[::2]
        parent = number[split]
        left[parent], right[parent] = parent + 1, parent + 1 + below[::2]
        number = np.column_stack([left[parent], right[parent]]).ravel()
    return Bvh(box_low, box_high, left, right, start, held, order)


def _levels(centre: np.ndarray) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """Order (k,) of triangles of these middles (k, 3), and of each level of the tree the boxes' parts of it:
    begin and end, ascending; the next level has the two halves of each that is no leaf."""
    order = np.arange(len(centre))
    begin, end = np.array([0]), np.array([len(centre)])
    levels = []
    while len(begin):
        levels.append((begin, end))
        split = end - begin > _LEAF
        begin, end = begin[split], end[split]
        size = end - begin
        first = np.cumsum(size) - size
        box = np.repeat(np.arange(len(size)), size)
        place = np.arange(len(box)) + (begin - first)[box]
        members = order[place]
        if len(box):
            inside = centre[members]
            spread = np.maximum.reduceat(inside, first) - np.minimum.reduceat(inside, first)
            along = inside[np.arange(len(box)), spread.argmax(axis=1)[box]]
            order[place] = members[np.lexsort((along, box))]
        middle = (begin + end) // 2
        begin, end = (np.column_stack(pair).ravel() for pair in ((begin, middle), (middle, end)))
    return order, levels


@kernel
def closest_on_triangle(p, a, b, c):
    """(squared distance from p to the triangle a b c, and the closest point's three barycentric weights).

    Regions of the plane by sign tests (Ericson, Real-Time Collision Detection, section 5.1.5).
    """
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    apx, apy, apz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    ab2 = abx * abx + aby * aby + abz * abz
    ac2 = acx * acx + acy * acy + acz * acz
    abac = abx * acx + aby * acy + abz * acz
    d3, d4 = d1 - ab2, d2 - abac  # from b
    d5, d6 = d1 - abac, d2 - ac2  # from c
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        u, v, w = 1.0, 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        u, v, w = 0.0, 1.0, 0.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        u, w = 1.0 - v, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        u, v, w = 0.0, 0.0, 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        u, v = 1.0 - w, 0.0
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        u, v = 0.0, 1.0 - w
    else:
        total = va + vb + vc
        v, w = vb / total, vc / total
        u = 1.0 - v - w
    squared = 0.0
    for k in range(3):
        e = p[k] - (u * a[k] + v * b[k] + w * c[k])
        squared += e * e
    return squared, u, v, w


@kernel
def _box_distance(p, low, high):
    squared = 0.0
    for k in range(3):
        e = max(low[k] - p[k], 0.0, p[k] - high[k])
        squared += e * e
    return squared


@kernel
def closest_triangle(bvh, vertices, triangles, p, limit, weights, stack):
    """(triangle, distance) of the closest point within `limit` m, or (-1, limit); writes its weights (3,).

    stack: (STACK,) int64 to work on.
    """
    best = limit * limit
    found = -1
    top = 0
    stack[0] = 0
    while top >= 0:
        box = stack[top]
        top -= 1
        if _box_distance(p, bvh.low[box], bvh.high[box]) >= best:
            continue
        if bvh.held[box] > 0:
            for k in range(bvh.start[box], bvh.start[box] + bvh.held[box]):
                t = bvh.order[k]
                squared, u, v, w = closest_on_triangle(
                    p, vertices[triangles[t, 0]], vertices[triangles[t, 1]], vertices[triangles[t, 2]]
                )
                if squared < best:
                    best = squared
                    found = t
                    weights[0], weights[1], weights[2] = u, v, w
        else:
            left, right = bvh.left[box], bvh.right[box]
            to_left = _box_distance(p, bvh.low[left], bvh.high[left])
            to_right = _box_distance(p, bvh.low[right], bvh.high[right])
            if to_left < to_right:  # the nearer child is searched first
                left, right = right, left
            stack[top + 1] = left
            stack[top + 2] = right
            top += 2
    return found, np.sqrt(best)
