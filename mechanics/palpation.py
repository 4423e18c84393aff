"""One palpation of a model: where it touched, how deep, and the 1D models fitted to it."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path

from mechanics.errors import ModelError
from mechanics.files import atomic_file

NAN = float("nan")


@dataclass(frozen=True)
class Palpation:
    """A row of `palpations.csv`: SI units, device frame; a value that could not be found is NaN.

    t_onset, t_peak: s, first touch and greatest force. x, y, z: m, surface point at first touch.
    nx, ny, nz: outward unit normal there. depth: m, greatest travel of the tip's centre along -n.
    k_kv (N/m), b_kv (N s/m): Kelvin-Voigt, eq. (1). k_hc (N/m^r), b_hc (N s/m^(r+1)), r_hc: Hunt-Crossley,
    eq. (2). k_v (N/m), eq. (5); k_c (N/m^r), r_c, eq. (6): without damping. k_h (N/m^r): eq. (6) again with
    the recording's mean exponent. e_pa: Pa, modulus of this palpation alone, eq. (13). Equations: Goksel
    et al.
    """

    t_onset: float
    t_peak: float
    x: float
    y: float
    z: float
    nx: float
    ny: float
    nz: float
    depth: float
    k_kv: float = NAN
    b_kv: float = NAN
    k_hc: float = NAN
    b_hc: float = NAN
    r_hc: float = NAN
    k_v: float = NAN
    k_c: float = NAN
    r_c: float = NAN
    k_h: float = NAN
    e_pa: float = NAN

    @property
    def point(self) -> tuple[float, float, float]:
        """(x, y, z), m."""
        return (self.x, self.y, self.z)

    @property
    def normal(self) -> tuple[float, float, float]:
        """(nx, ny, nz), outward."""
        return (self.nx, self.ny, self.nz)


COLUMNS = tuple(f.name for f in fields(Palpation))


def write_palpations(path: Path | str, palpations: Iterable[Palpation]) -> None:
    """Write `palpations.csv`: a header of the contract's columns, a row a palpation."""
    with atomic_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for palpation in palpations:
            writer.writerow([repr(float(getattr(palpation, c))) for c in COLUMNS])


def read_palpations(path: Path | str) -> tuple[Palpation, ...]:
    """Read `palpations.csv`; raises ModelError where a column is missing or a value is no number."""
    path = Path(path)
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise ModelError(f"'{path}' cannot be read: {error.strerror}") from error
    missing = [c for c in COLUMNS if rows and c not in rows[0]]
    if missing:
        raise ModelError(f"'{path}' lacks the columns {', '.join(missing)}")
    try:
        return tuple(Palpation(**{c: float(row[c]) for c in COLUMNS}) for row in rows)
    except (TypeError, ValueError) as error:
        raise ModelError(f"'{path}' has a value that is no number: {error}") from error
