"""One test of the clock: the times of the samples against an even grid and against the stated rate."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palpate.mechanics.recording.segments import runs
from palpate.reconstruction.checks.finding import ALL_THE_SAME, Finding, Way
from palpate.reconstruction.checks.samples import Samples

_TOLD = 0.02
_GAP, _GAP_S, _PAUSE_S = 5.0, 0.05, 1.0
_SPAN_S = 0.1
_PHASE_RAD = 0.25
_RISE_SAMPLES = (8, 20)
"""Samples from first touch to the peak: fewer than the first and nothing can be fitted to a rise, than the
second and the first touch is coarse."""


def clock(data: Samples) -> Iterator[Finding]:
    """Rate, gaps, jitter, and how many samples a touch has."""
    yield from _rate(data)
    yield from _gaps(data)
    yield from _jitter(data)
    yield from _coarse(data)


def _rate(data: Samples) -> Iterator[Finding]:
    stated, own = data.recording.sample_rate_hz, data.rate_hz
    off = abs(np.log(stated / own))
    if off < _TOLD or abs(np.log(stated * np.mean(np.diff(data.times)))) < _TOLD:
        return
    dt = np.diff(data.times)
    agree = float(np.mean(np.abs(np.log(dt * stated)) < _TOLD))
    if agree > 0.5:
        return
    yield Finding(
        "rate",
        f"sample_rate_hz is {stated:g}, but the samples are {1e3 / own:.4g} ms apart ({own:.4g} Hz)",
        f"{100 * agree:.2g} % of {len(dt)} intervals agree with the stated rate",
        f"state sample_rate_hz = {own:.4g}, or correct t",
        float(off),
        np.inf,
        (float(data.recording.t[0]), float(data.recording.t[-1])),
        ("t",),
        (Way("read it by its own times", {"rate_hz": float(f"{own:.4g}")}), ALL_THE_SAME),
    )


def _gaps(data: Samples) -> Iterator[Finding]:
    dt = np.diff(data.times)
    typical = 1.0 / data.rate_hz
    wide = np.flatnonzero(dt > max(_GAP * typical, _GAP_S))
    if not len(wide):
        return
    longest = int(wide[np.argmax(dt[wide])])
    missing = dt[wide] - typical
    lost, span = float(missing.sum()), float(typical * len(dt))
    inside = np.array([any(a - 2 <= i <= b + 1 for a, b in data.spans) for i in wide])
    touched = sum(b - a for a, b in data.spans) * typical
    # a gap matters by the touches that it cuts, and by its length where it is no pause of a moment
    share = max(
        lost / (span + lost) if lost > _PAUSE_S else 0.0, float(missing[inside].sum()) / max(touched, typical)
    )
    if share < 0.05:
        return
    at = data.recording.t[longest], data.recording.t[longest + 1]
    many = "a gap" if len(wide) == 1 else f"{len(wide)} gaps"
    yield Finding(
        "gap",
        f"{many} in time, {lost:.3g} s without samples of {span + lost:.3g} s, the longest "
        f"{dt[longest]:.3g} s after {data.t[longest]:.2f} s; {inside.sum()} within touches",
        f"{dt[longest] / typical:.3g} times the usual interval",
        "record again, or cut the recording at the gap",
        float(share),
        np.inf,
        (float(at[0]), float(at[1])),
        ("t",),
    )


def _jitter(data: Samples) -> Iterator[Finding]:
    """Times within stretches of 0.1 s against their straight line: what a filter takes for even."""
    dt = np.diff(data.times)
    size = max(4, round(_SPAN_S * data.rate_hz))
    whole = [(a, b) for a, b in runs(dt < max(_GAP / data.rate_hz, _GAP_S)) if b - a >= size]
    off = []
    for a, b in whole:
        rows = a + np.arange((b - a) // size * size).reshape(-1, size)
        t, index = data.times[rows], np.arange(size) - (size - 1) / 2
        t = t - t.mean(axis=1, keepdims=True)
        slope = t @ index / (index @ index)
        off.append((t - slope[:, None] * index).ravel())
    if not off:
        return
    stray = float(np.sqrt(np.mean(np.concatenate(off) ** 2)))
    phase = 2 * np.pi * data.cutoff_hz * stray
    if phase < _PHASE_RAD:
        return
    worst = int(np.argmax(np.abs(dt - np.median(dt))))
    middle = float(data.recording.t[worst])
    yield Finding(
        "jitter",
        f"the times of samples stray by {1e3 * stray:.3g} ms (rms) from an even grid of "
        f"{1e3 / data.rate_hz:.3g} ms",
        f"{phase:.2f} rad at the filter's {data.cutoff_hz:g} Hz; up to {_PHASE_RAD} is harmless",
        "resample to an even grid by the true times, or log the device's own clock",
        float(phase / 4),
        np.inf,
        (middle - 10 / data.rate_hz, middle + 10 / data.rate_hz),
        ("t",),
        (
            Way("bring it to an even grid by its times", {"rate_hz": float(f"{data.rate_hz:.4g}")}),
            ALL_THE_SAME,
        ),
    )


def _coarse(data: Samples) -> Iterator[Finding]:
    few, enough = _RISE_SAMPLES
    if data.rate_hz > 2 * data.cutoff_hz / 0.45 and len(data.t) > 1000:
        return
    rise = np.array([int(np.argmax(data.size[a:b])) for a, b in data.spans])
    samples = float(np.median(rise)) if len(rise) else 0.0
    if samples >= enough and data.rate_hz > data.cutoff_hz / 0.45:
        return
    t, middle = data.recording.t, data.spans[len(rise) // 2] if len(rise) else None
    yield Finding(
        "slow",
        f"{data.rate_hz:.3g} Hz: {len(data.t)} samples in all, {samples:.0f} from first touch to the peak",
        f"a rise needs {enough}; below {few} its first touch cannot be fitted; the filter needs "
        f"{data.cutoff_hz / 0.45:.0f} Hz",
        "record at 300 Hz or more",
        float("inf") if samples < few else float(0.2 * few / samples),
        np.inf,
        None if middle is None else (float(t[middle[0]]), float(t[middle[1]])),
        ("t",),
    )
