"""Files of bench instruments: what kind of test each is, and its curves in SI.

A Chiaro's export, cylinders between platens and pulls to failure are told by their headers, relaxation
curves and indentations by the names of their columns, whose units and separators are read as `palpate
import` reads them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.diagnosis.specimen.result import MachineTests
from palpate.importing.curve_meaning import SaidOfCurves
from palpate.importing.curves import LEAST_ROWS, numbers_in, read_curves
from palpate.importing.headers import Header, alike, header_of
from palpate.importing.meaning import MOST_ODDS, Unclear
from palpate.importing.tables import read_tables
from palpate.importing.tip_form import sphere_or_ask
from palpate.mechanics.contact.tip import POINTED, WORDS, Tip
from palpate.mechanics.errors import OptionError, RecordingError
from palpate.reconstruction.machine_curves.indentation import read_chiaro
from palpate.reconstruction.machine_curves.uniaxial import read_compression, read_tension
from palpate.words import mm

KINDS = ("indentation", "compression", "tension", "relaxation")
_LOOK = 4000
_BEYOND = 1e15


def read_tests(
    files: Sequence[str | Path],
    *,
    kind: str = "auto",
    tip: SaidOfTip | None = None,
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
        return MachineTests("compression", tests=tuple(read_compression(p, _specimen(p)) for p in paths))
    if test_of[0] == "tension":
        return MachineTests("tension", tests=tuple(map(read_tension, paths)))
    if test_of[0] == "relaxation":
        return MachineTests("relaxation", holds=tuple(_hold(p) for p in paths))
    return _indentations(paths, tip or SaidOfTip(), said or SaidOfCurves())


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


@dataclass(frozen=True)
class SaidOfTip:
    """What was said of the tip: a form of FORMS, m, degrees."""

    form: str | None = None
    radius_m: float | None = None
    half_angle_deg: float | None = None


def _indentations(paths: list[Path], said_tip: SaidOfTip, said: SaidOfCurves) -> MachineTests:
    chiaro = [not said.columns and is_chiaro(path) for path in paths]
    others = [p for p, own in zip(paths, chiaro, strict=True) if not own]
    heads = [header_of(p) for p in paths]
    notes: list[str] = []
    curves = []
    if len(others) < len(paths):  # a Chiaro's probe is a sphere
        said_tip = replace(said_tip, form=said_tip.form or "sphere")
    for path in (p for p, own in zip(paths, chiaro, strict=True) if own):
        data = read_chiaro(path)
        curves.append(MachineCycle(data.t, data.travel, data.force, path.name, own=True))
        said_tip = replace(said_tip, radius_m=said_tip.radius_m or data.tip_radius_m)
        heads.append(Header(modulus_pa=None if np.isnan(data.stated_modulus_pa) else data.stated_modulus_pa))
    said_tip = _of_files(said_tip, heads, notes)
    odds, timed = [MOST_ODDS], True
    if others:
        read = read_curves(others, said, said_tip.radius_m)
        curves += read.curves
        notes += read.notes
        odds.append(read.odds)
        timed = read.timed
    poisson = alike([h.poisson_ratio for h in heads])
    form = said_tip.form
    if form is None:
        assert said_tip.radius_m is not None
        form = "sphere"
        odds.append(sphere_or_ask(curves, said_tip.radius_m, poisson))
    moduli = [h.modulus_pa for h in heads if h.modulus_pa is not None]
    spring = alike([h.spring_n_per_m for h in heads])
    if spring is not None:
        notes.append(f"the file states a spring of {spring:g} N/m that reads the force")
    return MachineTests(
        "indentation",
        curves=tuple(curves),
        tip=Tip(form, said_tip.radius_m, said_tip.half_angle_deg),
        poisson_ratio=poisson,
        stated_modulus_pa=float(np.median(moduli)) if moduli else float("nan"),
        notes=tuple(notes),
        odds=min(odds),
        timed=timed,
    )


def _of_files(said: SaidOfTip, heads: Sequence[Header], notes: list[str]) -> SaidOfTip:
    """The tip as it was said, else as the files' text says it. Raises Unclear where its size is in
    neither."""
    form = said.form or alike([h.form for h in heads])
    if form is None and said.half_angle_deg is not None:
        raise Unclear("an angle of the tip is given, and its form is not", "tip", POINTED)
    if form is not None and said.form is None:
        notes.append(f"the tip is {WORDS[form]}, as the file says")
    if form in POINTED:
        angle = said.half_angle_deg or alike([h.half_angle_deg for h in heads])
        if angle is None:
            raise Unclear(
                f"the half angle of {WORDS[form]}, from its axis to a flank in degrees, is in no file",
                "tip_angle_deg",
                (),
            )
        return SaidOfTip(Tip(form, None, angle).form, None, angle)
    radius = said.radius_m
    if radius is None:
        radius = alike([h.radius_m for h in heads])
        if radius is not None:
            notes.append(f"tip radius {mm(radius, '.4g')}, as the file says")
    if radius is None:
        raise Unclear("the tip's radius in m is in no file", "tip_radius_m", ())
    return SaidOfTip(form, Tip(form or "sphere", radius).radius_m)


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
