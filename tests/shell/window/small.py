"""A small object for the window's tests: a block meshed by hand, the same every time."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import numpy as np

from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.scenes.virtual_presses import palpate_model

SIZE = np.array([0.08, 0.08, 0.04])
CELLS = (4, 4, 2)


def block_mesh(cells: tuple[int, int, int] = CELLS) -> TetMesh:
    """Six tetrahedra a cube (Kuhn's), linear; the base z = 0 is fixed."""
    axes = [np.linspace(0, s, n + 1) for s, n in zip(SIZE, cells, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3) - [0.04, 0.04, 0.0]
    shape = tuple(n + 1 for n in cells)
    tetrahedra = []
    for cube in np.ndindex(*cells):
        for order in permutations(range(3)):
            corner = np.array(cube)
            nodes = [np.ravel_multi_index(corner, shape)]
            for axis in order:
                corner = corner + np.eye(3, dtype=int)[axis]
                nodes.append(np.ravel_multi_index(corner, shape))
            p = grid[nodes]
            if np.linalg.det(p[1:] - p[0]) < 0:
                nodes[2], nodes[3] = nodes[3], nodes[2]
            tetrahedra.append(nodes)
    fixed = grid[:, 2] < 1e-9
    outside = (np.abs(grid[:, :2]) > 0.04 - 1e-9).any(axis=1) | (grid[:, 2] > SIZE[2] - 1e-9)
    return TetMesh(grid, np.array(tetrahedra), fixed, outside & ~fixed)


def block_model(folder: Path, young_modulus_pa: float = 20e3, cells: tuple[int, int, int] = CELLS) -> Model:
    """A MODEL folder of the block, with presses for the 1D renderers."""
    model = Model(
        mesh=block_mesh(cells).quadratic(),
        material=ObjectMaterial(young_modulus_pa, 0.49, dent_law="neo-hookean"),
        support=Support(np.zeros(3), np.array([0.0, 0.0, 1.0])),
        tool=Tool(0.005),
        mesh_size_m=float(SIZE[0]) / cells[0],
        effects={"finite_strain": {}},
    )
    return read_model(write_model(folder / "block", palpate_model(model, sites=16)))
