"""Files of bench instruments: what kind of test each is, and its curves in SI.

A Chiaro's export, cylinders between platens and pulls to failure are told by their headers, relaxation
curves and indentations by the names of their columns, whose units and separators are read as `palpate
import` reads them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.result import MachineTests
from palpate.importing.curve_meaning import SaidOfCurves
from palpate.importing.curves import LEAST_ROWS, numbers_in, read_curves, stated_radius
from palpate.importing.formats.registry import SHEET_SUFFIXES, TEXT_SUFFIXES
from palpate.importing.meaning import MOST_ODDS, Unclear
from palpate.importing.tables import read_tables
from palpate.mechanics.errors import OptionError, RecordingError
from palpate.mechanics.plausible import MACHINE_TIP_RADIUS
from palpate.reconstruction.machine_curves.indentation import read_chiaro
from palpate.reconstruction.machine_curves.uniaxial import of_compression, read_tension
from palpate.words import mm

KINDS = ("indentation", "compression", "tension", "relaxation")
_LOOK = 4000
_SAYING = (*TEXT_SUFFIXES, *SHEET_SUFFIXES)
"""Files with words beside the numbers."""
_BEYOND = 1e15
_MODULUS = ("relaxationmodulus", "modulus", "g", "e")


def read_tests(
    files: Sequence[str | Path],
    *,
    kind: str = "auto",
    tip_radius_m: float | None = None,
    said: SaidOfCurves | None = None,
) -> MachineTests:
    """All files, which must be of one kind. Raises RecordingError where one cannot be read or is of another
    kind, OptionError for a kind that does not exist."""
    if kind not in ("auto", *KINDS):
        raise OptionError(f"kind is '{kind}'; allowed are auto, {', '.join(KINDS)}")
    if not files:
        raise OptionError("no file was given: name at least one")
    paths = [Path(f) for f in files]
    test_of = [kind if kind != "auto" else kind_of(p) for p in paths]
    if len(set(test_of)) > 1:
        other = next(i for i, k in enumerate(test_of) if k != test_of[0])
        raise RecordingError(
            f"'{paths[0]}' is a test in {test_of[0]} and '{paths[other]}' one in {test_of[other]}: give "
            "files of one kind"
        )
    if test_of[0] == "compression":
        return MachineTests("compression", tests=tuple(of_compression(p, _specimen(p)) for p in paths))
    if test_of[0] == "tension":
        return MachineTests("tension", tests=tuple(map(read_tension, paths)))
    if test_of[0] == "relaxation":
        return MachineTests("relaxation", holds=tuple(_hold(p) for p in paths))
    return _indentations(paths, tip_radius_m, said or SaidOfCurves())


def kind_of(path: Path) -> str:
    """The kind of test that a file holds, by its header; raises RecordingError for a file that is not
    there."""
    try:
        raw = path.read_bytes()[:_LOOK]
    except OSError as error:
        raise RecordingError(f"'{path}' cannot be read: {error.strerror}") from error
    text = raw.decode("latin-1").lower()
    if "cylinder diameter" in text and "compression" in text:
        return "compression"
    if "engineering strain" in text and "engineering stress" in text:
        return "tension"
    head = re.sub(r"[^a-z]", "", text.splitlines()[0]) if text.splitlines() else ""
    if "relaxation" in head or ("modulus" in head and "time" in head):
        return "relaxation"
    return "indentation"


def _specimen(path: Path) -> str:
    found = re.search(r"_([A-Za-z]+)_?\d+$", path.stem)
    return found[1] if found else path.stem


def _hold(path: Path) -> tuple[np.ndarray, np.ndarray]:
    table = max(read_tables(path), key=lambda t: t.rows)
    if len(table.columns) < 2:
        raise RecordingError(f"'{path}' has one column: a relaxation needs time and modulus, force or stress")
    t, value = (np.asarray(v, float) for v in list(table.columns.values())[:2])
    good = numbers_in(path, t, value)
    order = np.argsort(t[good], kind="stable")
    t, value = t[good][order], value[good][order]
    fresh = _in_order(path, t)
    if max(np.abs(t).max(), np.abs(value).max()) > _BEYOND:
        raise RecordingError(
            f"'{path}' holds numbers above {_BEYOND:g}, beyond any quantity here in SI units"
        )
    return t[fresh], value[fresh]


def _indentations(paths: list[Path], tip_radius_m: float | None, said: SaidOfCurves) -> MachineTests:
    chiaro = [not said.columns and is_chiaro(path) for path in paths]
    curves, stated, notes, odds = [], [], [], MOST_ODDS
    for path in (p for p, own in zip(paths, chiaro, strict=True) if own):
        data = read_chiaro(path)
        curves.append(MachineCycle(data.t, data.travel, data.force, path.name))
        tip_radius_m = tip_radius_m or data.tip_radius_m
        stated.append(data.stated_modulus_pa)
    others = [p for p, own in zip(paths, chiaro, strict=True) if not own]
    if tip_radius_m is None:
        radii = {stated_radius(p) for p in others if p.suffix.lower() in _SAYING} - {None}
        tip_radius_m = radii.pop() if len(radii) == 1 else None
        if tip_radius_m is not None:
            notes.append(f"tip radius {mm(tip_radius_m, '.4g')}, as the file says")
    if tip_radius_m is None:
        raise Unclear("the tip's radius in m is in no file", "tip_radius_m", ())
    low, high = MACHINE_TIP_RADIUS.low, MACHINE_TIP_RADIUS.high
    if not low <= tip_radius_m <= high:
        raise OptionError(
            f"--tip-radius is {tip_radius_m:g} m; it must lie between {low:g} and {high:g} m: give metres"
        )
    if others:
        read = read_curves(others, said, tip_radius_m)
        curves += read.curves
        notes += read.notes
        odds = read.odds
    good = [s for s in stated if np.isfinite(s)]
    return MachineTests(
        "indentation", curves=tuple(curves), tip_radius_m=tip_radius_m,
        stated_modulus_pa=float(np.median(good)) if good else float("nan"), notes=tuple(notes), odds=odds,
    )  # fmt: skip


def is_chiaro(path: Path) -> bool:
    """Whether a text is an export of a Chiaro."""
    head = path.read_bytes()[:_LOOK].decode("latin-1")
    return "Tip radius (um)" in head and "Cantilever (nm)" in head


def _in_order(path: Path, t: np.ndarray) -> np.ndarray:
    """(n,) bool: rows whose time is later than the one before."""
    fresh = np.concatenate([[True], np.diff(t) > 0])[: len(t)]
    if fresh.sum() < LEAST_ROWS:
        raise RecordingError(f"'{path}' has {fresh.sum()} rows in order of time: {LEAST_ROWS} are needed")
    return fresh
