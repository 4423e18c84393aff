"""What parts a mesh says that it has: closed bodies beside or inside one another, and labels of its cells.

Each part is what its own triangles enclose; where parts overlap, as a tumour in a liver, the smaller one
counts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.shape.nearest import inside

_MOST = 50
"""More labels than these number cells, not materials."""

_SPECK = 1e-4
"""Of the largest body's volume: a smaller one beside it is dust of a scanner."""


@dataclass(frozen=True)
class Part:
    """A body or label: its volume, m^3, and its own closed surface, vertices (n, 3) m in the file's frame,
    triangles (k, 3)."""

    name: str
    volume_m3: float
    vertices: np.ndarray
    triangles: np.ndarray


def words_of(parts: Sequence[Part], moduli: Mapping[str, float] | None = None) -> str:
    """'liver 1200 cm³, tumour 4.2 cm³'; with the modulus of each, Pa, where it has one."""
    return ", ".join(
        f"{part.name} {1e6 * part.volume_m3:.4g} cm³"
        + (f" of {moduli[part.name] / 1e3:.4g} kPa" if moduli else "")
        for part in parts
    )


def shares(parts: Sequence[Part], points: np.ndarray) -> np.ndarray:
    """(m, parts) share of each cell's points (m, q, 3) m in each part; a point in none is of the largest."""
    flat = points.reshape(-1, 3)
    order = sorted(range(len(parts)), key=lambda k: -parts[k].volume_m3)
    owner = np.full(len(flat), order[0])
    for k in order[1:]:
        owner[inside(parts[k].vertices, parts[k].triangles, flat)] = k
    return (owner.reshape(points.shape[:2])[:, :, None] == np.arange(len(parts))).mean(axis=1)


def without_specks(shell: Any) -> tuple[Any, tuple[str, ...]]:
    """A shell of closed bodies without those that are dust beside the largest, as scanners leave it; what was
    left out. What lies inside of the largest is no dust, however small."""
    each = shell.split(only_watertight=True, repair=False)
    volume = np.array([abs(float(body.volume)) for body in each])
    small = np.flatnonzero(volume < _SPECK * volume.max(initial=0.0))
    if not len(small):
        return shell, ()
    largest = each[int(volume.argmax())]
    middles = np.array([each[k].vertices.mean(axis=0) for k in small])
    gone = [each[k] for k in small[~inside(largest.vertices, largest.faces, middles)]]
    if not gone:
        return shell, ()
    nodes = {tuple(vertex) for body in gone for vertex in np.asarray(body.vertices)}
    kept = shell.copy()
    corner = np.asarray(kept.vertices)[np.asarray(kept.faces)[:, 0]]
    kept.update_faces(np.array([tuple(vertex) not in nodes for vertex in corner]))
    kept.remove_unreferenced_vertices()
    return kept, (f"{len(gone)} speck{'s' * (len(gone) > 1)} beside it left out",)


def bodies(shell: Any, path: Path | None, metres: float) -> tuple[Part, ...]:
    """The closed bodies of a shell of triangles in a unit of so many metres; empty where it is one. Named as
    the objects or groups of an OBJ file are that lie there."""
    each = shell.split(only_watertight=True, repair=False)
    if len(each) < 2:
        return ()
    named = _groups(path) if path is not None and path.suffix.lower() == ".obj" else {}
    found = []
    for k, body in enumerate(each):
        off = {name: float(np.abs(body.bounds - bounds).max()) for name, bounds in named.items()}
        near = min(off, key=lambda name: off[name]) if off else ""
        name = near if off and off[near] < 1e-3 * float(body.scale) else f"body {k + 1}"
        triangles = np.asarray(body.faces, dtype=np.int64)
        volume = abs(float(body.volume)) * metres**3
        found.append(Part(name, volume, np.asarray(body.vertices) * metres, triangles))
    return tuple(found)


def _groups(path: Path) -> dict[str, np.ndarray]:
    """Name -> (2, 3) bounds of each object or group of an OBJ file."""
    places: list[list[float]] = []
    members: dict[str, list[int]] = {}
    name = ""
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            places.append([float(word) for word in words[1:4]])
        elif words and words[0] in ("o", "g"):
            name = " ".join(words[1:])
        elif words[:1] == ["f"]:
            numbers = [int(word.split("/")[0]) for word in words[1:]]
            members.setdefault(name, []).extend(n - 1 if n > 0 else len(places) + n for n in numbers)
    held = np.array(places)
    return {n: np.array([held[m].min(0), held[m].max(0)]) for n, m in members.items() if n}


def labels(grid: Any, names: Mapping[int, str], metres: float) -> tuple[Part, ...]:
    """The parts that a whole-numbered array of a grid's solid cells tells apart, by volume; empty where none
    does."""
    for key in grid.cell_data:
        values = np.asarray(grid.cell_data[key])
        if values.ndim != 1 or values.dtype.kind not in "iuf" or not (values == np.round(values)).all():
            continue
        which = np.unique(values)
        if not 2 <= len(which) <= _MOST or key in _NO_LABELS:
            continue
        sizes = np.abs(grid.compute_cell_sizes(length=False, area=False)["Volume"]) * metres**3
        return tuple(
            Part(
                names.get(int(value), f"{key} {int(value)}"),
                float(sizes[values == value].sum()),
                *_boundary(grid.extract_cells(np.flatnonzero(values == value)), metres),
            )
            for value in which
        )
    return ()


def _boundary(grid: Any, metres: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, m, and triangles of the outer faces of solid cells."""
    faces = grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=0).triangulate()
    return np.asarray(faces.points, dtype=float) * metres, np.asarray(faces.regular_faces, dtype=np.int64)


_NO_LABELS = ("vtkOriginalCellIds", "cell_ids", "gmsh:geometrical")
