"""From tables and what is said of them to a recording: one clock, one frame, the tip's centre, the force at
the tip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.importing.clocks import PARTS, POINTS_HZ, Stream, one_clock, slower_readings, stream_of
from palpate.importing.frames import framed, is_on_tool, one_axis, tared
from palpate.importing.mapping import Column, Said, find_columns
from palpate.importing.meaning import MOST_ODDS, Unclear, best
from palpate.importing.tables import Table
from palpate.importing.units import SI
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.plausible import COLUMN, EXPLORATION
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.checks.samples import Samples
from palpate.reconstruction.checks.units import measured


@dataclass(frozen=True)
class Understood:
    """recording: SI, device frame, force on the tool. columns: by role. notes: what was done, one line each.
    quasi_static: rows without a time. read_hz: rate of the readings, where they lie on a faster clock.
    odds: that the force is whose it was taken to be."""

    recording: Recording
    columns: dict[str, Column]
    notes: tuple[str, ...]
    quasi_static: bool = False
    read_hz: float | None = None
    odds: float = MOST_ODDS


def understand(tables: Sequence[Table], said: Said, name: str) -> Understood:
    """The recording that the tables hold. Raises RecordingError where something needed is missing or
    impossible."""
    if said.tip_radius_m is None:
        raise Unclear("the tip's radius in m is in no table", "tip_radius_m", ())
    columns = find_columns(tables, said)
    notes = [*said.notes, *_sizes(columns)]
    streams = {
        part: stream_of(part, [columns[r] for r in roles if r in columns], columns, tables, said, notes)
        for part, roles in PARTS.items()
        if any(r in columns for r in roles)
    }
    timed = all(s.t is not None for s in streams.values())
    rows = {len(s.values) for s in streams.values()}
    if not timed and len(rows) > 1:
        raise RecordingError(
            f"tables of {', '.join(map(str, sorted(rows)))} rows without a time cannot be joined: "
            "say --column t=NAME"
        )
    numbered = not timed and bool(said.rate_hz)
    if numbered:
        steps = np.arange(rows.pop()) / float(said.rate_hz or np.nan)
        streams = {part: Stream(steps, s.values, s.source) for part, s in streams.items()}
        timed = True
        notes.append(f"no column of time: rows taken at {said.rate_hz:g} Hz")
    read_hz, noise_n = None, None
    if timed:
        t, position, force, quaternion, rate = one_clock(streams, said, notes)
        read_hz, noise_n = slower_readings(streams["force"], rate, notes)
    else:
        notes.append(
            "no column of time: quasi-static points, which show no rates and no delay (else give --rate)"
        )
        t, rate = np.arange(rows.pop()) / POINTS_HZ, POINTS_HZ
        position, force = streams["position"].values, streams["force"].values
        quaternion = streams["orientation"].values if "orientation" in streams else None
    position, force = framed(position, force, quaternion, said, notes)
    force = tared(t, force, said, notes)
    _doubted({role: c for role, c in columns.items() if c.assumed})
    if said.force_on is None and columns["x"].table is None and columns["y"].table is None:
        position, on_tool, odds = one_axis(columns["z"], position, force, notes)
    else:
        on_tool, odds = is_on_tool(position, force, said, notes)
    thing = dict(said.thing)
    recording = Recording(
        t=t,
        position=position,
        force_on_tool=force if on_tool else -force,
        sample_rate_hz=rate,
        tip_radius_m=float(said.tip_radius_m),
        quaternion=quaternion,
        force_noise_std_n=noise_n,
        object_name=str(thing.get("name", name)),
        poisson_ratio=None if thing.get("poisson_ratio") is None else float(thing["poisson_ratio"]),
        description=_description(said, not timed, read_hz),
    )
    if numbered and (doubt := too_quick(recording)):
        notes.append(doubt)
    return Understood(recording, columns, tuple(notes), not timed, read_hz, odds)


def _sizes(columns: dict[str, Column]) -> list[str]:
    """Warnings of sizes that no palpation has in the unit that nobody said; raises Unclear for a path that no
    arm reaches."""
    found = []
    for kind, roles, units in (
        ("position", ("x", "y", "z"), ("mm", "um", "nm")),
        ("force", ("fx", "fy", "fz"), ("mN", "uN", "nN")),
    ):
        most = COLUMN[kind].high
        held = [columns[r] for r in roles if r in columns and columns[r].assumed]
        size = max((_size(kind, np.asarray(c.values)) for c in held), default=0.0)
        if size <= most:
            continue
        seen = {
            "position": f"the path is {size:.3g} m wide",
            "force": f"the force goes up to {size:.3g} N",
        }[kind]
        likely = next((u for u in units if size * SI[kind][u] <= most), units[-1])
        hint = f"{seen} in the unit assumed: is it {likely}?"
        if kind == "position":
            raise Unclear(hint, "units", (f"position={likely}",))
        found.append(f"WARNING: {hint} say --units {kind}={likely}")
    return found


def _doubted(assumed: Mapping[str, Column]) -> None:
    """Raise Unclear where positions or times whose unit nobody said may as well be in mm or ms."""
    if "t" in assumed and _size("time", np.asarray(assumed["t"].values)) > COLUMN["time"].high:
        step = _size("time", np.asarray(assumed["t"].values))
        raise Unclear(
            f"the time step is {step:.3g}, and its unit is not given: ms or s", "units", ("time=ms", "time=s")
        )
    held = [np.asarray(assumed[role].values) for role in ("x", "y", "z") if role in assumed]
    width_m = max((_size("position", values) for values in held), default=0.0)
    if not width_m > 0:
        return
    scores: dict[tuple[int, ...], float] = {
        (k,): -0.5 * COLUMN["position"].off(width_m * SI["position"][unit]) ** 2
        for k, unit in enumerate(("m", "mm"))
    }
    reading = best(scores)
    if reading.value == (1,) or not reading.sure:
        raise Unclear(
            f"the path is {width_m:.3g} wide, and its unit is not given: m or mm",
            "units",
            ("position=mm", "position=m"),
        )


def _size(kind: str, values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    if len(values) < 2:
        return 0.0
    if kind == "time":
        return float(np.median(np.abs(np.diff(values))))
    return float(np.ptp(values) if kind == "position" else np.abs(values).max())


def _description(said: Said, quasi_static: bool, read_hz: float | None) -> dict[str, Any]:
    """What the recording's TOML will say of how it is to be read, for those who use it at once."""
    about: dict[str, Any] = {"quasi_static": True} if quasi_static else {}
    if read_hz is not None:
        about["read_rate_hz"] = read_hz
    tool = {} if said.tip is None else {"tip": said.tip}
    told = {} if said.force_on is None else {"force_on": said.force_on}
    return {"recording": about, "tool": tool, "object": dict(said.thing), "import": told}


_OFF = (10.0, 100.0)
"""Factors by which a rate is mistaken upwards; a machine may go as slowly as it likes."""
_SEEN = ("speed", "touch")


def too_quick(recording: Recording) -> str:
    """A warning, which asks for another rate, where no hand is so quick as the stated one makes it; else ''.

    Both quantities are log-normal (`EXPLORATION`); the rate is doubted where a lower one is far likelier.
    """
    seen = {name: value for name, value in measured(Samples(recording)).items() if name in _SEEN}
    scores: dict[tuple[int, ...], float] = {
        (round(by),): sum(
            -0.5 * EXPLORATION[k].off(v, EXPLORATION[k].powers[0] * -float(np.log(by))) ** 2
            for k, v in seen.items()
        )
        for by in (1.0, *_OFF)
    }
    reading = best(scores)
    if reading.value == (1,) or not reading.sure:
        return ""
    rate = recording.sample_rate_hz / reading.value[0]
    told = " and ".join(
        f"a {EXPLORATION[k].words} of {v:.2g}, where {EXPLORATION[k].usual:.2g} is usual"
        for k, v in seen.items()
    )
    given = f"WARNING: rows at {recording.sample_rate_hz:g} Hz give {told}"
    return f"{given}: is it {rate:g} Hz? say --rate {rate:g}"
