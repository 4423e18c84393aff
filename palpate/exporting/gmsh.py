"""Gmsh: the mesh with its physical groups object, base and touchable, and the modulus of each tetrahedron."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np

from palpate.exporting.subject import Subject


def write(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the mesh (binary MSH 2.2, which every Gmsh reads); what it cannot say."""
    import meshio

    mesh = subject.mesh
    solid, flat = (("tetra", "triangle"), ("tetra10", "triangle6"))[mesh.order - 1]
    base = mesh.fixed[mesh.surface].all(axis=1)
    cells = [(solid, mesh.tetrahedra), (flat, mesh.surface[base]), (flat, mesh.surface[~base])]
    tags = [np.full(len(block), k + 1) for k, (_, block) in enumerate(cells)]
    moduli = [subject.element_modulus_pa, *(np.zeros(len(block)) for _, block in cells[1:])]
    out = meshio.Mesh(
        mesh.points,
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags, "young_modulus_pa": moduli},
        field_data={
            "object": np.array([1, 3]),
            "base": np.array([2, 2]),
            "touchable": np.array([3, 2]),
        },
    )
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        out.write(path, file_format="gmsh22", binary=True)
    return ("a mesh and its moduli: no material law, support or tip",)
