"""Laws of tissue on measured curves that no fit has seen: how silicones soften, and how beef relaxes.

Silicones: 19 mixtures of Ecoflex and thinner, two specimens of five tests each (Dawood et al. 2026, CC BY
4.0). Each test is predicted by one modulus and one shape parameter (`c20_over_c10`) from the others of its
mixture, and from those of the other specimen alone; the error is the median over samples between 2 % strain
and the greatest, in shares of the stress.

Beef: indentations, a ramp and a hold (Iaquinta's set, GPL-3.0, read where it lies), forces scaled to 1 N at 3
mm. The hold of each piece is told by that piece's own ramp, with a memory fitted to the other half of the
pieces: there neither a piece's stiffness nor the form of its depth law matters, which are another animal's in
every piece.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._machine_curves import FORMS, Held, fit_elastomer, fit_holds, hold_error
from benchmarks.timing import table
from palpate.mechanics.errors import RecordingError
from palpate.reconstruction.machine_curves.uniaxial import Compression, read_compression

FROM_STRAIN = 0.02
SILICONES, BEEF = "tissue_phantom_compression", "meat_indentation_relaxation"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Folder, greatest strain, pieces."""
    parser.add_argument("--data", required=True, help="folder that holds the sets' folders")
    parser.add_argument("--strain", type=float, default=0.4, help="greatest strain (default: 0.4)")
    parser.add_argument("--session", default="230331", help="pieces of beef whose names begin so")
    parser.add_argument("--pieces", type=int, default=16, help="at most so many of them")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Both tables."""
    root = Path(arguments.data)
    for folder in (SILICONES, BEEF):
        if not (root / folder).is_dir():
            raise RecordingError(f"'{root / folder}' does not exist: --data names the folder of the sets")
    return {
        "silicones": _silicones(root / SILICONES, arguments),
        "holds": holds_table(root / BEEF, arguments.session, arguments.pieces),
    }


_PIECE = re.compile(r"(\d+_)+(FF|RDG)(\d_)?\d[a-z]$", re.IGNORECASE)
"""A piece's name, its session once or twice before it; the others are averages and longer tests."""


def pieces_of(folder: Path, session: str) -> list[Path]:
    """The pieces of beef of a session."""
    return [p for p in sorted((folder / "csv").glob(f"{session}_*.csv")) if _PIECE.match(p.stem)]


def holds_table(folder: Path, session: str, most: int) -> dict[str, dict[str, float]]:
    """Print and return `unseen_holds` of a session's pieces."""
    figures = unseen_holds(pieces_of(folder, session)[:most])
    rows = [[form, f"{f['rms_n']:.3f} N", f"{f['closed']:.0%}"] for form, f in figures.items()]
    print(table(["memory", "unseen holds miss by (rms)", "closed of what none leaves"], rows))
    return figures


def unseen_holds(pieces: list[Path]) -> dict[str, dict[str, float]]:
    """How far each form of memory, fitted to one half of the pieces, misses the other half's holds, N rms."""
    if len(pieces) < 6:
        raise RecordingError(f"there are {len(pieces)} pieces of beef; at least 6 are needed")
    presses = [held(path) for path in pieces]
    errors: dict[str, list[np.ndarray]] = {form: [] for form in FORMS}
    for seen, unseen in ((presses[::2], presses[1::2]), (presses[1::2], presses[::2])):
        for form in FORMS:
            terms = fit_holds(seen, form)
            errors[form] += [hold_error(press, *terms) for press in unseen]
    rms = {form: float(np.sqrt(np.mean(np.concatenate(e) ** 2))) for form, e in errors.items()}
    return {form: {"rms_n": each, "closed": 1 - each / rms["elastic"]} for form, each in rms.items()}


def held(path: Path) -> Held:
    """A piece's force over that at 3 mm of its ramp, from just before its first touch."""
    t, force, depth = (column for column in np.loadtxt(path, delimiter=",", skiprows=1)[:, :3].T)
    force = force - np.median(force[:3])
    ramp = slice(0, int(depth.argmax()))
    force = force / np.interp(3.0, depth[ramp], force[ramp])
    begin = max(int(np.flatnonzero(force > 0.02)[0]) - 1, 0)
    return Held(t[begin:], force[begin:], int(force.argmax()) - begin)


def _silicones(root: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    """A row a mixture, and the medians."""
    folders = sorted(p for p in root.iterdir() if p.is_dir() and any(p.glob("*.csv")))
    if not folders:
        raise RecordingError(f"'{root}' holds no folder with CSVs of compression tests")
    rows, figures = [], {}
    for folder in folders:
        paths = sorted(folder.glob("*.csv"))
        tests = [read_compression(path) for path in paths]
        specimen = [path.stem.rsplit("_", 1)[-1][0] for path in paths]
        whole = fit_elastomer(tests, to_strain=arguments.strain)
        count = range(len(tests))
        unseen = [[o for o in count if o != k] for k in count]
        tested = _errors(tests, unseen, arguments)
        across = [[o for o in count if specimen[o] != specimen[k]] for k in count]
        other = _errors(tests, across, arguments)
        plain = _errors(tests, unseen, arguments, ratio=0.0)
        figures[folder.name] = {
            "young_modulus_pa": whole.young_modulus_pa, "c20_over_c10": whole.c20_over_c10,
            "unseen_test": tested, "unseen_specimen": other, "neo_hookean": plain,
        }  # fmt: skip
        rows.append(
            [folder.name, f"{whole.young_modulus_pa / 1e3:.1f}", f"{whole.c20_over_c10:+.3f}",
             f"{plain:.1%}", f"{tested:.1%}", f"{other:.1%}"]
        )  # fmt: skip
    print(
        table(
            ["mixture", "E, kPa", "c20/c10", "neo-Hookean", "unseen test", "unseen specimen"],
            rows,
        )
    )
    names = ("neo_hookean", "unseen_test", "unseen_specimen")
    medians = {name: float(np.median([f[name] for f in figures.values()])) for name in names}
    worst = {name: float(max(f[name] for f in figures.values())) for name in names}
    softer = sum(f["c20_over_c10"] < 0 for f in figures.values())
    said = [f"{name.replace('_', ' ')} {medians[name]:.1%} (worst {worst[name]:.1%})" for name in names]
    print(f"{softer} of {len(figures)} soften; {', '.join(said)}")
    return {"mixtures": figures, "median": medians, "worst": worst, "soften": softer}


def _errors(
    tests: list[Compression],
    seen: list[list[int]],
    arguments: argparse.Namespace,
    ratio: float | None = None,
) -> float:
    """The median over tests of each one's median error, predicted from those seen; ratio: c20 / c10 held."""
    errors = []
    for test, others in zip(tests, seen, strict=True):
        material = fit_elastomer([tests[k] for k in others], to_strain=arguments.strain, ratio=ratio)
        use = (test.strain >= FROM_STRAIN) & (test.strain <= arguments.strain)
        errors.append(float(np.median(np.abs(material.stress(test.strain[use]) / test.stress[use] - 1))))
    return float(np.median(errors))
