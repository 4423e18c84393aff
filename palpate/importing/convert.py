"""From tables and what is said of them to a recording: one clock, one frame, the tip's centre, the force at
the tip.

Frames: a sensor's reading is turned by `rotation` (sensor to tool, or to device where frame = "device"), a
tool frame by the orientation; the tip's centre is the stated position plus the orientation's turn of
`flange_to_tip_m`. The weight of `mass_kg` beyond the sensor acts along -z of the device frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from mechanics.errors import RecordingError
from mechanics.recording import Recording
from palpate.importing.mapping import ROLES, Column, Said, find_columns, time_of
from palpate.importing.meaning import (
    MOST_ODDS,
    Reading,
    Unclear,
    best,
    clock_of,
    clock_starts,
    force_sense,
    joined,
    press_scores,
    settled_clock,
)
from palpate.importing.tables import Table
from palpate.importing.units import SI
from reconstruct.steps.s1_filter.low_pass import white_noise_std

GRAVITY_M_PER_S2 = 9.80665
_SEARCH_S, _SURE = 3.0, 0.5
_MOST_HZ = 2000.0
_WIDEST_M, _HARDEST_N, _SLOWEST_S = 3.0, 100.0, 0.5
"""A unit that was only assumed is doubted beyond an arm's reach, a hand's push, a reading's interval."""
_USUAL_WIDTH_M, _WIDTH_FACTOR = 0.05, 4.0
"""How wide a path is, and by which factor that varies."""
POINTS_HZ = 100.0
"""Rows without a time are numbered by this clock, and slower readings put on it; a recording needs one."""
LEAST_HZ = 60.0
"""Slower readings are drawn out to a faster clock."""


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
    notes = _sizes(columns)
    streams = {
        part: _stream(part, [columns[r] for r in roles if r in columns], columns, tables, said, notes)
        for part, roles in _PARTS.items()
        if any(r in columns for r in roles)
    }
    timed = all(s.t is not None for s in streams.values())
    rows = {len(s.values) for s in streams.values()}
    if not timed and len(rows) > 1:
        raise RecordingError(
            f"tables of {', '.join(map(str, sorted(rows)))} rows without a time cannot be joined: "
            "say --column t=NAME"
        )
    if not timed and said.rate_hz:
        steps = np.arange(rows.pop()) / said.rate_hz
        streams = {part: _Stream(steps, s.values, s.source) for part, s in streams.items()}
        timed = True
        notes.append(f"no column of time: rows taken at {said.rate_hz:g} Hz")
    read_hz, noise_n = None, None
    if timed:
        t, position, force, quaternion, rate = _one_clock(streams, said, notes)
        read_hz, noise_n = _slower(streams["force"], rate, notes)
    else:
        notes.append(
            "no column of time: quasi-static points, which tell no rates and no delay (else give --rate)"
        )
        t, rate = np.arange(rows.pop()) / POINTS_HZ, POINTS_HZ
        position, force = streams["position"].values, streams["force"].values
        quaternion = streams["orientation"].values if "orientation" in streams else None
    position, force = _framed(position, force, quaternion, said, notes)
    force = _tared(t, force, said, notes)
    _doubted({role: c for role, c in columns.items() if c.assumed})
    if said.force_on is None and columns["x"].table is None and columns["y"].table is None:
        position, on_tool, odds = _one_axis(columns["z"], position, force, notes)
    else:
        on_tool, odds = _on_tool(position, force, said, notes)
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
    return Understood(recording, columns, tuple(notes), not timed, read_hz, odds)


def _sizes(columns: dict[str, Column]) -> list[str]:
    """Warnings of sizes that no palpation has in the unit that nobody said; raises RecordingError for a path
    that no arm reaches."""
    found = []
    for kind, roles, most, units in (
        ("position", ("x", "y", "z"), _WIDEST_M, ("mm", "um", "nm")),
        ("force", ("fx", "fy", "fz"), _HARDEST_N, ("mN", "uN", "nN")),
    ):
        held = [columns[r] for r in roles if r in columns and columns[r].assumed]
        size = max((_size(kind, np.asarray(c.values)) for c in held), default=0.0)
        if size <= most:
            continue
        seen = {
            "position": f"the path is {size:.3g} m wide",
            "force": f"the force goes up to {size:.3g} N",
        }[kind]
        likely = next((u for u in units if size * SI[kind][u] <= most), units[-1])
        hint = f"{seen} in the unit assumed: is it {likely}? say --units {kind}={likely}"
        if kind == "position":
            raise RecordingError(hint)
        found.append(f"WARNING: {hint}")
    return found


def _doubted(assumed: Mapping[str, Column]) -> None:
    """Raise Unclear where positions or times whose unit nobody said may as well be in mm or ms."""
    if "t" in assumed and _size("time", np.asarray(assumed["t"].values)) > _SLOWEST_S:
        step = _size("time", np.asarray(assumed["t"].values))
        raise Unclear(
            f"a row comes every {step:.3g}, and nobody said whether ms or s", "units", ("time=ms", "time=s")
        )
    held = [np.asarray(assumed[role].values) for role in ("x", "y", "z") if role in assumed]
    width_m = max((_size("position", values) for values in held), default=0.0)
    if not width_m > 0:
        return
    scores: dict[tuple[int, ...], float] = {
        (k,): -0.5 * (np.log(width_m * SI["position"][unit] / _USUAL_WIDTH_M) / np.log(_WIDTH_FACTOR)) ** 2
        for k, unit in enumerate(("m", "mm"))
    }
    reading = best(scores)
    if reading.value == (1,) or not reading.sure:
        raise Unclear(
            f"the path is {width_m:.3g} wide, and nobody said whether in m or mm",
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
    return {"recording": about, "object": dict(said.thing)}


def _slower(force: _Stream, rate_hz: float, notes: list[str]) -> tuple[float | None, float | None]:
    """(rate of the force's readings, noise N of a component), where these are slower than the clock: what is
    drawn between two readings has lost its noise."""
    assert force.t is not None
    read_hz = float(1 / np.median(np.diff(force.t)))
    if read_hz > rate_hz / 1.5 or len(force.values) < 10:
        return None, None
    noise = white_noise_std(force.values)
    notes.append(f"the force was read at {read_hz:.4g} Hz, with a noise of {noise:.2g} N a component")
    return read_hz, noise or None


_PARTS = {"position": ROLES[1:4], "force": ROLES[4:7], "orientation": ROLES[7:]}


@dataclass(frozen=True)
class _Stream:
    """t (n,) s or None; values (n, 3 or 4) SI; source: the table's name."""

    t: np.ndarray | None
    values: np.ndarray
    source: str


def _stream(
    part: str,
    held: list[Column],
    columns: dict[str, Column],
    tables: Sequence[Table],
    said: Said,
    notes: list[str],
) -> _Stream:
    """The columns of one part, finite rows in order of time."""
    sources = {id(c.table): c.table for c in held if c.table is not None}
    if len(sources) > 1:
        raise RecordingError(f"the columns of the {part} are of several tables: take them from one")
    if not sources:
        raise RecordingError(f"the {part} is a constant: name at least one column of it")
    table = next(iter(sources.values()))
    values = np.column_stack([np.broadcast_to(np.asarray(c.values, float), table.rows) for c in held])
    clock = _clock_of(table, columns, said)
    good = np.isfinite(values).all(axis=1)
    t = None if clock is None else np.asarray(clock.values, float)
    if t is not None:
        good &= np.isfinite(t)
    if not good.all():
        notes.append(f"{part}: {int((~good).sum())} of {len(good)} rows hold no numbers and are left out")
    values, t = values[good], None if t is None else t[good]
    if len(values) < 2:
        raise RecordingError(f"the {part} has fewer than two rows of numbers")
    if t is not None:
        t, values = _in_order(part, t, values, said, notes)
        fresh = np.concatenate([[True], np.diff(t) > 0])
        if not fresh.all():
            notes.append(f"{part}: {int((~fresh).sum())} rows repeat an earlier time and are left out")
        t, values = t[fresh], values[fresh]
    if part == "orientation":
        length = np.linalg.norm(values, axis=1, keepdims=True)
        if not (np.abs(length - 1) < 0.05).all():
            raise RecordingError("qw,qx,qy,qz are no unit quaternions (w first): name the right columns")
        values = values / length
    return _Stream(t, values, table.name)


def _in_order(
    part: str, t: np.ndarray, values: np.ndarray, said: Said, notes: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Rows in order of time: sorted, or blocks with clocks of their own one after the other."""
    blocks = len(clock_starts(t))
    if blocks == 1:
        return t, values
    reading = clock_of(t, values) if blocks <= len(t) // 4 else Reading((1,), MOST_ODDS)
    reading = settled_clock(part, t, said.clock, reading)
    if reading.value[0] < 0:
        notes.append(
            f"{part}: {blocks} blocks with their own clocks are put one after the other ({reading.words})"
        )
        return joined(t), values
    order = np.argsort(t, kind="stable")
    notes.append(f"{part}: rows sorted by time")
    return t[order], values[order]


def _clock_of(table: Table, columns: dict[str, Column], said: Said) -> Column | None:
    """The time of a table: the column that was found, or the one of the same name in this table."""
    found = columns.get("t")
    if found is None or found.table is table:
        return found
    if found.name in table.columns:
        return Column("t", table, found.name, found.factor, found.unit, found.guessed)
    alone = time_of(table, said)
    if alone is None:
        raise RecordingError(
            f"'{table.name}' has no column of time: its rows cannot be put beside the others'"
        )
    return alone


def _one_clock(
    streams: dict[str, _Stream], said: Said, notes: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None, float]:
    """All on one clock from 0 s: the position's own where all share it, else even steps over what they
    share."""
    place, push, turn = streams["position"], streams["force"], streams.get("orientation")
    times = {part: np.asarray(s.t) for part, s in streams.items()}
    together = all(
        len(t) == len(times["position"]) and np.array_equal(t, times["position"]) for t in times.values()
    )
    rate = float(1 / np.median(np.diff(times["position"])))
    if together and said.offset_s in (None, 0, 0.0) and not said.rate_hz and rate >= LEAST_HZ:
        t = times["position"] - times["position"][0]
        return t, place.values, push.values, None if turn is None else turn.values, rate
    offset = _offset(place, push, said, notes)
    times["force"] = times["force"] + offset
    begin, end = max(t[0] for t in times.values()), min(t[-1] for t in times.values())
    if not end > begin:
        raise RecordingError("the clocks of position and force share no time: give --offset S or auto")
    finest = max(1 / float(np.median(np.diff(t))) for t in times.values())
    rate = said.rate_hz or (min(finest, _MOST_HZ) if finest >= LEAST_HZ else POINTS_HZ)
    t = begin + np.arange(int((end - begin) * rate) + 1) / rate
    even = {
        part: np.column_stack([np.interp(t, times[part], column) for column in streams[part].values.T])
        for part in ("position", "force")
    }
    quaternion = None
    if turn is not None:
        slerp = Slerp(times["orientation"], Rotation.from_quat(turn.values[:, [1, 2, 3, 0]]))
        quaternion = slerp(np.clip(t, *times["orientation"][[0, -1]])).as_quat()[:, [3, 0, 1, 2]]
    notes.append(f"resampled to {rate:g} Hz over the {end - begin:.3g} s that all clocks share")
    return t - t[0], even["position"], even["force"], quaternion, float(rate)


def _offset(place: _Stream, push: _Stream, said: Said, notes: list[str]) -> float:
    """s to add to the force's clock: what was said; 0 where the clocks overlap; else by cross-correlation."""
    assert place.t is not None and push.t is not None
    if isinstance(said.offset_s, int | float) and np.isfinite(said.offset_s):
        notes.append(f"force's clock moved by {said.offset_s:g} s, as said")
        return float(said.offset_s)
    if said.offset_s not in (None, "auto"):
        raise RecordingError(f"offset_s is {said.offset_s!r}; allowed are seconds or auto")
    shared = min(place.t[-1], push.t[-1]) - max(place.t[0], push.t[0])
    overlap = shared / max(min(np.ptp(place.t), np.ptp(push.t)), 1e-9)
    if said.offset_s is None and overlap > 0.5:
        return 0.0
    rough = 0.0 if overlap > 0.5 else float(place.t[0] - push.t[0])
    lag, sure = cross_correlated(place.t, place.values, push.t + rough, push.values)
    if sure < _SURE:
        raise RecordingError(
            f"the clocks of position and force cannot be joined: pressing and force correlate by {sure:.2f} "
            "at best: give --offset S"
        )
    notes.append(
        f"force's clock moved by {rough + lag:.4f} s: depth and force correlate best there ({sure:.2f})"
    )
    return rough + lag


def cross_correlated(
    t: np.ndarray, position: np.ndarray, t_force: np.ndarray, force: np.ndarray
) -> tuple[float, float]:
    """(lag s to add to t_force, correlation): where force and motion against it agree best, within 3 s.

    position (n, 3) m at t, force (m, 3) N at t_force. The motion is that along the mean direction of the
    force.
    """
    step = max(float(np.median(np.diff(t))), float(np.median(np.diff(t_force))))
    size = np.linalg.norm(force - np.median(force, axis=0), axis=1)
    strong = size > np.percentile(size, 95)
    along = (force - np.median(force, axis=0))[strong].mean(axis=0)
    along /= max(np.linalg.norm(along), 1e-12)
    grid = np.arange(max(t[0], t_force[0]) - _SEARCH_S, min(t[-1], t_force[-1]) + _SEARCH_S, step)
    path = np.interp(grid, t, position @ along)
    push = np.interp(grid, t_force, np.linalg.norm(force - np.median(force, axis=0), axis=1))
    # contacts start and end where the motion turns: rates agree where levels drift
    a, b = (v - v.mean() for v in (path, push))
    count = round(_SEARCH_S / step)
    lags = np.arange(-count, count + 1)
    inner = slice(count, len(grid) - count)
    if len(grid) - 2 * count < 20:
        return 0.0, 0.0
    found = np.empty(len(lags))
    for i, lag in enumerate(lags):
        one, other = a[inner], b[count - lag : len(grid) - count - lag]
        one, other = one - one.mean(), other - other.mean()
        found[i] = abs(one @ other) / max(np.linalg.norm(one) * np.linalg.norm(other), 1e-300)
    best = int(np.argmax(found))
    shift = 0.0
    if 0 < best < len(lags) - 1:
        left, here, right = found[best - 1 : best + 2]
        bend = left - 2 * here + right
        shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float((lags[best] + shift) * step), float(found[best])


def _framed(
    position: np.ndarray, force: np.ndarray, quaternion: np.ndarray | None, said: Said, notes: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """The tip's centre and the force without the tool's weight, device frame."""
    if said.rotation is not None:
        turn = _matrix(said.rotation)
        force = force @ turn.T
        notes.append("force turned from the sensor's frame by the stated rotation")
    if said.frame == "tool" or said.flange_to_tip_m is not None:
        if quaternion is None:
            raise RecordingError(
                "a sensor in the tool's frame, or flange_to_tip_m, needs the orientation: name qw, qx, qy, qz"
            )
        turned = Rotation.from_quat(quaternion[:, [1, 2, 3, 0]])
        if said.frame == "tool":
            force = turned.apply(force)
            notes.append("force turned from the tool's frame by the orientation")
        if said.flange_to_tip_m is not None:
            arm = np.asarray(said.flange_to_tip_m, dtype=float)
            if arm.shape != (3,):
                raise RecordingError(
                    f"flange_to_tip_m is {said.flange_to_tip_m}; it must be three numbers X,Y,Z"
                )
            position = position + turned.apply(arm)
            notes.append(f"tip's centre {1e3 * np.linalg.norm(arm):.4g} mm off the stated position")
    if said.mass_kg:
        sign = -1.0 if said.force_on == "object" else 1.0
        force = force + sign * np.array([0.0, 0.0, said.mass_kg * GRAVITY_M_PER_S2])
        notes.append(f"weight of {said.mass_kg:g} kg beyond the sensor taken off")
    return position, force


def _one_axis(
    z: Column, position: np.ndarray, force: np.ndarray, notes: list[str]
) -> tuple[np.ndarray, bool, float]:
    """(position with z out of the sample, whether the force is that on the tool, odds) of a machine that
    moves along z alone. Raises Unclear."""
    scores = press_scores(-position[:, 2], force[:, 2])
    signs = best({key: score for key, score in scores.items() if z.guessed or key[0] > 0})
    if not signs.sure:
        raise Unclear(
            f"whether the force is that on the tool or on the object cannot be told from how it goes with "
            f"'{z.name}' ({signs.words})",
            "force_on",
            ("tool", "object"),
        )
    travel, load = signs.value
    notes.append(
        f"'{z.name}' counts {'into' if travel * z.factor < 0 else 'out of'} the sample, the force is that on "
        f"the {'tool' if load > 0 else 'object'} ({signs.words})"
    )
    return position * [1.0, 1.0, float(travel)], load > 0, signs.odds


def _on_tool(position: np.ndarray, force: np.ndarray, said: Said, notes: list[str]) -> tuple[bool, float]:
    """(whether the force is that on the tool, odds): as said, else by what a solid does. Raises Unclear."""
    sense = force_sense(position, force)
    if said.force_on is not None:
        if sense.sure and (sense.value[0] > 0) != (said.force_on == "tool"):
            other = "object" if said.force_on == "tool" else "tool"
            notes.append(
                f"WARNING: the force grows as the tip moves along it, not against it ({sense.words}): is a "
                f"sign wrong, or is it --force-on {other}?"
            )
        return said.force_on == "tool", MOST_ODDS
    if not sense.sure:
        raise Unclear(
            f"whether the force is that on the tool or on the object cannot be told from {len(force)} rows "
            f"({sense.words})",
            "force_on",
            ("tool", "object"),
        )
    if sense.value[0] < 0:
        notes.append(
            "WARNING: the force grows as the tip moves along it, so it is taken as that on the object "
            f"({sense.words}; --force-on tool if it is not)"
        )
    else:
        notes.append(f"the force is that on the tool ({sense.words})")
    return sense.value[0] > 0, sense.odds


def _matrix(value: Any) -> np.ndarray:
    try:
        turn = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        turn = np.zeros(0)
    if (
        turn.shape != (3, 3)
        or not np.allclose(turn @ turn.T, np.eye(3), atol=1e-3)
        or np.linalg.det(turn) < 0
    ):
        raise RecordingError("rotation must be a right-handed 3 x 3 rotation matrix, sensor to frame")
    return turn


def _tared(t: np.ndarray, force: np.ndarray, said: Said, notes: list[str]) -> np.ndarray:
    """Less the mean force of a stretch in free air."""
    if said.tare_s is None:
        return force
    begin, end = said.tare_s
    inside = (t >= begin) & (t <= end)
    if inside.sum() < 3:
        raise RecordingError(
            f"tare from {begin:g} to {end:g} s holds {int(inside.sum())} samples; 3 are needed"
        )
    level = force[inside].mean(axis=0)
    notes.append(f"tared by {np.linalg.norm(level):.4g} N, the mean from {begin:g} to {end:g} s")
    return force - level
