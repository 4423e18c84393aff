"""Diagnosis on measured data of other instruments, from folders that are not shipped, all sets by one
command.

Each set of DATA (docs/reference/data-sets.md) goes through `pp.material`, as its owner's would:
curves (or, of one curve, blocks of it) are held out, and what predicts them is set beside 1D models as floor
and a regression without mechanics as ceiling. Errors are rms over rms. Indentations of beef are of other
animals each, so each force is over its own piece's stiffness; the indenter's shape is not stated, and a
sphere of 5 mm is taken.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.diagnosis.specimen.result import FLOORS, Material
from palpate.mechanics.errors import RecordingError
from palpate.reconstruction.machine_curves.uniaxial import CEILING
from palpate.reconstruction.steps.s7_modulus.held_out import BETTER

BEEF_LAYER_M, BEEF_TIP_M = 0.0154, 0.005


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Folder, which sets, how many pieces."""
    parser.add_argument("--data", required=True, help="folder that holds the sets' folders")
    parser.add_argument("--sets", default=",".join(SETS), help=f"which: {', '.join(SETS)}")
    parser.add_argument(
        "--session", default="230331", help="pieces of beef whose names begin so; with commas"
    )
    parser.add_argument("--every", type=int, default=1, help="only each so-manieth silicone (default: 1)")
    parser.add_argument("--pieces", type=int, default=16, help="at most so many of them")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Every set's row, and a median of each kind."""
    root, rows = Path(arguments.data), []
    names = arguments.sets.split(",")
    strange = [n for n in names if n not in SETS]
    if strange:
        raise RecordingError(f"'{strange[0]}' is no set; allowed are {', '.join(SETS)}")
    for name in names:
        folder = root / FOLDERS[name]
        if not folder.is_dir():
            raise RecordingError(f"'{folder}' does not exist: --data names the folder that holds the sets'")
        rows += [_row(name, label, made) for label, made in SETS[name](folder, arguments)]
    print(table(HEAD, [_cells(row) for row in rows]))
    medians = {}
    for name in names:
        own = [row for row in rows if row["set"] == name]
        medians[name] = {key: float(np.median([row[key] for row in own])) for key in _SHARES}
        shares = ", ".join(f"{key} {100 * value:.2g} %" for key, value in medians[name].items())
        print(f"{name}, medians of {len(own)}: {shares}")
    return {"rows": rows, "medians": medians, "figures": _over_floor(rows, names)}


def _over_floor(rows: list[dict[str, Any]], names: list[str]) -> list[Figure]:
    """Of each set the held-out error over that of the best 1D model, median, least and greatest; the limit is
    where a report says that the 1D model predicts better."""
    figures = []
    for name in names:
        ratios = [row["error"] / row["floor"] for row in rows if row["set"] == name]
        what = f"{name}: held-out error over the best 1D model's, median of {len(ratios)}"
        figures.append(Figure(what, float(np.median(ratios)), (min(ratios), max(ratios))).at_most(1 / BETTER))
    return figures


HEAD = ["set", "curves", "law or effects", "error", "floor (1D)", "ceiling", "closed", "95 % interval"]


def _row(name: str, label: str, made: Material) -> dict[str, Any]:
    error = made.error["verdict" if "verdict" in made.error else made.law]
    floor = min(made.error[k] for k in FLOORS[made.kind] if k in made.error)
    return {
        "set": name,
        "label": label,
        "curves": made.curves,
        "law": made.law,
        "effects": list(made.effects),
        "error": error,
        "floor": floor,
        "ceiling": made.error[CEILING],
        "closed": made.closed,
        "closed_ci95": None if made.closed_ci95 is None else list(made.closed_ci95),
        "young_modulus_pa": made.young_modulus_pa if np.isfinite(made.young_modulus_pa) else None,
        "holds_closed": _holds(made),
        "verdict": made.verdict,
        "unknown": list(made.unknown),
    }


def _holds(made: Material) -> float | None:
    """Share of the gap in holds that nothing has seen, whose curves' own ways in are known."""
    if "verdict, holds" not in made.error:
        return None
    return 1 - (made.error["verdict, holds"] / made.error["ideal, holds"]) ** 2


def _cells(row: dict[str, Any]) -> list[str]:
    what = ", ".join(row["effects"]) if row["set"] == "beef" else row["law"]
    closed = "" if row["closed"] is None else f"{100 * row['closed']:.0f} %"
    if row["holds_closed"] is not None:
        closed += f", unseen holds {100 * row['holds_closed']:.0f} %"
    between = row["closed_ci95"]
    return [
        row["label"], str(row["curves"]), what or "none", *(f"{100 * row[k]:.2f} %" for k in _SHARES), closed,
        "" if between is None else f"{100 * between[0]:.0f} to {100 * between[1]:.0f} %",
    ]  # fmt: skip


_SHARES = ("error", "floor", "ceiling")
Rows = Iterator[tuple[str, Material]]


def _silicones(folder: Path, arguments: argparse.Namespace) -> Rows:
    for each in sorted(p for p in folder.iterdir() if p.is_dir())[:: arguments.every]:
        files = sorted(each.glob("*.csv"))
        if files:
            yield each.name, pp.material(*files, progress=False)


def _elastomers(folder: Path, arguments: argparse.Namespace) -> Rows:
    for path in sorted(folder.glob("*.csv")):
        yield path.stem, pp.material(path, progress=False)


def _chiaro(folder: Path, arguments: argparse.Namespace) -> Rows:
    for path in sorted(folder.glob("fmt-*.txt")):
        yield path.stem[-16:], pp.material(path, progress=False)


def _fish(folder: Path, arguments: argparse.Namespace) -> Rows:
    for path in sorted(folder.glob("*.csv")):
        yield path.stem[-20:], pp.material(path, progress=False)


_PIECE = re.compile(r"(\d+_)+(FF|RDG)(\d_)?\d[a-z]$", re.IGNORECASE)
"""A piece's name, its session once or twice before it; the others are averages and longer tests."""


def pieces_of(folder: Path, session: str) -> list[Path]:
    """The pieces of beef of a session."""
    return [p for p in sorted((folder / "csv").glob(f"{session}_*.csv")) if _PIECE.match(p.stem)]


def _beef(folder: Path, arguments: argparse.Namespace) -> Rows:
    for session in arguments.session.split(","):
        files = pieces_of(folder, session)[: arguments.pieces]
        if len(files) < 6:
            raise RecordingError(
                f"'{folder}' holds {len(files)} pieces of session {session}; at least 6 are needed"
            )
        made = pp.material(
            *files,
            kind="indentation",
            tip_radius_m=BEEF_TIP_M,
            layer_m=BEEF_LAYER_M,
            specimens=True,
            fast=True,
            progress=False,
        )
        yield f"{len(files)} pieces of {session}", made


SETS: dict[str, Callable[[Path, argparse.Namespace], Rows]] = {
    "silicones": _silicones, "elastomers": _elastomers, "chiaro": _chiaro, "fish": _fish, "beef": _beef,
}  # fmt: skip
FOLDERS = {
    "silicones": "tissue_phantom_compression", "elastomers": "srmd_tensile", "chiaro": "chiaro_sphere_1khz",
    "fish": "fishmuscle_relaxation", "beef": "meat_indentation_relaxation",
}  # fmt: skip
