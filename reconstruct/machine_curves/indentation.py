"""Spherical indentation: text exports of an Optics11 Chiaro."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.mechanics.errors import RecordingError


@dataclass(frozen=True)
class Indentation:
    """One approach and retract: t (n,) s, travel (n,) m of the tip into the sample from an arbitrary zero,
    force (n,) N.

    tip_radius_m, stiffness_n_per_m: of the probe. stated_modulus_pa: what the maker's software fitted, for a
    Poisson's ratio of 0.5; NaN where the file says nothing.
    """

    t: np.ndarray
    travel: np.ndarray
    force: np.ndarray
    tip_radius_m: float
    stiffness_n_per_m: float
    stated_modulus_pa: float


def read_chiaro(path: Path | str) -> Indentation:
    """Read the text export of a Chiaro indenter (Latin-1, header, tab-separated samples).

    The tip's travel into the sample is piezo minus cantilever; the file's own `Indentation` is zero before
    the maker's contact point. Raises RecordingError where a needed line or column is missing.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="latin-1").splitlines()
    except OSError as error:
        raise RecordingError(f"'{path}' cannot be read: {error.strerror}") from error
    number = next((i for i, line in enumerate(lines) if line.startswith("Time (s)")), None)
    if number is None:
        raise RecordingError(f"'{path}' has no line 'Time (s) ...': it is no Chiaro text export")
    header = {
        key.strip(): value.strip() for key, _, value in (line.partition("\t") for line in lines[:number])
    }
    try:
        radius, stiffness = float(header["Tip radius (um)"]) * 1e-6, float(header["k (N/m)"])
        columns = [name.strip() for name in lines[number].split("\t")]
        data = np.loadtxt(lines[number + 1 :], delimiter="\t", usecols=range(len(columns)), ndmin=2)
        picked = [
            data[:, columns.index(c)] for c in ("Time (s)", "Load (uN)", "Cantilever (nm)", "Piezo (nm)")
        ]
    except (KeyError, ValueError, IndexError) as error:
        raise RecordingError(f"'{path}' lacks {error}: export time, load, cantilever and piezo") from error
    t, load, cantilever, piezo = picked
    return Indentation(
        t,
        (piezo - cantilever) * 1e-9,
        load * 1e-6,
        radius,
        stiffness,
        float(header.get("E[v=0.500] (Pa)", "nan")),
    )
