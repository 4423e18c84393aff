"""What a machine's curves mean where nothing says it: which way is in, which load pushes, and the units."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.importing.mapping import Column, vocabulary
from palpate.importing.meaning import (
    BestReading,
    Unclear,
    best,
    press_scores,
)
from palpate.importing.tables import SI, without_unit
from palpate.mechanics.errors import ContactError, RecordingError
from palpate.mechanics.plausible import CURVE, UNIT_SHARES

_NAMED, _USUAL = float(np.log(6.0)), float(np.log(2.0))
"""What a name tells of a direction, and that z points up, travel down, load into the sample (nats)."""


@dataclass(frozen=True)
class RawCurves:
    """One table in SI, signs as in the file. t None: no column of time."""

    path: Path
    t: np.ndarray
    position: np.ndarray
    load: np.ndarray
    columns: Mapping[str, Column]


def signs_of(
    raws: Sequence[RawCurves], said: SaidOfCurves, stated: tuple[int | None, int | None]
) -> BestReading:
    """(travel, load) signs of all files together, which are of one machine."""
    scores: dict[tuple[int, ...], float] = {(a, b): 0.0 for a in (1, -1) for b in (1, -1)}
    for raw in raws:
        for signs, score in press_scores(raw.position, raw.load).items():
            scores[signs] += score
    name, travels = (
        re.sub(r"[^a-z]", "", without_unit(raws[0].columns["z"].name).rpartition(".")[2].lower()),
        vocabulary()["travel"],
    )
    into = _NAMED if name in travels["into"] else -_NAMED if name in travels["out"] else _USUAL
    into = -_USUAL if name == "z" else into
    for a, b in list(scores):
        scores[a, b] += into * (a > 0) + _USUAL * (b > 0)
    kept = {
        key: score
        for key, score in scores.items()
        if all(want is None or want == got for want, got in zip(stated, key, strict=True))
    }
    return best(kept)


def unclear_signs(raw: RawCurves, signs: BestReading) -> RecordingError:
    z, fz = raw.columns["z"].name, raw.columns["fz"].name
    return Unclear(
        f"'{raw.path}': whether '{fz}' is positive or negative in compression cannot be determined from "
        f"how it "
        f"goes with '{z}' ({signs.words}; if these are the wrong columns, --column depth=NAME and "
        "--column load=NAME name them)",
        "compression",
        ("positive", "negative"),
    )


def say_signs(raw: RawCurves, signs: BestReading, notes: list[str]) -> None:
    travel, load = signs.value
    z, fz = raw.columns["z"].name, raw.columns["fz"].name
    way = "into the sample" if travel > 0 else "out of the sample"
    sign = "positive" if load > 0 else "negative"
    notes.append(f"'{z}' counts {way}, '{fz}' is {sign} in compression ({signs.words})")


def in_units(
    raw: RawCurves,
    curves: Sequence[MachineCycle],
    tip_radius_m: float | None,
    notes: list[str],
    odds: list[float],
) -> list[MachineCycle]:
    """The curves in the units that their dent and stiffness tell, where nobody said them. Raises Unclear
    where two may be meant, ContactError where no tip goes so deep."""
    depth, push = (float(np.median(v)) for v in zip(*map(_dent, curves), strict=True))
    z, fz = raw.columns["z"], raw.columns["fz"]
    length = force = 1.0
    if tip_radius_m is None:
        for kind, column in (("position", z), ("force", fz)):
            if column.assumed:
                units = tuple(f"{kind}={unit}" for unit in UNIT_SHARES[kind])
                raise Unclear(f"'{raw.path}': the unit of '{column.name}' is not given", "units", units)
        return list(curves)
    if z.assumed and depth > 0:
        sizes = {unit: depth * SI["position"][unit] / tip_radius_m for unit in UNIT_SHARES["position"]}
        length = _likely("position", sizes, raw, notes, odds)
    depth *= length
    if depth > CURVE["position"].high * tip_radius_m:
        raise ContactError(
            f"'{raw.path}': the tip would go {depth:.3g} m deep, {depth / tip_radius_m:.0f} of its radii: "
            f"are the units and signs of '{z.name}' and '{fz.name}' right? say --units position=mm, --column "
            "depth=NAME, --column load=NAME, or --tip-radius M"
        )
    if fz.assumed and depth > 0 and push > 0:
        modulus = push / (16 / 9 * np.sqrt(tip_radius_m) * depth**1.5)
        moduli = {unit: modulus * SI["force"][unit] for unit in UNIT_SHARES["force"]}
        force = _likely("force", moduli, raw, notes, odds)
    if length == force == 1.0:
        return list(curves)
    return [MachineCycle(c.t, length * c.travel, force * c.force, c.name) for c in curves]


def _likely(
    kind: str, sizes: Mapping[str, float], raw: RawCurves, notes: list[str], odds: list[float]
) -> float:
    """What one is in SI of the likeliest unit; sizes: what CURVE knows of the kind, by the unit it is in."""
    units, shares = list(sizes), UNIT_SHARES[kind]
    reading = best(
        {
            (k,): float(np.log(shares[unit]) - 0.5 * CURVE[kind].off(sizes[unit]) ** 2)
            for k, unit in enumerate(units)
        }
    )
    unit, name = units[reading.value[0]], raw.columns["z" if kind == "position" else "fz"].name
    if not reading.sure:
        other = unit if unit != units[0] else units[1]
        raise Unclear(
            f"'{raw.path}': the unit of '{name}' is not given, and two are likely ({reading.words})",
            "units",
            (f"{kind}={other}", f"{kind}={units[0]}"),
        )
    odds.append(reading.odds)
    if unit != units[0]:
        notes.append(f"'{name}' names no unit: taken as {unit} ({reading.words})")
    return SI[kind][unit]


def _dent(curve: MachineCycle) -> tuple[float, float]:
    """(depth m, force N) of a press at its peak."""
    force = curve.force - np.median(curve.force[: max(3, len(curve.force) // 50)])
    peak = int(np.argmax(force))
    way = curve.travel[: peak + 1]
    first = np.flatnonzero(force[: peak + 1] < 0.05 * force[peak])
    return float(way[-1] - way[first[-1] if len(first) else 0]), float(force[peak])


@dataclass(frozen=True)
class SaidOfCurves:
    """What was said. columns, units: as of `palpate import`, with the roles depth, height and load too.
    travel: "into" or "out"; compression: "positive" or "negative" load; clock: "one" or "blocks"."""

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    travel: str | None = None
    compression: str | None = None
    clock: str | None = None
