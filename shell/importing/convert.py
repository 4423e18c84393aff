"""From tables and what is said of them to a recording: one clock, one frame, the tip's centre, the force at
the tip.

From a sensor's frame and a flange to the tip's centre and the force at the tip, in the device frame.

A sensor's reading is turned by `rotation` (sensor to tool, or to device where frame = "device"), a tool frame
by the orientation; the tip's centre is the stated position plus the orientation's turn of `flange_to_tip_m`.
The weight of `mass_kg` beyond the sensor acts along -z of the device frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.importing.clocks import PARTS, POINTS_HZ, Stream, one_clock, slower_readings, stream_of
from palpate.importing.mapping import Column, Said, find_columns
from palpate.importing.meaning import MOST_ODDS, Unclear, best, force_sense, press_scores
from palpate.importing.tables import SI, Table
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.plausible import COLUMN, EXPLORATION
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.checks.samples import Samples
from palpate.reconstruction.checks.units import measured
from palpate.reconstruction.steps.s1_filter.noise import white_noise_std
from palpate.words import mm

GRAVITY_M_PER_S2 = 9.80665


def framed(
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
            notes.append(f"tip's centre {mm(float(np.linalg.norm(arm)), '.4g')} off the stated position")
    if said.mass_kg:
        sign = -1.0 if said.force_on == "object" else 1.0
        force = force + sign * np.array([0.0, 0.0, said.mass_kg * GRAVITY_M_PER_S2])
        notes.append(f"weight of {said.mass_kg:g} kg beyond the sensor taken off")
    return position, force


def one_axis(
    z: Column, position: np.ndarray, force: np.ndarray, notes: list[str]
) -> tuple[np.ndarray, bool, float]:
    """(position with z out of the sample, whether the force is that on the tool, odds) of a machine that
    moves along z alone. Raises Unclear."""
    scores = press_scores(-position[:, 2], force[:, 2])
    signs = best({key: score for key, score in scores.items() if z.guessed or key[0] > 0})
    if not signs.sure:
        raise Unclear(
            f"whether the force is that on the tool or on the object cannot be determined from how it "
            f"changes with "
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


_OF_AIR = 6.0
"""Standard deviations of its noise that no force in free air leaves its median by."""


def is_on_tool(position: np.ndarray, force: np.ndarray, said: Said, notes: list[str]) -> tuple[bool, float]:
    """(whether the force is that on the tool, odds): as said, else by what a solid does. Raises Unclear."""
    sense = force_sense(position, force)
    if said.force_on is not None:
        if sense.sure and (sense.value[0] > 0) != (said.force_on == "tool"):
            other = "object" if said.force_on == "tool" else "tool"
            notes.append(
                f"WARNING: the force grows as the tip moves along it, not against it ({sense.words}): leave "
                f"--force-on {said.force_on} out, or say --force-on {other}; or is a sign wrong?"
            )
        turned = "" if said.force_on == "tool" else ": turned round"
        notes.append(f"the force is that on the {said.force_on}, as stated{turned}")
        return said.force_on == "tool", MOST_ODDS
    if not sense.sure:
        noise_n = white_noise_std(force)
        if np.abs(force - np.median(force, axis=0)).max() < _OF_AIR * noise_n:
            raise RecordingError(
                f"no contact: in {len(force)} rows no force rises above its noise ({noise_n:.2g} N an axis): "
                "record presses from the air and back, or say which columns hold the force (--column fz=NAME)"
            )
        raise Unclear(
            f"whether the force is that on the tool or on the object cannot be determined from "
            f"{len(force)} rows "
            f"({sense.words})",
            "force_on",
            ("tool", "object"),
        )
    if sense.value[0] < 0:
        notes.append(
            "WARNING: the force grows as the tip moves along it, so it is taken as that on the object and "
            f"turned round ({sense.words}; --force-on tool if it is not)"
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


def tared(t: np.ndarray, force: np.ndarray, said: Said, notes: list[str]) -> np.ndarray:
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
