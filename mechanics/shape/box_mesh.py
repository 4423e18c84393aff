"""A structured block: the mesh of reference problems in tests and benchmarks."""

from __future__ import annotations

import itertools

import numpy as np

from palpate.mechanics.shape.tetmesh import TetMesh


def box_mesh(cells: tuple[int, int, int], size: tuple[float, float, float], grade: float = 1.0) -> TetMesh:
    """A box, size in m, base at z = 0 fixed, centred in x and y, six tetrahedra a cell.

    cells: along x, y, z. grade > 1 makes cells finer towards the middle of the top.
    """
    axes = []
    for k, (count, length) in enumerate(zip(cells, size, strict=True)):
        t = np.linspace(0, 1, count + 1)
        if k < 2:
            s = 2 * t - 1
            axes.append(np.sign(s) * np.abs(s) ** grade * length / 2)
        else:
            axes.append((1 - (1 - t) ** grade) * length)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    points = grid.reshape(-1, 3)
    index = np.arange(len(points)).reshape(grid.shape[:3])
    nx, ny, nz = cells
    corner = {
        (i, j, k): index[i : nx + i, j : ny + j, k : nz + k].ravel()
        for i, j, k in itertools.product((0, 1), repeat=3)
    }
    tetrahedra = []
    for order in itertools.permutations(range(3)):
        bits, path = [0, 0, 0], [corner[(0, 0, 0)]]
        for axis in order:
            bits[axis] = 1
            path.append(corner[bits[0], bits[1], bits[2]])
        tets = np.stack(path, axis=1)
        p = points[tets[0]]
        if np.linalg.det(p[1:] - p[0]) < 0:
            tets = tets[:, [0, 2, 1, 3]]
        tetrahedra.append(tets)
    fixed = points[:, 2] == 0
    inside = np.abs(points[:, :2]) < np.array(size[:2]) / 2 - 1e-12
    surface = ~(inside.all(axis=1) & (points[:, 2] < size[2] - 1e-12))
    return TetMesh(points, np.vstack(tetrahedra), fixed, surface & ~fixed)
