"""A block of structured tetrahedra with a fixed base, for tests that need no mesher."""

from __future__ import annotations

import itertools

import numpy as np

from palpate.mechanics.shape.tetmesh import TetMesh


def box(size: tuple[float, float, float], cells: tuple[int, int, int]) -> TetMesh:
    """Linear tetrahedra in [-x/2, x/2] x [-y/2, y/2] x [0, z], base fixed, the rest of the surface
    touchable."""
    axes = [np.linspace(0, length, n + 1) for length, n in zip(size, cells, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    points -= [size[0] / 2, size[1] / 2, 0]
    shape = tuple(n + 1 for n in cells)
    corner = np.stack(np.meshgrid(*(np.arange(n) for n in cells), indexing="ij"), axis=-1).reshape(-1, 3)
    tetrahedra = []
    for order in itertools.permutations(range(3)):
        path = [np.zeros(3, dtype=int)]
        for axis in order:
            path.append(path[-1] + np.eye(3, dtype=int)[axis])
        ids = np.stack([np.ravel_multi_index(tuple((corner + step).T), shape) for step in path], axis=1)
        even = np.linalg.det(np.eye(3)[list(order)]) > 0
        tetrahedra.append(ids if even else ids[:, [0, 2, 1, 3]])
    low = np.isclose(points[:, 2], 0)
    outside = np.zeros(len(points), dtype=bool)
    for axis in range(3):
        extreme = (points[:, axis].min(), points[:, axis].max())
        outside |= np.isclose(points[:, axis], extreme[0]) | np.isclose(points[:, axis], extreme[1])
    return TetMesh(points, np.vstack(tetrahedra), low, outside & ~low)
