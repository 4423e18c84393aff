"""Gmsh: the mesh with its physical groups object, base and touchable, and the modulus of each tetrahedron.

Written here and not by meshio, whose writer of element data breaks under NumPy 2.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.exporting.subject import Subject

_KINDS = {4: 4, 10: 11, 3: 2, 6: 9}
"""Nodes of an element -> Gmsh's number of its type."""
_GROUPS = ((3, 1, "object"), (2, 2, "base"), (2, 3, "touchable"))


def write(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the mesh (MSH 2.2, which every Gmsh reads); what it cannot say."""
    mesh = subject.mesh
    base = mesh.fixed[mesh.surface].all(axis=1)
    # Gmsh numbers the last two edges of a quadratic tetrahedron the other way round
    solid = mesh.tetrahedra if mesh.order == 1 else mesh.tetrahedra[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(_GROUPS))]
    lines += [f'{dimension} {tag} "{name}"' for dimension, tag, name in _GROUPS]
    lines += ["$EndPhysicalNames", "$Nodes", str(len(mesh.points))]
    lines += [f"{i} {x:.12g} {y:.12g} {z:.12g}" for i, (x, y, z) in enumerate(mesh.points, 1)]
    lines += ["$EndNodes", "$Elements", str(len(solid) + len(mesh.surface))]
    number = 0
    for (_, tag, _), block in zip(_GROUPS, (solid, mesh.surface[base], mesh.surface[~base]), strict=True):
        kind = _KINDS[block.shape[1]]
        for row in block + 1:
            number += 1
            lines.append(f"{number} {kind} 2 {tag} {tag} " + " ".join(map(str, row)))
    moduli = np.concatenate([subject.element_modulus_pa, np.zeros(len(mesh.surface))])
    lines += [
        "$EndElements",
        "$ElementData",
        "1",
        '"young_modulus_pa"',
        "1",
        "0.0",
        "3",
        "0",
        "1",
        str(number),
    ]
    lines += [f"{i} {value:.9g}" for i, value in enumerate(moduli, 1)]
    lines += ["$EndElementData", ""]
    path.write_text("\n".join(lines), encoding="ascii")
    return ("a mesh and its moduli (0 on faces): no material law, support or tip",)
