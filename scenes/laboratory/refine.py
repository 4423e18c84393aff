"""Local refinement of tetrahedra by bisection of longest edges (Rivara 1984): conforming and graded."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def boundary_faces(tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(faces (k, 3) outward, their tetrahedra (k,)): faces that belong to one tetrahedron only."""
    faces = tetrahedra[:, _FACES].reshape(-1, 3)
    # one number a face, of at most 2 million nodes: whole rows are compared byte by byte, ten times as slow
    a, b, c = np.sort(faces.astype(np.int64), axis=1).T
    nodes = np.int64(tetrahedra.max()) + 1
    _, index, count = np.unique((a * nodes + b) * nodes + c, return_index=True, return_counts=True)
    single = index[count == 1]
    return faces[single], single // 4


def refine(
    points: np.ndarray,
    tetrahedra: np.ndarray,
    size: Callable[[np.ndarray], np.ndarray],
    project: Callable[[np.ndarray, np.ndarray], np.ndarray],
    *,
    most: int = 120_000,
) -> tuple[np.ndarray, np.ndarray]:
    """Bisect until no tetrahedron's longest edge exceeds `size(its centroid)`.

    `project(midpoints, half_lengths)` moves new nodes of boundary edges onto the true surface. Stops at
    `most` tetrahedra. Returns (points, tetrahedra), orientation kept.
    """
    for _ in range(200):
        edges = np.sort(tetrahedra[:, _EDGES].reshape(-1, 2), axis=1)
        keys = edges[:, 0] * np.int64(len(points)) + edges[:, 1]
        unique, inverse = np.unique(keys, return_inverse=True)
        ends = np.column_stack([unique // len(points), unique % len(points)])
        lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
        # a strict order of all edges (length, then number), so that each tetrahedron has one longest edge
        rank = np.empty(len(unique), dtype=np.int64)
        rank[np.lexsort((np.arange(len(unique)), np.round(lengths, 9)))] = np.arange(len(unique))
        of_tetrahedron = inverse.reshape(-1, 6)
        longest = of_tetrahedron[np.arange(len(tetrahedra)), rank[of_tetrahedron].argmax(axis=1)]
        too_long = lengths[longest] > size(points[tetrahedra].mean(axis=1))
        if not too_long.any() or len(tetrahedra) > most:
            return points, tetrahedra
        marked = np.zeros(len(unique), dtype=bool)
        marked[longest[too_long]] = True
        while True:
            touched = marked[of_tetrahedron].any(axis=1)
            more = touched & ~marked[longest]
            if not more.any():
                break
            marked[longest[more]] = True
        shared = np.bincount(of_tetrahedron.ravel(), minlength=len(unique))
        as_longest = np.bincount(longest, minlength=len(unique))
        split = marked & (shared == as_longest)
        points, tetrahedra = _bisect(points, tetrahedra, ends, longest, split, project)
    return points, tetrahedra


def _bisect(
    points: np.ndarray,
    tetrahedra: np.ndarray,
    ends: np.ndarray,
    longest: np.ndarray,
    split: np.ndarray,
    project: Callable[[np.ndarray, np.ndarray], np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    numbers = np.full(len(split), -1)
    numbers[split] = len(points) + np.arange(split.sum())
    a, b = ends[split].T
    middles = (points[a] + points[b]) / 2
    shell, _ = boundary_faces(tetrahedra)
    shell_edges = np.sort(shell[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    on_shell = np.isin(ends[split] @ [len(points), 1], shell_edges @ [len(points), 1])
    half = np.linalg.norm(points[a] - points[b], axis=1) / 2
    if on_shell.any():
        middles[on_shell] = project(middles[on_shell], half[on_shell])
    parents = np.flatnonzero(split[longest])
    edge = longest[parents]
    first, second = tetrahedra[parents].copy(), tetrahedra[parents].copy()
    first[first == ends[edge, 1][:, None]] = np.repeat(
        numbers[edge], (first == ends[edge, 1][:, None]).sum(1)
    )
    second[second == ends[edge, 0][:, None]] = np.repeat(
        numbers[edge], (second == ends[edge, 0][:, None]).sum(1)
    )
    keep = np.ones(len(tetrahedra), dtype=bool)
    keep[parents] = False
    return np.vstack([points, middles]), np.vstack([tetrahedra[keep], first, second])
