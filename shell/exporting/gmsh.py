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
"""Dimension, tag (of the group and of its one entity) and name."""


def write(path: Path, subject: Subject) -> tuple[str, ...]:
    """Write the mesh (MSH 4.1: meshio cannot read an older one's element data); what it cannot say."""
    mesh = subject.mesh
    base = mesh.fixed[mesh.surface].all(axis=1)
    # Gmsh numbers the last two edges of a quadratic tetrahedron the other way round
    solid = mesh.tetrahedra if mesh.order == 1 else mesh.tetrahedra[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
    blocks = [
        (group, block)
        for group, block in zip(_GROUPS, (solid, mesh.surface[base], mesh.surface[~base]), strict=True)
        if len(block)
    ]
    count, total = len(mesh.points), sum(len(block) for _, block in blocks)
    moduli = np.concatenate([subject.element_modulus_pa, np.zeros(total - len(solid))])
    lines = [
        *_section("MeshFormat", ["4.1 0 8"]),
        *_section("PhysicalNames", [str(len(_GROUPS)), *(f'{d} {tag} "{name}"' for d, tag, name in _GROUPS)]),
        *_section("Entities", _entities(mesh.points, [group for group, _ in blocks])),
        *_section("Nodes", [
            f"1 {count} 1 {count}", f"3 1 0 {count}", *map(str, range(1, count + 1)),
            *(f"{x:.12g} {y:.12g} {z:.12g}" for x, y, z in mesh.points),
        ]),
        *_section("Elements", [f"{len(blocks)} {total} 1 {total}", *_elements(blocks)]),
        *_section("ElementData", [
            "1", '"young_modulus_pa"', "1", "0.0", "3", "0", "1", str(total),
            *(f"{i} {value:.9g}" for i, value in enumerate(moduli, 1)),
        ]),
        "",
    ]  # fmt: skip
    path.write_text("\n".join(lines), encoding="ascii")
    return ("a mesh and its moduli (0 on faces): no material law, support or tip",)


def _section(name: str, lines: list[str]) -> list[str]:
    return [f"${name}", *lines, f"$End{name}"]


def _entities(points: np.ndarray, groups: list[tuple[int, int, str]]) -> list[str]:
    """Of every group one, none bounded by another; the box is the mesh's."""
    box = " ".join(f"{v:.12g}" for v in (*points.min(axis=0), *points.max(axis=0)))
    faces = [f"{tag} {box} 1 {tag} 0" for dimension, tag, _ in groups if dimension == 2]
    return [f"0 0 {len(faces)} 1", *faces, f"1 {box} 1 1 0"]


def _elements(blocks: list[tuple[tuple[int, int, str], np.ndarray]]) -> list[str]:
    lines, number = [], 0
    for (dimension, tag, _), block in blocks:
        lines.append(f"{dimension} {tag} {_KINDS[block.shape[1]]} {len(block)}")
        for row in block + 1:
            number += 1
            lines.append(f"{number} " + " ".join(map(str, row)))
    return lines
