"""The presses of a recording, once they are found, cut out of it: loss of touch, free air, noise."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from mechanics.press_sites import SITE_M, sites_of
from mechanics.presses import LEAD_S, STEP_S, USUAL_NOISE_N, Noise, Presses
from mechanics.recording import Recording
from mechanics.robust import read_columns, spread_about_zero
from mechanics.samples import runs
from mechanics.segments import ON_SUPPORT, Segment

AROUND_S = 0.3
"""Samples are kept this long before first and after last touch."""
CLEAR_S = 0.15
"""Free air keeps this far from any touch."""
SETTLED_S = 0.5
"""Free air begins this long after the base was traced."""
_SMOOTH_S = 0.015
_LET_GO = 0.02
_MOST_AFTER_S = 0.1
"""A touch is lost so soon after it no longer stands above the noise, or then."""


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
) -> tuple[Segment, ...]:
    """Stretches of free air between the touches (onset_s, end_s), CLEAR_S away from each, after begin_s."""
    free = t > begin_s
    for onset, end in zip(onset_s, end_s, strict=True):
        free &= (t < onset - CLEAR_S) | (t > end + CLEAR_S)
    return tuple(Segment("free", float(t[a]), float(t[b - 1])) for a, b in runs(free) if b > a + 1)


def measured_noise(recording: Recording, free: np.ndarray, usual_n: float = USUAL_NOISE_N) -> Noise:
    """The noise in free air, (n,) bool; the stated (or the usual) value, white, where there is too little.

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
    force = read_columns(recording.force_on_tool)
    if free.sum() < 200 * per_step or not force.size:
        return Noise(stated, stated / np.sqrt(per_step), 1.0)
    steps = np.diff(force, axis=0)[free[1:] & free[:-1]]
    white = max(_robust_std(steps) / np.sqrt(2), 1e-4)
    line = np.polyfit(recording.t[free], force[free], 1)
    left = force - (recording.t[:, None] * line[0] + line[1])
    stretches = runs(free)

    def of_means(size: int) -> float:
        means = [left[k : k + size].mean(axis=0) for a, b in stretches for k in range(a, b - size + 1, size)]
        return _robust_std(np.array(means)) if len(means) > 20 else white / np.sqrt(size)

    step = max(of_means(per_step), white / np.sqrt(per_step))
    inflation = of_means(10 * per_step) ** 2 * 10 / step**2
    # a hand that accelerates a heavy tool is no noise: what exceeds these is left for the diagnosis to find
    step = min(step, 2.2 * white / np.sqrt(per_step))
    raw = np.sqrt(white**2 * (1 - 1 / per_step) + step**2)
    return Noise(float(raw), float(step), float(np.clip(inflation, 1.0, 10.0)))


def _held(recording: Recording) -> int:
    """Samples between two readings: 1, but for what was resampled to a faster clock."""
    about = recording.description.get("recording", {})
    read_hz = about.get("read_rate_hz") if isinstance(about, Mapping) else None
    return max(1, round(recording.sample_rate_hz / float(read_hz))) if read_hz else 1


def _robust_std(values: np.ndarray) -> float:
    return spread_about_zero(values - np.median(values, axis=0))


def cut(
    recording: Recording,
    *,
    onset_s: np.ndarray,
    peak_s: np.ndarray,
    centre: np.ndarray,
    normal: np.ndarray,
    onset_error_m: np.ndarray | None = None,
    free_air: np.ndarray | None = None,
    trace_s: tuple[float, float] | None = None,
    others_s: Iterable[tuple[float, float]] = (),
    supported: Iterable[Segment] = (),
    noise_n: float | None = None,
    delay_s: float = 0.0,
    delay_error_s: float = 0.0,
    site_m: float = SITE_M,
    kinds: Sequence[str] | None = None,
    until_s: np.ndarray | None = None,
) -> Presses:
    """The table of a recording whose presses were found: first touches onset_s (p,) and greatest forces
    peak_s (p,) s, in order, the tip's centre (p, 3) m and the outward normal (p, 3) at first touch.

    onset_error_m: (p,) standard errors. free_air: (n, 3) N, as late as the force. trace_s: when the base was
    traced. others_s: further contacts, which are neither presses nor free air. noise_n: N, of a sample; None:
    the stated or a usual one. until_s: (p,) s, when each stood above the noise last, where that is known.
    kinds: (p,) of the presses; a "cycle" or "points" has contact before and after and lasts until then, and
    no row beyond is its own.
    """
    t, count = recording.t, len(onset_s)
    normal = np.asarray(normal, dtype=float).reshape(-1, 3)
    centre = np.asarray(centre, dtype=float).reshape(-1, 3)
    free = np.zeros_like(recording.force_on_tool) if free_air is None else free_air
    noise = noise_n or recording.force_noise_std_n or USUAL_NOISE_N
    limits = np.append(np.asarray(onset_s)[1:] - LEAD_S, t[-1])
    onset, end = np.asarray(onset_s, dtype=float), np.empty(count)
    kinds = ["press"] * count if kinds is None else list(kinds)
    for i in range(count):
        if kinds[i] != "press":
            assert until_s is not None
            end[i] = until_s[i]
            continue
        if until_s is not None:
            limits[i] = min(limits[i], max(until_s[i], peak_s[i]) + delay_s + _MOST_AFTER_S)
        near = slice(*np.searchsorted(t, [onset[i] - 0.2, max(limits[i], peak_s[i]) + 0.2]))
        end[i] = loss_of_touch(
            t[near], (recording.force_on_tool - free)[near] @ normal[i], recording.sample_rate_hz,
            onset_s=onset[i], peak_s=peak_s[i], limit_s=limits[i], noise_n=noise,
        )  # fmt: skip
    pieces = []
    for i in range(count):
        around = AROUND_S if kinds[i] == "press" else 0.0
        stop = min(end[i] + around, onset[i + 1] if i + 1 < count else np.inf)
        pieces.append(np.arange(*np.searchsorted(t, [onset[i] - around, stop])))
    rows = np.concatenate(pieces) if pieces else np.zeros(0, dtype=int)
    touches = np.array([*zip(onset, end, strict=True), *others_s]).reshape(-1, 2)
    begin = -np.inf if trace_s is None else trace_s[1] + SETTLED_S
    air = free_segments(t, touches[:, 0], touches[:, 1], begin)
    segments = [] if trace_s is None else [Segment("trace", *map(float, trace_s))]
    segments += [Segment(k, float(a), float(b)) for k, a, b in zip(kinds, onset, end, strict=True)]
    segments += [s for s in (*recording.segments, *supported) if s.kind in ON_SUPPORT]
    point = centre - recording.tip_radius_m * normal
    table = Presses(
        starts=np.concatenate([[0], np.cumsum([len(piece) for piece in pieces])]),
        t=t[rows],
        position=recording.position[rows],
        force=recording.force_on_tool[rows],
        free_air=free[rows],
        quaternion=None if recording.quaternion is None else recording.quaternion[rows],
        onset_s=onset,
        peak_s=peak_s,
        end_s=end,
        centre=centre,
        contact_normal=normal,
        onset_error_m=np.zeros(count) if onset_error_m is None else onset_error_m,
        point=point,
        normal=normal,
        depth_m=np.zeros(count),
        site=sites_of(point, normal, site_m),
        tip_radius_m=recording.tip_radius_m,
        sample_rate_hz=recording.sample_rate_hz,
        delay_s=delay_s,
        delay_error_s=delay_error_s,
        segments=(*segments, *air),
        recording=recording.content,
    )
    quiet = table.within("free", t)
    return dataclasses.replace(
        table, depth_m=table.greatest_depth(), noise=measured_noise(recording, quiet, noise)
    )
