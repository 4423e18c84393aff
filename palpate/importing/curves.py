"""A machine's curves from any table: which column is what, which way is in, one press or many.

What is said counts first, then what the file's own text says (names, units, the probe's radius), then what a
solid does (`palpate.importing.meaning`).
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from diagnose.specimen.bench import Curve
from mechanics.bounds import LARGEST_N
from mechanics.errors import ContactError, RecordingError
from mechanics.recording.recording import WIDEST_PATH_M, NotRead
from palpate.importing.mapping import Column, Said, find_columns
from palpate.importing.meaning import (
    MOST_ODDS,
    Reading,
    Unclear,
    best,
    clock_of,
    clock_starts,
    joined,
    press_scores,
    settled_clock,
)
from palpate.importing.sheets import SHEET_SUFFIXES, lines_of
from palpate.importing.tables import Table, read_tables
from palpate.importing.units import SI, without_unit
from render.press import COLUMNS as PRESS_COLUMNS

LEAST_ROWS = 8
_HEAD = 40
"""Rows of a sheet in which the probe's radius may be said."""
_INTO = ("depth", "indentation", "indent", "compression", "travel", "penetration")
_OUT = ("height", "gap", "toolgap")
_NAMED, _USUAL = float(np.log(6.0)), float(np.log(2.0))
"""What a name tells of a direction, and that z points up, travel down, load into the sample (nats)."""
_DEEPEST_RADII = 20.0
_ENTER, _LEAVE, _RETREAT = 0.25, 0.08, 0.05
"""A press begins above this share of the greatest force; the next one after it fell below the second, and the
tip moved out by the third of its way."""
_LENGTH_FACTOR = 4.0
_USUAL_E, _E_FACTOR = 2e4, 20.0
_RADIUS = re.compile(
    r"\b(?:probe|tip|indenter|sphere|ball|bead)\b[^\n]{0,20}?\b(radius|diameter)\b[^\n\d]{0,12}?"
    r"(?:[\[(]\s*(m|mm|um|µm|nm)\s*[\])])?\s*[:=,;\t ]*\s*(\d+(?:[.,]\d+)?(?:e-?\d+)?)\s*(m|mm|um|µm|nm)?\b",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class SaidOfCurves:
    """What was said. columns, units: as of `palpate import`, with the roles depth, height and load too.
    travel: "into" or "out"; compression: "positive" or "negative" load; clock: "one" or "blocks"."""

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    travel: str | None = None
    compression: str | None = None
    clock: str | None = None


@dataclass(frozen=True)
class _Raw:
    """One table in SI, signs as in the file. t None: no column of time."""

    path: Path
    t: np.ndarray
    position: np.ndarray
    load: np.ndarray
    columns: Mapping[str, Column]


@dataclass(frozen=True)
class CurvesRead:
    """curves: one a press, travel into the sample, force that pushes the tip out. notes: what was understood
    beyond the headers; odds: of the least sure of it."""

    curves: tuple[Curve, ...]
    notes: tuple[str, ...]
    odds: float


def read_curves(paths: Sequence[Path], said: SaidOfCurves, tip_radius_m: float) -> CurvesRead:
    """The curves of files of one machine. Raises Unclear where two readings are likely, ContactError where
    none is possible, RecordingError for a file that is no table."""
    said, stated = _aliases(said)
    notes: list[str] = []
    odds = [MOST_ODDS]
    raws = [_raw(path, said, notes, odds) for path in paths]
    for raw in raws:
        _check_sizes(raw)
    signs = _signs(raws, said, stated)
    if not signs.sure:
        raise _unclear_signs(raws[0], signs)
    odds.append(signs.odds)
    travel, load = signs.value
    _say_signs(raws[0], signs, notes)
    curves = [c for raw in raws for c in _presses(raw, travel, load, notes)]
    curves = _in_units(raws[0], curves, tip_radius_m, notes, odds)
    return CurvesRead(tuple(curves), tuple(dict.fromkeys(notes)), min(odds))


def stated_radius(path: Path) -> float | None:
    """m, of the probe, where the text before the numbers says it."""
    if path.suffix.lower() in SHEET_SUFFIXES:
        text = "\n".join(line for lines in lines_of(path).values() for line in lines[:_HEAD])
    else:
        text = path.read_bytes()[:4000].decode("latin-1").replace("Âµ", "µ")
    found = _RADIUS.search(text)
    if found is None:
        return None
    unit = (found[2] or found[4] or "m").lower().replace("µ", "u")
    size = float(found[3].replace(",", ".")) * SI["position"][unit]
    return size / 2 if found[1].lower() == "diameter" else size


def _aliases(said: SaidOfCurves) -> tuple[SaidOfCurves, tuple[int | None, int | None]]:
    """(with the roles of a recording, (travel, load) signs of the named columns where they were said)."""
    columns = dict(said.columns)
    travel = {"into": 1, "out": -1}.get(said.travel or "")
    load = {"positive": 1, "negative": -1}.get(said.compression or "")
    for alias, role, sign in (("depth", "z", 1), ("height", "z", -1), ("load", "fz", None)):
        if alias in columns:
            columns[role] = columns.pop(alias)
            travel = sign if sign is not None and travel is None else travel
    for role in ("z", "fz"):
        if columns.get(role, "").strip().startswith("-"):
            turned = columns[role].strip()[1:]
            if role == "z":
                travel = 1 if travel is None else -travel
            else:
                load = -1 if load is None else -load
            columns[role] = turned
    return SaidOfCurves(columns, said.units, said.travel, said.compression, said.clock), (travel, load)


def _raw(path: Path, said: SaidOfCurves, notes: list[str], odds: list[float]) -> _Raw:
    tables = read_tables(path)
    if not said.columns and tuple(tables[0].columns) == PRESS_COLUMNS:
        return _of_press(path, tables[0], notes)
    found = find_columns(tables, Said(columns=said.columns, units=said.units))
    if "t" not in found:
        raise RecordingError(
            f"'{path}' has no column of time, and there are {_names(tables)}: --column t=NAME"
        )
    columns = {role: found[role] for role in ("t", "z", "fz")}
    t, z, push = (np.asarray(c.values, float) for c in columns.values())
    if t.ndim == 0 or z.ndim == 0 or push.ndim == 0 or len({len(t), len(z), len(push)}) > 1:
        raise RecordingError(
            f"'{path}' needs time, travel and load in columns of one length, as --column depth=NAME and "
            f"--column load=NAME name them: {_names(tables)}"
        )
    good = numbers_in(path, t, z, push)
    t, z, push = t[good], np.sign(columns["z"].factor) * z[good], np.sign(columns["fz"].factor) * push[good]
    blocks = len(clock_starts(t))
    if 1 < blocks <= len(t) // 4 + 1:
        t, z, push = _one_clock(path, blocks, t, z, push, said, notes, odds)
    fresh = np.concatenate([[True], t[1:] > np.maximum.accumulate(t)[:-1]])[: len(t)]
    if fresh.sum() < LEAST_ROWS:
        raise RecordingError(f"'{path}' has {fresh.sum()} rows in order of time: {LEAST_ROWS} are needed")
    return _Raw(path, t[fresh], z[fresh], push[fresh], columns)


def _of_press(path: Path, table: Table, notes: list[str]) -> _Raw:
    """The curve of a `palpate press`, along its own line, which may lie aslant: m and N."""
    t, *position, _ = (np.asarray(table.columns[name], float) for name in PRESS_COLUMNS[:5])
    force = np.column_stack([table.columns[name] for name in PRESS_COLUMNS[5:]])
    path_m = np.column_stack(position)
    way = path_m - path_m[0]
    farthest = way[int(np.argmax((way**2).sum(axis=1)))]
    along = farthest / max(float(np.linalg.norm(farthest)), 1e-300)
    notes.append(
        "a curve of palpate press: travel and force along its line; a half-space stands for the object"
    )
    columns = {
        role: Column(role, table, name, 1.0, unit, guessed=False)
        for role, name, unit in (("t", "t", "s"), ("z", "travel", "m"), ("fz", "push", "N"))
    }
    return _Raw(path, t, way @ along, -force @ along, columns)


def _one_clock(
    path: Path, blocks: int, t: np.ndarray, z: np.ndarray, push: np.ndarray, said: SaidOfCurves,
    notes: list[str], odds: list[float],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Rows on one clock that goes forward: sorted by time, or blocks one after the other."""
    reading = clock_of(t, np.column_stack([z, push]))
    reading = settled_clock(f"'{path}'", t, said.clock, reading)
    odds.append(reading.odds)
    if reading.value[0] > 0:
        notes.append(f"rows out of order are sorted by time ({reading.words})")
        order = np.argsort(t, kind="stable")
        return t[order], z[order], push[order]
    notes.append(f"{blocks} blocks with clocks of their own are put one after the other ({reading.words})")
    return joined(t), z, push


def _check_sizes(raw: _Raw) -> None:
    """Raise for lengths and loads that no machine has."""
    travelled = float(np.ptp(raw.position))
    if travelled > WIDEST_PATH_M:
        raise RecordingError(
            f"'{raw.path}': the tip travels {travelled:.4g} m, which may be {WIDEST_PATH_M:g} m: name "
            "the unit, as in --units position=um"
        )
    if np.abs(raw.load).max() > LARGEST_N:
        raise RecordingError(
            f"'{raw.path}' holds a load above {LARGEST_N:g} N: name its unit, as in --units force=uN"
        )


def _signs(raws: Sequence[_Raw], said: SaidOfCurves, stated: tuple[int | None, int | None]) -> Reading:
    """(travel, load) signs of all files together, which are of one machine."""
    scores: dict[tuple[int, ...], float] = {(a, b): 0.0 for a in (1, -1) for b in (1, -1)}
    for raw in raws:
        for signs, score in press_scores(raw.position, raw.load).items():
            scores[signs] += score
    name = re.sub(r"[^a-z]", "", without_unit(raws[0].columns["z"].name).lower())
    into = _NAMED if name in _INTO else -_NAMED if name in _OUT else -_USUAL if name == "z" else _USUAL
    for a, b in list(scores):
        scores[a, b] += into * (a > 0) + _USUAL * (b > 0)
    kept = {
        key: score
        for key, score in scores.items()
        if all(want is None or want == got for want, got in zip(stated, key, strict=True))
    }
    return best(kept)


def _unclear_signs(raw: _Raw, signs: Reading) -> RecordingError:
    z, fz = raw.columns["z"].name, raw.columns["fz"].name
    return Unclear(
        f"'{raw.path}': whether '{fz}' is positive or negative in compression cannot be told from how it "
        f"goes with '{z}' ({signs.words}; if these are the wrong columns, --column depth=NAME and "
        "--column load=NAME name them)",
        "compression",
        ("positive", "negative"),
    )


def _say_signs(raw: _Raw, signs: Reading, notes: list[str]) -> None:
    travel, load = signs.value
    z, fz = raw.columns["z"].name, raw.columns["fz"].name
    way = "into the sample" if travel > 0 else "out of the sample"
    sign = "positive" if load > 0 else "negative"
    notes.append(f"'{z}' counts {way}, '{fz}' is {sign} in compression ({signs.words})")


def _presses(raw: _Raw, travel: int, load: int, notes: list[str]) -> list[Curve]:
    """A curve a press: cut where the tip is farthest out between two."""
    u, f = travel * raw.position, load * raw.load
    level = np.median(f[: max(3, len(f) // 50)])
    top, way = float(f.max() - level), float(np.ptp(u))
    cuts, inside, begun, lowest = [0], False, 0.0, 0
    smooth = max(1, len(f) // 2000)
    for i in range(0, len(f), smooth):
        over = float(f[i : i + smooth].mean() - level)
        lowest = i if not inside and u[i] < u[lowest] else lowest
        if not inside and over > _ENTER * top:
            if lowest:
                cuts.append(lowest)
            inside, begun = True, float(u[i])
        elif inside and over < _LEAVE * top and u[i] < begun - _RETREAT * way:
            inside, lowest = False, i
    spans = list(zip(cuts, [*cuts[1:], len(f)], strict=True))
    spans = [s for s in spans if s[1] - s[0] >= LEAST_ROWS]
    # the first cut is before the first press: what comes before it is its own free air
    if len(spans) > 1 and f[slice(*spans[0])].max() - level < _ENTER * top:
        spans = [(spans[0][0], spans[1][1]), *spans[2:]]
    if len(spans) < 2:
        return [Curve(raw.t, u, f, raw.path.name)]
    notes.append(f"'{raw.path.name}' holds {len(spans)} presses")
    return [
        Curve(raw.t[a:b], u[a:b], f[a:b], f"{raw.path.name}, press {k + 1}") for k, (a, b) in enumerate(spans)
    ]


def _in_units(
    raw: _Raw, curves: Sequence[Curve], tip_radius_m: float, notes: list[str], odds: list[float]
) -> list[Curve]:
    """The curves in the units that their dent and stiffness tell, where nobody said them. Raises Unclear
    where two may be meant, ContactError where no tip goes so deep."""
    depth, push = (float(np.median(v)) for v in zip(*map(_dent, curves), strict=True))
    z, fz = raw.columns["z"], raw.columns["fz"]
    length = force = 1.0
    if z.assumed and depth > 0:
        sizes = {unit: depth * SI["position"][unit] / (0.5 * tip_radius_m) for unit in _LENGTHS}
        length = _likely(sizes, _LENGTHS, _LENGTH_FACTOR, "position", raw, notes, odds)
    depth *= length
    if depth > _DEEPEST_RADII * tip_radius_m:
        raise ContactError(
            f"'{raw.path}': the tip would go {depth:.3g} m deep, {depth / tip_radius_m:.0f} of its radii: "
            f"are the units and signs of '{z.name}' and '{fz.name}' right? say --units position=mm, --column "
            "depth=NAME, --column load=NAME, or --tip-radius M"
        )
    if fz.assumed and depth > 0 and push > 0:
        modulus = push / (16 / 9 * np.sqrt(tip_radius_m) * depth**1.5)
        moduli = {unit: modulus * SI["force"][unit] / _USUAL_E for unit in _FORCES}
        force = _likely(moduli, _FORCES, _E_FACTOR, "force", raw, notes, odds)
    if length == force == 1.0:
        return list(curves)
    return [Curve(c.t, length * c.travel, force * c.force, c.name) for c in curves]


def _likely(
    sizes: Mapping[str, float], priors: Mapping[str, float], factor: float, kind: str, raw: _Raw,
    notes: list[str], odds: list[float],
) -> float:  # fmt: skip
    """What one is in SI of the likeliest unit: sizes are over the usual one, which is known to a factor."""
    units = list(sizes)
    reading = best(
        {
            (k,): float(np.log(priors[unit]) - 0.5 * (np.log(sizes[unit]) / np.log(factor)) ** 2)
            for k, unit in enumerate(units)
        }
    )
    unit, name = units[reading.value[0]], raw.columns["z" if kind == "position" else "fz"].name
    if not reading.sure:
        other = unit if unit != units[0] else units[1]
        raise Unclear(
            f"'{raw.path}': the unit of '{name}' is said nowhere, and two are likely ({reading.words})",
            "units",
            (f"{kind}={other}", f"{kind}={units[0]}"),
        )
    odds.append(reading.odds)
    if unit != units[0]:
        notes.append(f"'{name}' names no unit: taken as {unit} ({reading.words})")
    return SI[kind][unit]


_LENGTHS = {"m": 1.0, "mm": 1.0, "um": 0.3}
_FORCES = {"N": 0.85, "mN": 0.1, "gf": 0.05}
"""Units that a column may be in that says none."""


def _dent(curve: Curve) -> tuple[float, float]:
    """(depth m, force N) of a press at its peak."""
    force = curve.force - np.median(curve.force[: max(3, len(curve.force) // 50)])
    peak = int(np.argmax(force))
    way = curve.travel[: peak + 1]
    first = np.flatnonzero(force[: peak + 1] < 0.05 * force[peak])
    return float(way[-1] - way[first[-1] if len(first) else 0]), float(force[peak])


def numbers_in(path: Path, *columns: np.ndarray) -> np.ndarray:
    """(n,) bool: rows that hold a number in every column, more than half of them; the others are told of."""
    good = np.isfinite(np.column_stack(columns)).all(axis=1)
    lost = int((~good).sum())
    if 2 * lost > len(good):
        raise RecordingError(
            f"'{path}': {lost} of {len(good)} rows lack a number, the first is row {np.argmin(good) + 1}: "
            "name the columns, as in --column load=NAME"
        )
    if lost:
        warnings.warn(
            f"'{path}': {lost} of {len(good)} rows lack a number and are left out, the first is row "
            f"{np.argmin(good) + 1}",
            NotRead,
            stacklevel=2,
        )
    return good


def _names(tables: list[Table]) -> str:
    return ", ".join(without_unit(n) for t in tables for n in t.columns)
