"""The presses of a recording, once they are found, cut out of it: loss of touch, free air, noise."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.presses.repeats import SITE_M, sites_of
from palpate.mechanics.presses.table import LEAD_S, STEP_S, USUAL_NOISE_N, Noise, Presses
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import ON_SUPPORT, TimeSegment, runs
from palpate.mechanics.statistics import are_read, spread_about_zero

AROUND_S = 0.3
"""Samples are kept this long before first and after last touch."""
CLEAR_S = 0.15
"""Free air keeps this far from any touch."""
SETTLED_S = 0.5
"""Free air begins this long after the base was traced."""
_SMOOTH_S = 0.015
_LET_GO = 0.02
_LINES = 30
"""Steps over which an air that wanders runs straight."""
_MOST_SLOW = 3.2
"""Times a mean over STEP_S scatters as much as white noise would, at most: as where 30 % of the noise is
below 10 Hz, read at 2 kHz."""
_MOST_AFTER_S = 0.1
"""A touch is lost so soon after it no longer stands above the noise, or then."""

_LEFT_M = 5e-3
"""A press is over where the tip's centre is so high above where it first touched, and higher than aside,
whatever the force reads: no first touch is off, no neck of glue drawn, and nothing climbed by as much."""


def loss_of_touch(
    t: np.ndarray,
    push: np.ndarray,
    rate_hz: float,
    *,
    onset_s: float,
    peak_s: float,
    limit_s: float,
    noise_n: float,
) -> float:
    """The time, s, at which a press's force is back at what it was in the air.

    t: (n,) s at about rate_hz; push: (n,) N along the outward normal, of noise_n a sample, net of what is
    read in free air where that is known: a tool that turns weighs as much as a soft object presses. limit_s:
    no later than this. Back: the mean over 15 ms within 2 % of the greatest, or three times its own noise, of
    the median from 150 to 30 ms before first touch.
    """
    size = max(1, round(_SMOOTH_S * rate_hz))
    begin, stop = np.searchsorted(t, [peak_s, limit_s])
    stop = max(stop, min(begin + round(0.05 * rate_hz), len(t)))
    after = push[begin:stop]
    if len(after) < 2 * size:
        return float(t[min(stop, len(t) - 1)])
    smooth = np.convolve(after, np.full(size, 1 / size), mode="same")
    first = int(np.searchsorted(t, onset_s))
    before = push[max(first - round(0.15 * rate_hz), 0) : max(first - round(0.03 * rate_hz), 1)]
    level = float(np.median(before))
    least = level + max(_LET_GO * (smooth.max() - level), 3 * noise_n / np.sqrt(size))
    below = np.flatnonzero(smooth < least)
    return float(t[begin + below[0]]) if len(below) else float(t[stop - 1])


def free_segments(
    t: np.ndarray, onset_s: np.ndarray, end_s: np.ndarray, begin_s: float
) -> tuple[TimeSegment, ...]:
    """Stretches of free air between the touches (onset_s, end_s), CLEAR_S away from each, after begin_s."""
    free = t > begin_s
    for onset, end in zip(onset_s, end_s, strict=True):
        free &= (t < onset - CLEAR_S) | (t > end + CLEAR_S)
    return tuple(TimeSegment("free", float(t[a]), float(t[b - 1])) for a, b in runs(free) if b > a + 1)


def measured_noise(
    recording: Recording, free: np.ndarray, read_n: np.ndarray | None, usual_n: float = USUAL_NOISE_N
) -> Noise:
    """The noise in free air, (n,) bool; the stated (or the usual) value, white, where there is too little.

    read_n: (n, 3) N, what the air reads beside it: level, drift, and a tool's weight and inertia. None where
    that is followed straight from one touch to the next, as a tool that turns unseen wanders by more than the
    sensor does: then noise is what is left beside lines over 0.3 s.

    A recording that was read more slowly than it is sampled ([recording] read_rate_hz) has no more noise
    than its readings had, and that lasts from one reading to the next.
    """
    per_step = max(1, round(STEP_S * recording.sample_rate_hz))
    held = _held(recording)
    stated = recording.force_noise_std_n or usual_n
    if held > 1:
        lasting = min(1.0, held / per_step)
        step = stated * np.sqrt(max(lasting, 1 / per_step))
        return Noise(stated, step, float(np.clip(held / per_step, 1.0, 10.0)))
    axes = are_read(recording.force_on_tool)
    force = recording.force_on_tool[:, axes]
    if free.sum() < 200 * per_step or not force.size:
        return Noise(stated, stated / np.sqrt(per_step), 1.0)
    steps = np.diff(force, axis=0)[free[1:] & free[:-1]]
    white = max(_robust_std(steps) / np.sqrt(2), 1e-4)
    left = force if read_n is None else force - read_n[:, axes]
    line = np.polyfit(recording.t[free], left[free], 1)
    left = left - (recording.t[:, None] * line[0] + line[1])
    stretches = [left[a:b] for a, b in runs(free)]

    def of_means(size: int) -> float:
        means = [x[: len(x) - len(x) % size].reshape(-1, size, x.shape[1]).mean(axis=1) for x in stretches]
        told = [means]
        if read_n is None:
            told.insert(0, [_beside_lines(each, _LINES * per_step // size) for each in means])
        for values in told:
            if sum(map(len, values)) > 20:
                return _robust_std(np.concatenate(values))
        return white / np.sqrt(size)

    step = max(of_means(per_step), white / np.sqrt(per_step))
    inflation = of_means(10 * per_step) ** 2 * 10 / step**2
    # a hand that accelerates a heavy tool is no noise: what exceeds these is left for the diagnosis to find
    step = min(step, _MOST_SLOW * white / np.sqrt(per_step))
    raw = np.sqrt(white**2 * (1 - 1 / per_step) + step**2)
    return Noise(float(raw), float(step), float(np.clip(inflation, 1.0, 10.0)))


def _beside_lines(means: np.ndarray, count: int) -> np.ndarray:
    """(k, c) what means (m, c) differ by from a line through each `count` of them, as loud as they are."""
    windows = means[: len(means) - len(means) % count].reshape(-1, count, means.shape[1])
    at = np.arange(count) - 0.5 * (count - 1)
    slope = np.einsum("n,wnc->wc", at, windows) / (at @ at)
    left = windows - windows.mean(axis=1, keepdims=True) - at[None, :, None] * slope[:, None]
    return left.reshape(-1, means.shape[1]) * np.sqrt(count / (count - 2))


def _held(recording: Recording) -> int:
    """Samples between two readings: 1, but for what was resampled to a faster clock."""
    about = recording.description.get("recording", {})
    read_hz = about.get("read_rate_hz") if isinstance(about, Mapping) else None
    return max(1, round(recording.sample_rate_hz / float(read_hz))) if read_hz else 1


def _robust_std(values: np.ndarray) -> float:
    return spread_about_zero(values - np.median(values, axis=0))


@dataclass(frozen=True)
class FoundPresses:
    """p presses that were found, in order of time. onset_s, peak_s: (p,) s of first touch and of the greatest
    force. centre, normal: (p, 3) m, the tip's centre and the outward normal at first touch.

    onset_error_m: (p,) standard errors; None: 0. until_s: (p,) s, when each stood above the noise last, where
    that is known. kinds: (p,), None: all "press"; a "cycle" or "points" has contact before and after and
    lasts until `until_s`, and no row beyond is its own.
    """

    onset_s: np.ndarray
    peak_s: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    onset_error_m: np.ndarray | None = None
    until_s: np.ndarray | None = None
    kinds: Sequence[str] | None = None


@dataclass(frozen=True)
class FoundAround:
    """What was found of a recording beside its presses. free_air: (n, 3) N, as late as the force; None: 0.
    followed: it goes after whatever the air reads, noise too, not only a level, a drift and a tool.
    trace_s: when the base was traced. others_s: further contacts, which are neither presses nor free air.
    supported: segments on the support. noise_n: N, of a sample; None: the stated or a usual one. delay_s: by
    which the force reads late, and its standard error."""

    free_air: np.ndarray | None = None
    followed: bool = False
    trace_s: tuple[float, float] | None = None
    others_s: Sequence[tuple[float, float]] = ()
    supported: Sequence[TimeSegment] = ()
    noise_n: float | None = None
    delay_s: float = 0.0
    delay_error_s: float = 0.0


def segment_recording(
    recording: Recording,
    found: FoundPresses,
    around: FoundAround = FoundAround(),
    *,
    site_m: float = SITE_M,
) -> Presses:
    """The table of a recording whose presses were found. site_m: presses further apart are no repeats."""
    free = np.zeros_like(recording.force_on_tool) if around.free_air is None else around.free_air
    noise = around.noise_n or recording.force_noise_std_n or USUAL_NOISE_N
    onset = np.asarray(found.onset_s, dtype=float)
    end = _ends(recording, found, free, noise, around.delay_s)
    count = len(onset)
    normal = np.asarray(found.normal, dtype=float).reshape(-1, 3)
    centre = np.asarray(found.centre, dtype=float).reshape(-1, 3)
    kinds = _kinds(found)
    t = recording.t
    pieces = []
    for i in range(count):
        margin = AROUND_S if kinds[i] == "press" else 0.0
        stop = min(end[i] + margin, onset[i + 1] if i + 1 < count else np.inf)
        pieces.append(np.arange(*np.searchsorted(t, [onset[i] - margin, stop])))
    rows = np.concatenate(pieces) if pieces else np.zeros(0, dtype=int)
    touches = np.array([*zip(onset, end, strict=True), *around.others_s]).reshape(-1, 2)
    begin = -np.inf if around.trace_s is None else around.trace_s[1] + SETTLED_S
    air = free_segments(t, touches[:, 0], touches[:, 1], begin)
    segments = [] if around.trace_s is None else [TimeSegment("trace", *map(float, around.trace_s))]
    segments += [TimeSegment(k, float(a), float(b)) for k, a, b in zip(kinds, onset, end, strict=True)]
    segments += [s for s in (*recording.segments, *around.supported) if s.kind in ON_SUPPORT]
    point = centre - recording.tip_radius_m * normal
    table = Presses(
        starts=np.concatenate([[0], np.cumsum([len(piece) for piece in pieces])]),
        t=t[rows],
        position=recording.position[rows],
        force=recording.force_on_tool[rows],
        free_air=free[rows],
        quaternion=None if recording.quaternion is None else recording.quaternion[rows],
        onset_s=onset,
        peak_s=found.peak_s,
        end_s=end,
        centre=centre,
        contact_normal=normal,
        onset_error_m=np.zeros(count) if found.onset_error_m is None else found.onset_error_m,
        point=point,
        normal=normal,
        depth_m=np.zeros(count),
        site=sites_of(point, normal, site_m),
        tip_radius_m=recording.tip_radius_m,
        sample_rate_hz=recording.sample_rate_hz,
        delay_s=around.delay_s,
        delay_error_s=around.delay_error_s,
        segments=(*segments, *air),
        recording=recording.content,
    )
    quiet = table.within("free", t)
    read_n = None if around.followed else free
    return dataclasses.replace(
        table, depth_m=table.greatest_depth(), noise=measured_noise(recording, quiet, read_n, noise)
    )


def _kinds(found: FoundPresses) -> list[str]:
    return ["press"] * len(found.onset_s) if found.kinds is None else list(found.kinds)


def _ends(
    recording: Recording, found: FoundPresses, free_air: np.ndarray, noise_n: float, delay_s: float
) -> np.ndarray:
    """(p,) s, when each press loses touch. free_air: (n, 3) N."""
    t, onset, until = recording.t, np.asarray(found.onset_s, dtype=float), found.until_s
    normal = np.asarray(found.normal, dtype=float).reshape(-1, 3)
    limits = np.append(onset[1:] - LEAD_S, t[-1])
    end = np.empty(len(onset))
    for i, kind in enumerate(_kinds(found)):
        if kind != "press":
            assert until is not None
            end[i] = until[i]
            continue
        if until is not None:
            limits[i] = min(limits[i], max(until[i], found.peak_s[i]) + delay_s + _MOST_AFTER_S)
        limits[i] = min(limits[i], _left(recording, found, i, limits[i]))
        near = slice(*np.searchsorted(t, [onset[i] - 0.2, max(limits[i], found.peak_s[i]) + 0.2]))
        end[i] = loss_of_touch(
            t[near], (recording.force_on_tool - free_air)[near] @ normal[i], recording.sample_rate_hz,
            onset_s=onset[i], peak_s=found.peak_s[i], limit_s=limits[i], noise_n=noise_n,
        )  # fmt: skip
    return end


def _left(recording: Recording, found: FoundPresses, i: int, limit_s: float) -> float:
    """s, when the tip has left press i after its greatest force, or the limit: a tool whose weight reads on
    would keep touching while the hand swings down beside the object, 26 mm deep by this place."""
    begin, stop = np.searchsorted(recording.t, [found.peak_s[i], limit_s])
    way = recording.position[begin:stop] - found.centre[i]
    up = way @ found.normal[i]
    aside = np.linalg.norm(way - up[:, None] * found.normal[i], axis=1)
    left = up > np.maximum(_LEFT_M, aside)
    return float(recording.t[begin + np.argmax(left)]) if left.any() else limit_s
