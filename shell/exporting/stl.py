"""STL: the object's whole boundary, base included."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from palpate.exporting.subject import Subject
from palpate.mechanics.disk.surface_files import UNITS

HEADER = b"Palpate model"


def write(path: Path, subject: Subject, unit: str = "m") -> tuple[str, ...]:
    """Write the surface with lengths in `unit`; what it cannot say."""
    import trimesh.exchange.stl

    mesh = subject.mesh.linear()
    used, index = np.unique(mesh.surface, return_inverse=True)
    shell = trimesh.Trimesh(mesh.points[used] / UNITS[unit], index.reshape(-1, 3), process=False)
    binary = trimesh.exchange.stl.export_stl(shell)
    path.write_bytes(HEADER.ljust(80) + binary[80:])
    return (f"lengths in {unit}: read it with --unit {unit}", "a shape alone: no modulus, no support")
