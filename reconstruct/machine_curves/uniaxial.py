"""Uniaxial tests of elastomers, in tension or compression: which law of stress over stretch predicts curves
that it has not seen.

Stress is force over the first area (engineering), stretch is length over first length, below 1 in
compression; the material is incompressible and the faces slide on their platens. Every law has a free zero
of the strain, as a machine's first touch is never exact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from palpate.mechanics.disk.reading import reading
from palpate.mechanics.errors import RecordingError


def exported(path: Path) -> tuple[list[str], int]:
    """The lines of an export, and the number of the one that heads its columns: it starts with 'Time'. Raises
    RecordingError where there is none."""
    with reading(path, RecordingError):
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    start = next((i for i, line in enumerate(lines) if line.lower().startswith("time")), None)
    if start is None:
        raise RecordingError(f"'{path}' has no header line that starts with 'Time'")
    return lines, start


MOST_STRAIN = 0.4
BLOCKS = 8
_ROWS = 60
_ZEROS = np.linspace(-0.02, 0.02, 9)
_FUNG = np.concatenate([[0.0], np.geomspace(0.02, 8.0, 12)])
_OGDEN = np.concatenate([np.linspace(-10, -1, 10), np.linspace(1, 10, 10)])


@dataclass(frozen=True)
class Uniaxial:
    """One test: stretch (n,), stress (n,) Pa with the stretch's sign, on the way out. specimen: curves of one
    specimen share it."""

    stretch: np.ndarray
    stress: np.ndarray
    name: str
    specimen: str = ""

    def upto(self, strain: float) -> Uniaxial:
        """Without larger strains, thinned to even steps of the strain."""
        size = np.abs(self.stretch - 1)
        inside = np.flatnonzero((size <= strain) & (np.arange(len(size)) <= int(size.argmax())))
        if len(inside) < 8:
            raise RecordingError(
                f"'{self.name}' has {len(inside)} samples up to a strain of {strain:g}: 8 needed"
            )
        at = np.linspace(0, size[inside].max(), min(_ROWS, len(inside)) + 1)[1:]
        order = inside[np.argsort(size[inside], kind="stable")]
        stress = np.interp(at, size[order], self.stress[order])
        sign = np.sign(self.stretch[inside[-1]] - 1)
        return Uniaxial(1 + sign * at, stress, self.name, self.specimen)


def read_compression(path: Path | str, specimen: str = "") -> Uniaxial:
    """A cylinder between platens: `key: value;` lines with its diameter and height in mm, then
    comma-separated samples.

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
    strain = np.abs(compression) / 1e3 / sizes["Height"]
    return Uniaxial(1 - strain, -(np.abs(load) / area), path.stem, specimen)


def read_tension(path: Path | str) -> Uniaxial:
    """A pull to failure: a ';' table with engineering strain and engineering stress (MPa), under a header of
    key; value lines. Raises RecordingError where a column is missing."""
    path = Path(path)
    lines, start = exported(path)
    names = [name.strip().lower() for name in lines[start].split(";")]
    wanted = [next((i for i, n in enumerate(names) if n.startswith(w)), -1) for w in _TENSION]
    if min(wanted) < 0:
        raise RecordingError(
            f"'{path}' needs the columns Engineering Strain and Engineering Stress (MPa); it has "
            f"{', '.join(names)}"
        )
    rows = []
    for line in lines[start + 1 :]:
        cells = line.split(";")
        try:
            rows.append([float(cells[i]) for i in wanted])
        except (ValueError, IndexError):
            continue
    if len(rows) < 8:
        raise RecordingError(f"'{path}' has {len(rows)} rows of numbers: 8 are needed")
    strain, stress = np.array(rows).T
    return Uniaxial(1 + strain, 1e6 * stress, path.stem)


_TENSION = ("engineering strain", "engineering stress")


def _neo(stretch: np.ndarray) -> np.ndarray:
    return 2 * (stretch - stretch**-2)


def _energy(stretch: np.ndarray) -> np.ndarray:
    return stretch**2 + 2 / stretch - 3


@dataclass(frozen=True)
class UniaxialLaw:
    """bases(): (shape parameter, stretch -> (n, k) columns whose sum the stress is); young: coefficients and
    shape to Young's modulus at no strain, Pa."""

    name: str
    shapes: tuple[float, ...]
    columns: Callable[[np.ndarray, float], np.ndarray]
    young: Callable[[np.ndarray, float], float]


def _powers(stretch: np.ndarray, count: int) -> np.ndarray:
    """(n, count) the stress of Yeoh's terms for unit constants."""
    energy = _energy(stretch)
    return _neo(stretch)[:, None] * np.column_stack([(k + 1) * energy**k for k in range(count)])


LAWS = (
    UniaxialLaw("linear", (0.0,), lambda s, _: (s - 1)[:, None], lambda c, _: float(c[0])),
    UniaxialLaw("neo-hookean", (0.0,), lambda s, _: _neo(s)[:, None], lambda c, _: 6 * float(c[0])),
    UniaxialLaw(
        "yeoh",
        (0.0,),
        lambda s, _: _powers(s, 2),
        lambda c, _: 6 * float(c[0]),
    ),
    UniaxialLaw(
        "yeoh-3",
        (0.0,),
        lambda s, _: _powers(s, 3),
        lambda c, _: 6 * float(c[0]),
    ),
    UniaxialLaw(
        "fung",
        tuple(_FUNG),
        lambda s, b: (_neo(s) * np.exp(np.minimum(b * _energy(s), 60.0)))[:, None],
        lambda c, _: 6 * float(c[0]),
    ),
    UniaxialLaw(
        "ogden",
        tuple(_OGDEN),
        lambda s, a: (s ** (a - 1) - s ** (-a / 2 - 1))[:, None],
        lambda c, a: 1.5 * float(c[0]) * a,
    ),
)  # fmt: skip
FLOOR, CEILING = "linear", "regression"


@dataclass(frozen=True)
class UniaxialFit:
    """A law fitted: its coefficients, shape parameter, zero of the strain, and Young's modulus, Pa."""

    law: UniaxialLaw
    coefficients: np.ndarray
    shape: float
    zero: float

    @property
    def young_modulus_pa(self) -> float:
        """At no strain."""
        return self.law.young(self.coefficients, self.shape)

    def stress(self, stretch: np.ndarray) -> np.ndarray:
        """Pa."""
        return self.law.columns(stretch - self.zero, self.shape) @ self.coefficients


def fit_law(curves: Sequence[Uniaxial], law: UniaxialLaw) -> UniaxialFit:
    """Least squares over all curves alike (each over its own greatest stress), one zero for all."""
    stretch = np.concatenate([c.stretch for c in curves])
    weight = np.concatenate([np.full(len(c.stress), 1 / np.abs(c.stress).max()) for c in curves])
    stress = np.concatenate([c.stress for c in curves])
    best: tuple[float, UniaxialFit] | None = None
    for zero in _ZEROS:
        for shape in law.shapes:
            columns = law.columns(stretch - zero, shape) * weight[:, None]
            coefficients = np.linalg.lstsq(columns, stress * weight, rcond=None)[0]
            cost = float(((columns @ coefficients - stress * weight) ** 2).sum())
            if best is None or cost < best[0]:
                best = cost, UniaxialFit(law, coefficients, float(shape), float(zero))
    assert best is not None
    return best[1]


def held_out(curves: Sequence[Uniaxial], strain: float = MOST_STRAIN) -> dict[str, np.ndarray]:
    """Law (and 'regression', which averages and interpolates) -> (c,) rms error of each curve over the rms
    of its stress, fitted to the others; of one curve alone, of blocks of strain that are left out in
    turn."""
    ready = [c.upto(strain) for c in curves]
    if len(ready) == 1:
        return _by_blocks(ready[0])
    out = {name: np.empty(len(ready)) for name in (*(law.name for law in LAWS), CEILING)}
    for i, curve in enumerate(ready):
        others = [c for k, c in enumerate(ready) if k != i]
        for law in LAWS:
            out[law.name][i] = _missed(curve, fit_law(others, law).stress(curve.stretch))
        mean = np.mean([_interpolated(c, curve.stretch) for c in others], axis=0)
        out[CEILING][i] = _missed(curve, mean)
    return out


def _by_blocks(curve: Uniaxial) -> dict[str, np.ndarray]:
    block = np.minimum(np.arange(len(curve.stress)) * BLOCKS // len(curve.stress), BLOCKS - 1)
    predicted = {name: np.zeros(len(block)) for name in (*(law.name for law in LAWS), CEILING)}
    for k in range(1, BLOCKS - 1):
        held = block == k
        rest = Uniaxial(curve.stretch[~held], curve.stress[~held], curve.name)
        for law in LAWS:
            predicted[law.name][held] = fit_law([rest], law).stress(curve.stretch[held])
        predicted[CEILING][held] = _interpolated(rest, curve.stretch[held])
    inner = (block > 0) & (block < BLOCKS - 1)
    between = Uniaxial(curve.stretch[inner], curve.stress[inner], curve.name)
    return {name: np.array([_missed(between, p[inner])]) for name, p in predicted.items()}


def _interpolated(curve: Uniaxial, stretch: np.ndarray) -> np.ndarray:
    order = np.argsort(curve.stretch)
    x, y = np.append(curve.stretch[order], 1.0), np.append(curve.stress[order], 0.0)
    order = np.argsort(x)
    x, first = np.unique(x[order], return_index=True)
    return PchipInterpolator(x, y[order][first])(stretch)


def _missed(curve: Uniaxial, predicted: np.ndarray) -> float:
    return float(np.sqrt(((predicted - curve.stress) ** 2).mean() / (curve.stress**2).mean()))


def chosen(errors: dict[str, np.ndarray], tie: float = 1.05) -> str:
    """The first law (in order of simplicity) whose median held-out error is within `tie` of the best
    one's."""
    medians = {law.name: float(np.median(errors[law.name])) for law in LAWS}
    least = min(medians.values())
    return next(name for name, value in medians.items() if value <= tie * least)
