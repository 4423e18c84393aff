"""Another simulator's forces along the recorded path, set beside the recording's presses.

And which presses a slow simulator is run over.

Nothing about them is guessed in silence: what is unclear is refused with the option that settles it, what was
interpolated or left out is said (`Aligned.notes`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from palpate.diagnosis.forward.touches import LEAST_PRESSES
from palpate.diagnosis.other_simulator.frame import UNITS, ForceFormat, weighed_frame
from palpate.mechanics.errors import OptionError, RecordingError
from palpate.mechanics.law_errors import Smallest
from palpate.mechanics.options import option
from palpate.mechanics.plausible import COLUMN
from palpate.mechanics.presses.table import LEAD_S, Presses
from palpate.mechanics.quantities import parse_unit
from palpate.render.replay import rms_n


def spread_out(presses: Presses, most: int | None) -> np.ndarray:
    """(p,) bool: at most so many presses (None: all, never fewer than a diagnosis needs), as far from each
    other as they are short. Fewer are always some of more."""
    count = len(presses) if most is None else min(max(most, LEAST_PRESSES), len(presses))
    lasts = presses.end_s - presses.onset_s + 2 * LEAD_S
    chosen = np.zeros(len(presses), dtype=bool)
    away = np.ones(len(presses))
    for _ in range(count):
        worth = np.where(chosen, -1.0, away / lasts)
        new = int(np.argmax(worth))
        distance = np.linalg.norm(presses.point - presses.point[new], axis=1)
        away = distance if not chosen.any() else np.minimum(away, distance)
        chosen[new] = True
    return chosen


LONGEST_GAP_S = 0.03
"""Without rows in a press, over which nothing is interpolated: the press is left out."""
AGAINST, LAG_S, BETTER = -0.3, 0.15, 0.1
"""Cosine from which forces point the wrong way; lag that no delay makes; by how much it must fit better."""
LEAST_LIKE = 0.5
"""Likeness, a correlation, from which another clock is suggested: less is no likeness."""
FORWARD = 0.9
"""Of the steps from row to row, that go on in time at least: rows of a table out of order are sorted, a force
that was taken for the time is refused."""
_GRID_S = 0.02
COARSE = 0.5
"""Of the smallest change that is named as a flaw: reading errors are alike at every press, and above it a
wrong flaw is named. A spring of 0.88 N/mm was found as such where they were a tenth (50 Hz), and as mesh
stiffness where they were 0.6 of it (25 Hz)."""
_MOST_TIMES = 20
"""Of the recording's length, that a file may last and another clock is still looked for."""


@dataclass(frozen=True)
class ForcesOptions:
    """How a simulator's file of forces is meant."""

    title = "another simulator's forces"

    simulated_force_on: str = option(
        "tool", "on which the simulated forces act", choices=("tool", "object"), flag="--simulated-force-on"
    )
    clock_offset_s: float | None = option(
        None,
        "added to the clock of the simulated forces; 0 where it is known to be the recording's",
        unit="s",
        low=-1e10,
        high=1e10,
    )
    simulated_axes: str = option(
        "",
        "which of the recording's axes the file's fx, fy, fz are: x,z,-y where it has y up; default: weighed",
    )
    simulated_unit: str | None = option(
        None, "of the simulated forces; default: weighed, newtons first", choices=UNITS
    )


@dataclass(frozen=True)
class Forces:
    """t: (n,) s, increasing. force: (n, 3) N. name: of simulator or file. notes: what was told of them.
    chosen: (p,) bool, presses of the recording that the simulator was run over; None: all."""

    t: np.ndarray
    force: np.ndarray
    name: str
    notes: tuple[str, ...] = ()
    chosen: np.ndarray | None = None


@dataclass(frozen=True)
class Aligned:
    """force: (n, 3) N on the tool at the rows of the presses. usable: (p,) bool. notes: in words. frame: how
    the file writes them. coarse: that its rows are too far apart, in words, '' where they are not."""

    force: np.ndarray
    usable: np.ndarray
    notes: tuple[str, ...]
    frame: ForceFormat = field(default_factory=ForceFormat)
    coarse: str = ""


def sorted_forces(t: np.ndarray, force: np.ndarray, name: str) -> Forces:
    """Rows without a number left out, sorted by time; raises RecordingError where fewer than two are left, or
    where t goes back and forth."""
    notes = []
    good = np.isfinite(t) & np.isfinite(force).all(axis=1)
    if not good.all():
        notes.append(f"{(~good).sum()} rows without a number were left out")
    back = np.diff(t[good]) < 0
    if len(back) and back.mean() > 1 - FORWARD:
        row = int(np.flatnonzero(good)[np.argmax(back) + 1]) + 1
        raise RecordingError(
            f"'{name}': t does not increase (row {row}; it goes back in {back.sum()} of {len(back)} steps): "
            "is that column the time, in s?"
        )
    t, force = t[good], force[good]
    order = np.argsort(t, kind="stable")
    if (np.diff(order) < 0).any():
        notes.append("the rows were sorted by time")
    t, force = t[order], force[order]
    new = np.append(True, np.diff(t) > 0) if len(t) else np.zeros(0, bool)
    if not new.all():
        notes.append(f"{(~new).sum()} rows repeat a time: the first of each was taken")
    if new.sum() < 2:
        raise RecordingError(f"'{name}' has fewer than two rows with numbers: needed is one a sample")
    return Forces(t[new], force[new], name, tuple(notes))


def aligned(given: Forces, presses: Presses, options: ForcesOptions, level: float = 1.0) -> Aligned:
    """The forces at the presses' rows, on the tool, by straight lines between samples.

    level: how much stiffer than the model the simulation was stated to be. Raises OptionError where they are
    of another time, point the other way, fit another clock far better, or may be in another frame or unit.
    """
    notes = list(given.notes)
    t = given.t + (options.clock_offset_s or 0.0)
    force = given.force if options.simulated_force_on == "tool" else -given.force
    _in_seconds(t, presses)
    if options.clock_offset_s is None:
        _same_clock(t, force, presses)
    elif options.clock_offset_s:
        notes.append(
            f"--clock-offset {options.clock_offset_s:.12g} is taken as the clock: a lag of the simulator "
            "itself cannot be told from it, where that offset was fitted to the forces"
        )
    notes += _same_time(t, presses)
    at = np.column_stack([np.interp(presses.t, t, f, left=0.0, right=0.0) for f in force.T])
    rows = presses.counted if given.chosen is None else presses.counted & given.chosen[presses.press]
    if not (at[rows] ** 2).any():
        raise OptionError(
            "the simulated forces are zero wherever the recording touches: is it the same path?"
        )
    frame = weighed_frame(
        at, presses, rows, axes=options.simulated_axes, unit=options.simulated_unit, level=level
    )
    notes += frame.notes
    at = frame.newtons(at)
    _same_direction(at, presses, rows)
    step, own = float(np.median(np.diff(t))), 1.0 / presses.sample_rate_hz
    if abs(step / own - 1) > 0.05:
        notes.append(
            f"rows come at {1 / step:.4g} Hz, the recording's at {1 / own:.4g} Hz: straight lines between"
        )
    coarse = _too_coarse(step, presses)
    run = np.ones(len(presses), dtype=bool) if given.chosen is None else given.chosen
    usable = run & _without_gaps(t, presses, step)
    there = run & (presses.onset_s >= t[0]) & (presses.end_s <= t[-1])
    if not usable[there].all():
        notes.append(
            f"{(there & ~usable).sum()} of {run.sum()} presses were left out: rows are missing for over "
            f"{1e3 * LONGEST_GAP_S:g} ms"
        )
    return Aligned(at, usable, tuple(notes), frame, coarse)


def reading_error_n(step: float, presses: Presses) -> float:
    """N rms over contact samples by which the measured force changes where it is read every `step` seconds
    and joined by straight lines, less what its own noise makes of that."""
    own = 1.0 / presses.sample_rate_hz
    if step <= own:
        return 0.0
    net = presses.force - presses.free_air
    off = np.zeros_like(net)
    for part in presses.parts:
        t = presses.t[part]
        rows = np.arange(t[0], t[-1] + step, step)
        for k, force in enumerate(net[part].T):
            off[part, k] = np.interp(t, rows, np.interp(rows, t, force)) - force
    # white noise: its own, and two thirds of that between two rows
    noise = 5 / 3 * presses.vector_noise_n**2 * (1 - own / step)
    return float(np.sqrt(max((off[presses.counted] ** 2).sum(axis=1).mean() - noise, 0.0)))


def _too_coarse(step: float, presses: Presses) -> str:
    """That rows so far apart change the force by as much as flaws differ by, in words; '' where not."""
    net = (presses.force - presses.free_air)[presses.counted]
    least = COARSE * Smallest.simulator.value * rms_n(net)
    error = reading_error_n(step, presses)
    if error <= least:
        return ""
    enough = step / 2
    while reading_error_n(enough, presses) > least:
        enough /= 2
    return (
        f"rows at {1 / step:.3g} Hz are too coarse for these presses (the measured force, read so, is off by "
        f"{1e3 * error:.0f} mN): log at {1 / enough:.3g} Hz or more"
    )


def _in_seconds(t: np.ndarray, presses: Presses) -> None:
    """Refuse rows too far apart for any press, with the unit that their times may be in."""
    step = float(np.median(np.diff(t)))
    if step <= COLUMN["time"].high:
        return
    lasts, own = t[-1] - t[0], float(presses.t[-1] - presses.t[0])
    units = {unit: parse_unit(unit).scale for unit in ("ms", "us", "ns")}
    unit = min(units, key=lambda u: abs(np.log(lasts * units[u] / own)))
    raise OptionError(
        f"the rows of the simulated forces lie {step:.4g} s apart, allowed are {COLUMN['time'].high:g} s; "
        f"they last {lasts:.4g} s and the recording's presses {own:.4g} s: are the times in {unit}? "
        f"Then call their column 't ({unit})', or write seconds"
    )


def _same_time(t: np.ndarray, presses: Presses) -> list[str]:
    """What is said of presses that the file does not reach; refuse where too few are left."""
    inside = int(((presses.onset_s >= t[0]) & (presses.end_s <= t[-1])).sum())
    if inside == len(presses):
        return []
    runs = f"the simulated forces run from {t[0]:.6g} to {t[-1]:.6g} s"
    if inside < LEAST_PRESSES:
        raise OptionError(
            f"{runs}, and only {inside} of the {len(presses)} presses lie there (they go on from "
            f"{presses.t[0]:.6g} to {presses.t[-1]:.6g} s); needed are {LEAST_PRESSES}: run the simulator "
            "along more of the recorded path, or state --clock-offset, s, which is added to the file's clock"
        )
    return [f"{runs}: judged by the {inside} of {len(presses)} presses that lie there"]


def _same_clock(t: np.ndarray, force: np.ndarray, presses: Presses) -> None:
    """Refuse a clock that another offset would fit far better."""
    clock = np.arange(presses.t[0], presses.t[-1], _GRID_S)
    if t[-1] - t[0] > _MOST_TIMES * (clock[-1] - clock[0]):
        return
    air = np.zeros(len(clock))
    for part in presses.parts:
        own = slice(*np.searchsorted(clock, [presses.t[part][0], presses.t[part][-1]]))
        net = np.linalg.norm(presses.force[part] - presses.free_air[part], axis=1)
        air[own] = np.interp(clock[own], presses.t[part], net)
    first = round((t[0] - clock[0]) / _GRID_S)  # of the file's samples, on the recording's grid
    there = clock[0] + _GRID_S * (first + np.arange(int((t[-1] - t[0]) / _GRID_S) + 1))
    size = np.interp(there, t, np.linalg.norm(force, axis=1), left=0.0, right=0.0)
    if not size.std() > 0 or not air.std() > 0:
        return
    a, b = air - air.mean(), size - size.mean()
    length = 2 ** int(np.ceil(np.log2(len(a) + len(b))))
    product = np.fft.irfft(np.fft.rfft(a, length) * np.conj(np.fft.rfft(b, length)), length)
    starts = np.arange(1 - len(b), len(a))  # where the file's first sample may lie
    likeness = product[starts] / np.sqrt((a**2).sum() * (b**2).sum())
    best = int(np.argmax(likeness))
    lag = (starts[best] - first) * _GRID_S
    # between presses a simulation may push where the tool traced: those rows tell no clock
    measured = np.linalg.norm(presses.force - presses.free_air, axis=1)
    as_read = np.interp(presses.t, there, size, left=0.0, right=0.0)
    in_presses = np.corrcoef(measured, as_read)[0, 1] if as_read.std() > 0 else 0.0
    as_it_is = max(float(likeness[starts == first].sum()), float(in_presses))
    if abs(lag) > LAG_S and likeness[best] > max(as_it_is + BETTER, LEAST_LIKE):
        lag, error = _fine_lag(t, np.linalg.norm(force, axis=1), presses, lag)
        raise OptionError(
            f"the simulated forces fit the recording {lag:+.3g} s later far better (likeness "
            f"{likeness[best]:.2f} against {as_it_is:.2f}): is it another clock? State "
            "the offset that you know of it (a lag of the simulator's own stays apart), else "
            f"--clock-offset {round(lag, 4):.12g} (+- {1e3 * error:.2g} ms, with its lag in it), or 0 to "
            "keep it as it is"
        )


def _fine_lag(t: np.ndarray, size: np.ndarray, presses: Presses, lag: float) -> tuple[float, float]:
    """The lag, s, near a rough one that forces of size (n,) N at t (n,) s fit the presses best by, least
    squares, and its standard error by how the presses scatter."""
    lags = lag + _GRID_S * np.array([-1.0, 1.0])
    there = (presses.onset_s >= t[0] + lags[1]) & (presses.end_s <= t[-1] + lags[0])
    rows = presses.counted & there[presses.press]
    clock, press = presses.t[rows], presses.press[rows]
    measured = np.linalg.norm((presses.force - presses.free_air)[rows], axis=1)
    step, error = max(float(np.median(np.diff(t))), 1.0 / presses.sample_rate_hz), _GRID_S
    for _ in range(20):
        ahead, here, behind = (np.interp(clock - lag + shift, t, size) for shift in (-step, 0.0, step))
        gain = (measured @ here) / max(here @ here, 1e-300)
        slope = gain * (ahead - behind) / (2 * step)
        off = slope * (measured - gain * here)
        square = max(slope @ slope, 1e-300)
        change = float(np.clip(off.sum() / square, -_GRID_S, _GRID_S))
        error = float(np.sqrt((np.bincount(press, off) ** 2).sum()) / square)
        lag = float(np.clip(lag + change, *lags))
        if abs(change) < 1e-6:
            break
    return lag, error


def _same_direction(at: np.ndarray, presses: Presses, rows: np.ndarray) -> None:
    measured = (presses.force - presses.free_air)[rows]
    size = np.sqrt((measured**2).sum() * (at[rows] ** 2).sum())
    cosine = float((measured * at[rows]).sum() / size) if size > 0 else 0.0
    if cosine < AGAINST:
        raise OptionError(
            f"the simulated forces point against the measured ones (cosine {cosine:.2f}): is it the force on "
            "the object? State --simulated-force-on object"
        )


def _without_gaps(t: np.ndarray, presses: Presses, step: float) -> np.ndarray:
    """(p,) bool: presses that have rows throughout."""
    longest = max(LONGEST_GAP_S, 2.5 * step)
    left, right = t[:-1], t[1:]
    wide = right - left > longest
    usable = np.ones(len(presses), bool)
    for p, (onset, end) in enumerate(zip(presses.onset_s, presses.end_s, strict=True)):
        inside = (left[wide] < end + 0.5 * LEAD_S) & (right[wide] > onset - 0.5 * LEAD_S)
        usable[p] = not inside.any() and onset >= t[0] and end <= t[-1]
    return usable
