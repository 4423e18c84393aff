"""Meshes in Gmsh's first format ($NOD, $ELM), which libraries read no more."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

_CELLS = {
    2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4), 5: ("hexahedron", 8), 6: ("wedge", 6),
    7: ("pyramid", 5), 9: ("triangle6", 6), 11: ("tetra10", 10),
}  # fmt: skip
"""Gmsh's number of a kind of element -> meshio's name, and its nodes."""


def is_gmsh1(path: Path) -> bool:
    """Whether the file begins as that format does."""
    with path.open("rb") as file:
        return file.read(64).lstrip().startswith(b"$NOD")


def read_gmsh1(path: Path) -> Any:
    """The mesh as meshio's, its regions as cell data "gmsh:physical". Raises ValueError for a damaged
    file."""
    import meshio

    lines = [line.split() for line in path.read_text(encoding="utf-8", errors="replace").splitlines()]
    nodes = np.array(_section(lines, "$NOD"), dtype=float)
    at = {int(number): k for k, number in enumerate(nodes[:, 0])}
    cells: dict[str, list[list[int]]] = {}
    regions: dict[str, list[int]] = {}
    for row in _section(lines, "$ELM"):
        _, kind, physical, _, count, *members = map(int, row)
        name, size = _CELLS.get(kind, ("", 0))
        if not name:  # points and lines
            continue
        if count != size or len(members) != size:
            raise ValueError(f"an element of kind {kind} has {len(members)} nodes, {size} are due")
        cells.setdefault(name, []).append([at[member] for member in members])
        regions.setdefault(name, []).append(physical)
    blocks = [(name, np.array(rows)) for name, rows in cells.items()]
    held = {"gmsh:physical": [np.array(regions[name]) for name, _ in blocks]}
    return meshio.Mesh(nodes[:, 1:4], blocks, cell_data=held)


def _section(lines: list[list[str]], name: str) -> list[list[str]]:
    """The rows between a section's name with its count, and its end."""
    starts = [k for k, words in enumerate(lines) if words == [name]]
    if not starts:
        raise ValueError(f"no section {name}")
    count = int(lines[starts[0] + 1][0])
    rows = lines[starts[0] + 2 : starts[0] + 2 + count]
    if len(rows) < count or any(words[:1] and words[0].startswith("$") for words in rows):
        raise ValueError(f"section {name} ends before its {count} rows")
    return rows
