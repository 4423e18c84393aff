"""Uniaxial compression of cylinders between platens (Instron exports): the modulus of small strain, and how
the material stiffens or softens beyond."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from mechanics.effects.strain_stiffening import GREATEST, LEAST, hardening
from mechanics.errors import RecordingError


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
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise RecordingError(f"'{path}' cannot be read: {error.strerror}") from error
    start = next((i for i, line in enumerate(lines) if line.lower().startswith("time")), None)
    if start is None:
        raise RecordingError(f"'{path}' has no header line that starts with 'Time'")
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


def small_strain_modulus(test: Compression, *, low: float = 0.0, high: float = 0.05) -> float:
    """Slope (Pa) of a straight line through stress over strain between two strains.

    It is Young's modulus only where the platens let the faces slide; bonded faces raise it.
    """
    used = (test.strain >= low) & (test.strain <= high)
    if used.sum() < 3:
        raise RecordingError(f"fewer than 3 samples lie between the strains {low} and {high}")
    return float(np.polyfit(test.strain[used], test.stress[used], 1)[0])


@dataclass(frozen=True)
class Elastomer:
    """An incompressible material: Young's modulus, Pa, and c20 / c10 of effects.strain_stiffening."""

    young_modulus_pa: float
    c20_over_c10: float

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Pa, force over the first area, positive in compression, at engineering strains (n,) below 1."""
        return self.young_modulus_pa * _unit_stress(strain, self.c20_over_c10)


def _unit_stress(strain: np.ndarray, ratio: float) -> np.ndarray:
    stretch = 1 - np.asarray(strain, dtype=float)
    h, _ = hardening(stretch**2 + 2 / stretch - 3, ratio)
    return h * (stretch**-2 - stretch) / 3


def fit_elastomer(
    tests: Sequence[Compression],
    *,
    to_strain: float = 0.4,
    from_strain: float = 0.02,
    ratio: float | None = None,
) -> Elastomer:
    """The material whose stress errs least, in shares of each test's greatest, between two strains.

    ratio: c20 / c10, where it is known. The faces are taken to slide on the platens. Raises RecordingError
    where no sample lies there.
    """
    parts = [(t, (t.strain >= from_strain) & (t.strain <= to_strain)) for t in tests]
    if not parts or min(use.sum() for _, use in parts) < 3:
        raise RecordingError(f"fewer than 3 samples lie between the strains {from_strain} and {to_strain}")
    strain = np.concatenate([t.strain[use] for t, use in parts])
    stress = np.concatenate([t.stress[use] for t, use in parts])
    weight = np.concatenate([np.full(use.sum(), 1 / t.stress[use].max()) for t, use in parts])

    def modulus(ratio: float) -> tuple[float, float]:
        unit = weight * _unit_stress(strain, ratio)
        e = float(unit @ (weight * stress) / (unit @ unit))
        return e, float(((e * unit - weight * stress) ** 2).sum())

    if ratio is not None:
        return Elastomer(modulus(ratio)[0], ratio)
    best = minimize_scalar(lambda r: modulus(r)[1], bounds=(LEAST, GREATEST), method="bounded")
    return Elastomer(modulus(best.x)[0], float(best.x))
