"""Uniaxial compression of cylinders between platens: Instron exports."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.mechanics.disk.reading import reading
from palpate.mechanics.errors import RecordingError


@dataclass(frozen=True)
class Compression:
    """Loading of a cylinder: strain (n,) engineering, positive in compression; stress (n,) Pa, force over the
    first area."""

    strain: np.ndarray
    stress: np.ndarray
    diameter_m: float
    height_m: float


def read_compression(path: Path | str) -> Compression:
    """Read one test: `key: value;` lines with the cylinder's diameter and height in mm, then comma-separated
    samples.

    Stress comes from load over area, not from the file's own stress column, whose unit its documentation and
    its header disagree about. Raises RecordingError where a line or column is missing.
    """
    path = Path(path)
    lines, start = exported(path)
    sizes = {}
    for key, _, value in (line.partition(":") for line in lines[:start]):
        if key.startswith("Cylinder "):
            sizes[key.split()[1]] = float("".join(c for c in value if c.isdigit() or c == ".")) / 1e3
    if len(sizes) < 2:
        raise RecordingError(f"'{path}' does not state the cylinder's diameter and height")
    separator = ";" if lines[start].count(";") > lines[start].count(",") else ","
    names = [name.strip().lower() for name in lines[start].split(separator)]
    wanted = [next((i for i, n in enumerate(names) if n.startswith(w)), -1) for w in ("compression", "load")]
    if min(wanted) < 0:
        raise RecordingError(
            f"'{path}' needs the columns Compression (mm) and Load (N); it has {', '.join(names)}"
        )
    rows = [line.split(separator) for line in lines[start + 1 :] if line.strip(" ;,")]
    try:
        compression, load = (np.array([float(row[i]) for row in rows]) for i in wanted)
    except (ValueError, IndexError) as error:
        raise RecordingError(f"'{path}' has a row that is no numbers: {error}") from error
    area = np.pi * sizes["Diameter"] ** 2 / 4
    return Compression(
        np.abs(compression) / 1e3 / sizes["Height"], np.abs(load) / area, sizes["Diameter"], sizes["Height"]
    )


def exported(path: Path) -> tuple[list[str], int]:
    """The lines of an export, and the number of the one that heads its columns: it starts with 'Time'. Raises
    RecordingError where there is none."""
    with reading(path, RecordingError):
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    start = next((i for i, line in enumerate(lines) if line.lower().startswith("time")), None)
    if start is None:
        raise RecordingError(f"'{path}' has no header line that starts with 'Time'")
    return lines, start
