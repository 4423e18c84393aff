"""The files of a table of presses: samples and all, and one row a press for people."""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.disk.store import read_arrays, write_arrays
from mechanics.disk.writing import atomic_file
from mechanics.errors import CacheError, ModelError
from mechanics.presses.table import FITS, PRESS_COLUMNS, ROW_COLUMNS, Noise, Presses
from mechanics.recording.segments import KINDS, Segment

_FORMAT = "presses 1"

CSV_COLUMNS = ("t_onset", "t_peak", "x", "y", "z", "nx", "ny", "nz", "depth", *FITS)


def write_csv(path: Path | str, presses: Presses) -> None:
    """Write `palpations.csv`: a row a press, the contract's columns, SI units, device frame."""
    table = np.column_stack(
        [presses.onset_s, presses.peak_s, presses.point, presses.normal, presses.depth_m]
        + [presses.fits[n] for n in FITS]
    )
    with atomic_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CSV_COLUMNS)
        writer.writerows([repr(float(v)) for v in row] for row in table)


_NUMBERS = ("tip_radius_m", "sample_rate_hz", "delay_s", "delay_error_s", "block")


def write_presses(path: Path, presses: Presses) -> None:
    """Write the table as it stands, samples and all (views with further columns lose those)."""
    arrays = {
        n: getattr(presses, n) for n in (*ROW_COLUMNS, *PRESS_COLUMNS) if getattr(presses, n) is not None
    }
    arrays |= {f"fit {n}": v for n, v in presses.fits.items()}
    arrays["numbers"] = np.array([float(getattr(presses, n)) for n in _NUMBERS])
    arrays["noise"] = np.array(dataclasses.astuple(presses.noise))
    arrays["segments"] = np.array(
        [[KINDS.index(s.kind), s.start_s, s.end_s] for s in presses.segments], dtype=float
    ).reshape(-1, 3)
    arrays["recording"] = np.frombuffer(presses.recording.encode(), dtype=np.uint8)
    write_arrays(path, _FORMAT, arrays)


def read_presses(path: Path) -> Presses:
    """Read what `write_presses` wrote; raises ModelError where the file is damaged."""
    try:
        arrays = read_arrays(path, _FORMAT)
        named: dict[str, Any] = {
            n: np.array(arrays[n]) for n in (*ROW_COLUMNS, *PRESS_COLUMNS) if n in arrays
        }
        named |= zip(_NUMBERS, arrays["numbers"].tolist(), strict=True)
        named["block"] = int(named["block"])
        return Presses(
            **named,
            fits={n: np.array(arrays[f"fit {n}"]) for n in FITS},
            noise=Noise(*arrays["noise"].tolist()),
            segments=tuple(Segment(KINDS[int(k)], a, b) for k, a, b in arrays["segments"].tolist()),
            recording=bytes(arrays["recording"]).decode(),
        )
    except (CacheError, KeyError, ValueError, TypeError, IndexError) as error:
        raise ModelError(f"'{path}' is damaged ({error}): reconstruct the model again") from error
