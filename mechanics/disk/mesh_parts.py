"""What parts a mesh says that it has: closed bodies beside or inside one another, and labels of its cells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

_MOST = 50
"""More labels than these number cells, not materials."""


@dataclass(frozen=True)
class Part:
    """A body or label, and its volume, m^3."""

    name: str
    volume_m3: float


def words_of(parts: Sequence[Part]) -> str:
    """'liver 1200 cm³, tumour 4.2 cm³'."""
    return ", ".join(f"{part.name} {1e6 * part.volume_m3:.4g} cm³" for part in parts)


def bodies(shell: Any, path: Path | None, metres: float) -> tuple[Part, ...]:
    """The closed bodies of a shell of triangles in a unit of so many metres; empty where it is one. Named as
    the objects or groups of an OBJ file are that lie there."""
    each = shell.split(only_watertight=True)
    if len(each) < 2:
        return ()
    named = _groups(path) if path is not None and path.suffix.lower() == ".obj" else {}
    found = []
    for k, body in enumerate(each):
        off = {name: float(np.abs(body.bounds - bounds).max()) for name, bounds in named.items()}
        near = min(off, key=lambda name: off[name]) if off else ""
        name = near if off and off[near] < 1e-3 * float(body.scale) else f"body {k + 1}"
        found.append(Part(name, abs(float(body.volume)) * metres**3))
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
            Part(names.get(int(value), f"{key} {int(value)}"), float(sizes[values == value].sum()))
            for value in which
        )
    return ()


_NO_LABELS = ("vtkOriginalCellIds", "cell_ids", "gmsh:geometrical")
