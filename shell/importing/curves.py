"""A machine's curves from any table: which column is what, which way is in, one press or many.

What is said counts first, then what the file's own text says (names, units, the probe's radius), then what a
solid does (`palpate.importing.meaning`).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.importing.curve_meaning import (
    RawCurves,
    SaidOfCurves,
    in_units,
    say_signs,
    signs_of,
    unclear_signs,
)
from palpate.importing.headers import header_of
from palpate.importing.mapping import Column, Said, told_columns
from palpate.importing.meaning import (
    MOST_ODDS,
    Unclear,
    clock_of,
    clock_starts,
    joined,
    settled_clock,
)
from palpate.importing.side_by_side import side_by_side
from palpate.importing.tables import SI, Table, read_tables, unit_in, without_unit
from palpate.mechanics.bounds import LARGEST_N
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.plausible import EXPLORATION
from palpate.mechanics.recording.recording import NotRead
from palpate.render.press import COLUMNS as PRESS_COLUMNS

LEAST_ROWS = 8
_UNTIMED_HZ = 100.0
"""Of rows without a time: any, as nothing is read off it."""
_ENTER, _LEAVE, _RETREAT = 0.25, 0.08, 0.05
"""A press begins above this share of the greatest force; the next one after it fell below the second, and the
tip moved out by the third of its way."""


@dataclass(frozen=True)
class CurvesRead:
    """curves: one a press, travel into the sample, force that pushes the tip out. notes: what was understood
    beyond the headers; odds: of the least sure of it; timed: all have a column of time."""

    curves: tuple[MachineCycle, ...]
    notes: tuple[str, ...]
    odds: float
    timed: bool = True


def read_curves(paths: Sequence[Path], said: SaidOfCurves, tip_radius_m: float | None) -> CurvesRead:
    """The curves of files of one machine; a tip that is pointed has no radius. Raises Unclear where two
    readings are likely, ContactError where none is possible, RecordingError for a file that is no table."""
    said, stated = _aliases(said)
    notes: list[str] = []
    odds = [MOST_ODDS]
    raws = [raw for path in paths for raw in _raws(path, said, notes, odds)]
    for raw in raws:
        _check_sizes(raw)
    signs = signs_of(raws, said, stated)
    if not signs.sure:
        raise unclear_signs(raws[0], signs)
    odds.append(signs.odds)
    travel, load = signs.value
    say_signs(raws[0], signs, notes)
    curves = [c for raw in raws for c in _presses(raw, travel, load, notes)]
    curves = in_units(raws[0], curves, tip_radius_m, notes, odds)
    timed = all("t" in raw.columns for raw in raws)
    return CurvesRead(tuple(curves), tuple(dict.fromkeys(notes)), min(odds), timed)


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


def _raws(path: Path, said: SaidOfCurves, notes: list[str], odds: list[float]) -> list[RawCurves]:
    """Of one file: a table, or a table a test."""
    tables = read_tables(path)
    if not said.columns and tuple(tables[0].columns) == PRESS_COLUMNS:
        return [_of_press(path, tables[0], notes)]
    tests = [side_by_side(table) for table in tables]
    several = max(tests, key=len)
    if len(several) < 2:
        return [_raw(path, path, tables, said, notes, odds)]
    notes.append(f"'{path.name}' holds {len(several)} tests side by side")
    return [_raw(path.with_name(test.name), path, [test], said, notes, odds) for test in several]


_OF_CURVES = {"depth": "z", "load": "fz"}
"""What one says of a curve's columns: their roles in a recording."""


def _raw(
    path: Path,
    file: Path,
    tables: list[Table],
    said: SaidOfCurves,
    notes: list[str],
    odds: list[float],
) -> RawCurves:
    """path: of the curve's own name; file: that holds it."""
    found = told_columns(tables, Said(columns=said.columns, units=said.units))
    if missing := [f"--column {word}=NAME" for word, role in _OF_CURVES.items() if role not in found]:
        raise RecordingError(
            f"which columns of '{path}' are travel and load cannot be determined from their names; say "
            f"{' and '.join(missing)}: there are {_names(tables)}"
        )
    of_curves: tuple[str, ...] = ("t", "z", "fz")
    columns = {role: found[role] for role in of_curves if role in found}
    columns["fz"] = _force_of(file, columns["fz"])
    z, push = (np.asarray(columns[role].values, float) for role in ("z", "fz"))
    t = np.asarray(columns["t"].values, float) if "t" in columns else np.arange(z.size) / _UNTIMED_HZ
    if t.ndim == 0 or z.ndim == 0 or push.ndim == 0 or len({len(t), len(z), len(push)}) > 1:
        raise RecordingError(
            f"'{path}' needs travel and load in columns of one length, as --column depth=NAME and "
            f"--column load=NAME name them: {_names(tables)}"
        )
    if "t" not in columns:
        notes.append(
            "no column of time: the rows are taken in their order, so nothing that takes time is told "
            "(--column t=NAME names one)"
        )
    good = numbers_in(path, t, z, push)
    t, z, push = t[good], np.sign(columns["z"].factor) * z[good], np.sign(columns["fz"].factor) * push[good]
    blocks = len(clock_starts(t))
    if 1 < blocks <= len(t) // 4 + 1:
        t, z, push = _one_clock(path, blocks, t, z, push, said, notes, odds)
    fresh = np.concatenate([[True], t[1:] > np.maximum.accumulate(t)[:-1]])[: len(t)]
    if fresh.sum() < LEAST_ROWS:
        raise RecordingError(f"'{path}' has {fresh.sum()} rows in order of time: {LEAST_ROWS} are needed")
    return RawCurves(path, t[fresh], z[fresh], push[fresh], columns)


def _force_of(path: Path, column: Column) -> Column:
    """A column of force, in N of the file's spring where it is how far that bends. Raises RecordingError
    where the file does not state it."""
    length = unit_in(column.name, "position")
    if length is None:
        return column
    spring = header_of(path).spring_n_per_m
    if spring is None:
        raise RecordingError(
            f"'{path}': '{column.name}' is a length, as of a spring that bends, and the file does not state "
            "the spring: write a line 'Spring constant (N/m): K' above the columns' names, or name a column "
            "of force by --column load=NAME"
        )
    factor = float(np.sign(column.factor)) * SI["position"][length] * spring
    return replace(column, factor=factor, unit="N", assumed=False)


def _of_press(path: Path, table: Table, notes: list[str]) -> RawCurves:
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
    return RawCurves(path, t, way @ along, -force @ along, columns)


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


def _check_sizes(raw: RawCurves) -> None:
    """Raise for lengths and loads that no machine has."""
    travelled, most = float(np.ptp(raw.position)), EXPLORATION["extent"].high
    if travelled > most:
        likely = [f"position={unit}" for unit in ("mm", "um") if travelled * SI["position"][unit] <= most]
        raise Unclear(
            f"'{raw.path}': the tip travels {travelled:.4g} m, where {most:g} m is the most",
            "units",
            likely,
        )
    if np.abs(raw.load).max() > LARGEST_N:
        raise RecordingError(
            f"'{raw.path}' holds a load above {LARGEST_N:g} N: name its unit, as in --units force=uN"
        )


def _presses(raw: RawCurves, travel: int, load: int, notes: list[str]) -> list[MachineCycle]:
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
    short = sum(b - a < LEAST_ROWS for a, b in spans)
    spans = [s for s in spans if s[1] - s[0] >= LEAST_ROWS]
    if short:
        notes.append(f"'{raw.path.name}': {short} stretches of fewer than {LEAST_ROWS} rows are no presses")
    # the first cut is before the first press: what comes before it is its own free air
    if len(spans) > 1 and f[slice(*spans[0])].max() - level < _ENTER * top:
        spans = [(spans[0][0], spans[1][1]), *spans[2:]]
    if len(spans) < 2:
        return [MachineCycle(raw.t, u, f, raw.path.name)]
    notes.append(f"'{raw.path.name}' holds {len(spans)} presses")
    return [
        MachineCycle(raw.t[a:b], u[a:b], f[a:b], f"{raw.path.name}, press {k + 1}")
        for k, (a, b) in enumerate(spans)
    ]


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
