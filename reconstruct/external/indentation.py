"""Spherical indentation of an Optics11 Chiaro, and the modulus of one approach with a free contact point."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from mechanics.dent import dent_law
from mechanics.errors import ContactError, RecordingError
from mechanics.robust import spread_about_zero


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


@dataclass(frozen=True)
class ApproachFit:
    """Modulus (Pa), travel at first touch (m), greatest indentation (m) over the radius, and share
    explained."""

    modulus_pa: float
    onset_m: float
    depth_over_radius: float
    r_squared: float


def fit_approach(indentation: Indentation, *, poisson_ratio: float = 0.5, law: str = "hertz") -> ApproachFit:
    """Modulus of the approach on a half-space, contact point free; law: a dent law of mechanics.dent.

    For each contact point the modulus is linear least squares; the point is where the residual's derivative
    vanishes. Raises ContactError where the force never rises above its noise.
    """
    top = int(np.argmax(indentation.force))
    start = int(np.argmin(indentation.travel[: top + 1]))
    travel, force = indentation.travel[start : top + 1], indentation.force[start : top + 1]
    baseline = np.median(force[: max(10, len(force) // 5)])
    force = force - baseline
    noise = spread_about_zero(force[: max(10, len(force) // 5)])
    if not force.max() > 8 * noise:
        raise ContactError("the force of the approach never rises above its noise: no contact")
    nu = min(poisson_ratio, 0.4999)
    dent = dent_law(law, nu)

    def fitted(onset: float) -> tuple[float, float]:
        shape = np.asarray(dent.force(np.maximum(travel - onset, 0.0), 1.0, nu, indentation.tip_radius_m))
        e = float(shape @ force / max(shape @ shape, 1e-300))
        return e, float(((force - e * shape) ** 2).sum())

    candidates = np.linspace(travel.min(), travel.max() - 0.05 * np.ptp(travel), 60)
    best = int(np.argmin([fitted(c)[1] for c in candidates]))
    low, high = candidates[max(best - 1, 0)], candidates[min(best + 1, len(candidates) - 1)]
    step = 1e-4 * (high - low)

    def slope(onset: float) -> float:
        return fitted(onset + step)[1] - fitted(onset - step)[1]

    onset = brentq(slope, low, high) if slope(low) * slope(high) < 0 else candidates[best]
    e, cost = fitted(onset)
    total = float(((force - force.mean()) ** 2).sum())
    return ApproachFit(
        e, float(onset), float((travel.max() - onset) / indentation.tip_radius_m), 1 - cost / total
    )
