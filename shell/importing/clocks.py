"""Position, force and orientation, each by a clock of its own, brought to one clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, Slerp

from palpate.importing.mapping import ROLES, Column, Said, named_columns
from palpate.importing.meaning import MOST_ODDS, BestReading, clock_of, clock_starts, joined, settled_clock
from palpate.importing.tables import Table
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.plausible import SAMPLE_RATE
from palpate.reconstruction.steps.s1_filter.noise import white_noise_std

_SEARCH_S, _SURE = 3.0, 0.5
_EVEN = 1e-4
"""Share by which the mean of even steps is off their median."""
_FEW = 0.5
"""Share of rows with a time of their own, below which whole seconds are not the time."""
_MOST_HZ = 2000.0
_SLOWER = 1.5
"""Readings so many times slower than the steps of a clock lie apart on it."""
POINTS_HZ = 100.0
"""Rows without a time are numbered by this clock, and readings slower than a recording's put on it."""
PARTS = {"position": ROLES[1:4], "force": ROLES[4:7], "orientation": ROLES[7:]}


@dataclass(frozen=True)
class Stream:
    """t (n,) s or None; values (n, 3 or 4) SI; source: the table's name."""

    t: np.ndarray | None
    values: np.ndarray
    source: str


def stream_of(
    part: str,
    held: list[Column],
    columns: dict[str, Column],
    tables: Sequence[Table],
    said: Said,
    notes: list[str],
) -> Stream:
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
        one = fresh.sum() < 2
        if one or (fresh.mean() < _FEW and (t[fresh] % 1 == 0).all()):
            raise RecordingError(
                f"the time of the {part} is {'one moment' if one else 'whole seconds'}, and "
                f"{100 * (1 - fresh.mean()):.1f} % of its rows repeat it: name a column that runs "
                "(--column t=NAME), or leave it out and give --rate HZ"
            )
        if not fresh.all():
            notes.append(f"{part}: {int((~fresh).sum())} rows repeat an earlier time and are left out")
        t, values = t[fresh], values[fresh]
    if part == "orientation":
        length = np.linalg.norm(values, axis=1, keepdims=True)
        if not (np.abs(length - 1) < 0.05).all():
            raise RecordingError("qw,qx,qy,qz are no unit quaternions (w first): name the right columns")
        values = values / length
    return Stream(t, values, table.name)


def _in_order(
    part: str, t: np.ndarray, values: np.ndarray, said: Said, notes: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Rows in order of time: sorted, or blocks with clocks of their own one after the other."""
    blocks = len(clock_starts(t))
    if blocks == 1:
        return t, values
    reading = clock_of(t, values) if blocks <= len(t) // 4 else BestReading((1,), MOST_ODDS)
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
    alone = named_columns([table], ("t",), said).get("t")
    if alone is None:
        raise RecordingError(
            f"'{table.name}' has no column of time: its rows cannot be matched with the others'"
        )
    return alone


def one_clock(
    streams: dict[str, Stream], said: Said, notes: list[str]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None, float]:
    """All on one clock from 0 s: the position's own where all share it, else even steps over what they
    share."""
    place, push, turn = streams["position"], streams["force"], streams.get("orientation")
    times = {part: np.asarray(s.t) for part, s in streams.items()}
    together = all(
        len(t) == len(times["position"]) and np.array_equal(t, times["position"]) for t in times.values()
    )
    step = float(np.median(np.diff(times["position"])))
    mean = float(np.ptp(times["position"])) / (len(times["position"]) - 1)
    if abs(mean / step - 1) < _EVEN:
        step = mean  # nanoseconds since 1970 are known to 256 of them, which a median does not average
    rate = float(f"{1 / step:.9g}")  # 1000, not 999.9999999952
    if together and said.offset_s in (None, 0, 0.0) and not said.rate_hz and rate >= SAMPLE_RATE.low:
        t = times["position"] - times["position"][0]
        return t, place.values, push.values, None if turn is None else turn.values, rate
    offset = _offset(place, push, said, notes)
    times["force"] = times["force"] + offset
    begin, end = max(t[0] for t in times.values()), min(t[-1] for t in times.values())
    if not end > begin:
        raise RecordingError("the clocks of position and force share no time: give --offset S or auto")
    finest = max(1 / float(np.median(np.diff(t))) for t in times.values())
    rate = said.rate_hz or min(finest, _MOST_HZ)
    rate = rate if rate >= SAMPLE_RATE.low else POINTS_HZ  # a slower recording cannot be read
    t = begin + np.arange(int((end - begin) * rate) + 1) / rate
    even = {part: _between(t, times[part], streams[part].values) for part in ("position", "force")}
    quaternion = None
    if turn is not None:
        slerp = Slerp(times["orientation"], Rotation.from_quat(turn.values[:, [1, 2, 3, 0]]))
        quaternion = slerp(np.clip(t, *times["orientation"][[0, -1]])).as_quat()[:, [3, 0, 1, 2]]
    notes.append(f"resampled to {rate:g} Hz over the {end - begin:.3g} s that all clocks share")
    return t - t[0], even["position"], even["force"], quaternion, float(rate)


def _between(t: np.ndarray, read: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(n, 3) at times t (n,) of readings (m, 3) at `read` (m,): by lines, or, where readings are slower than
    that, by cubics that overshoot none of them. A press is convex: lines between 10 readings a second lie
    above it, which made a solid up to 5 % too soft."""
    if np.median(np.diff(read)) > _SLOWER * (t[1] - t[0]):
        return np.asarray(PchipInterpolator(read, values)(np.clip(t, read[0], read[-1])))
    return np.column_stack([np.interp(t, read, column) for column in values.T])


def _offset(place: Stream, push: Stream, said: Said, notes: list[str]) -> float:
    """s to add to the force's clock: what was said; 0 where the clocks overlap; else by cross-correlation."""
    assert place.t is not None and push.t is not None
    if isinstance(said.offset_s, int | float) and np.isfinite(said.offset_s):
        notes.append(f"force's clock moved by {said.offset_s:g} s, as stated")
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


def slower_readings(force: Stream, rate_hz: float, notes: list[str]) -> tuple[float | None, float | None]:
    """(rate of the force's readings, noise N of a component), where these are slower than the clock: what is
    drawn between two readings has lost its noise."""
    assert force.t is not None
    read_hz = float(1 / np.median(np.diff(force.t)))
    if read_hz > rate_hz / _SLOWER or len(force.values) < 10:
        return None, None
    noise = white_noise_std(force.values)
    notes.append(f"the force was read at {read_hz:.4g} Hz, with a noise of {noise:.2g} N a component")
    return read_hz, noise or None
