"""What the force reads in free air, and how late it reads, where reconstruction cannot take it off."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palpate.reconstruction.checks.finding import Finding
from palpate.reconstruction.checks.samples import Samples
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s1_filter.noise import noise_gain
from palpate.reconstruction.steps.s1_filter.signals import read_rate_hz

_SEEN, _LOST, _LOUD = 0.05, 0.1, 15.0
_LATE_S, _LATEST_S = 0.075, 0.25
"""A force that reads later than the first is reported, one later than the second is not corrected: presses
keep 0.3 s of samples around them."""
_BETWEEN, _LITTLE = 0.14, 0.005
"""Standard error of the modulus times readings on the way in: half of what lines and cubics between them
differ by (4.6 % at six); less than the second is not worth a word."""
_CERTAIN = 5.0
_ALIKE_S = 0.01
"""Touches that disagree by more about the delay are none, or drags."""


def air(data: Samples) -> Iterator[Finding]:
    """What is left in free air, weight, inertia and steady drift taken off, against the presses."""
    pushes = np.linalg.norm(data.touches.push, axis=1)
    peak = float(np.median(pushes)) if len(pushes) else float(np.percentile(data.size, 99))
    white = data.noise_n * noise_gain(data.rate_hz, data.cutoff_hz)
    if data.filtered.followed:
        yield _followed(data, peak)
        return
    # a fifth of the samples at least is of a tip in the air, whatever the rest is
    wander = float(np.percentile(data.size, 20))
    share, loud = wander / max(peak, 1e-9), wander / white
    if share < _SEEN or loud < _LOUD:
        return
    yield Finding(
        "drift",
        f"with weight, inertia and a steady drift taken off, the force is above {wander:.2g} N in four "
        f"fifths of the samples, {100 * share:.0f} % of what a press peaks at ({peak:.2g} N)",
        f"{loud:.0f} times what its white noise makes of it; up to {_LOUD:g} is usual",
        "let the sensor warm up, lift the tip for a second between presses, log the tool's orientation",
        float(share) if share < _LOST else np.inf,
        np.inf,
        (float(data.recording.t[0]), float(data.recording.t[-1])),
        ("fx", "fy", "fz"),
    )


def slow(measured: Measured) -> Iterator[Finding]:
    """A force that is read so slowly that what it did between two readings is part of the modulus."""
    read_hz, presses = read_rate_hz(measured.recording), measured.presses
    if not read_hz < measured.recording.sample_rate_hz:
        return
    readings = float(np.median((presses.peak_s - presses.onset_s) * read_hz))
    error = _BETWEEN / max(readings, 1.0)
    if error < _LITTLE:
        return
    yield Finding(
        "slow readings",
        f"the force is read at {read_hz:.3g} Hz, {readings:.2g} times from first touch to peak",
        f"what it did between is known to {100 * error:.2g} % of the modulus, which its interval holds",
        "read the force more often, or press slower",
        error,
        np.inf,
    )


def sloping(measured: Measured) -> Iterator[Finding]:
    """Free air that slopes with the travel, which was taken off, with what it is known by in the interval."""
    slope, presses = measured.air_slope, measured.presses
    if slope is None:
        return
    peak = float(np.median([presses.push[part].max() for part in presses.parts]))
    deep = float(np.median(presses.depth_m))
    yield Finding(
        "sloping free air",
        f"before and after touch the force changes by {slope.n_per_m:.3g} N a metre of travel, "
        f"{100 * abs(slope.n_per_m) * deep / peak:.2g} % of a press's peak over its depth; it is taken off",
        f"known to {slope.error_n_per_m:.2g} N/m, alike on the way in and out",
        "free the cable, or the spring beside the tip",
        slope.error_n_per_m * deep / peak,
        np.inf,
    )


def _followed(data: Samples, peak: float) -> Finding:
    """What no constant, drift and weight explain, and how far the line through a touch may miss it."""
    filtered = data.filtered
    wander = float(np.linalg.norm(filtered.free_air.std(axis=0)))
    miss = float(filtered.spread.min())
    return Finding(
        "drift",
        f"in the air the force wanders by {wander:.2g} N rms, as the weight of a tool does whose "
        "rotation is not logged; it is followed from one touch to the next",
        f"over a touch to within {miss:.2g} N an axis, {100 * miss / peak:.0f} % of what a press peaks at",
        "log the tool's orientation, let the sensor warm up",
        miss / max(peak, 1e-9),
        np.inf,
        (float(data.recording.t[0]), float(data.recording.t[-1])),
        ("fx", "fy", "fz"),
    )


def delay(data: Samples) -> Iterator[Finding]:
    """A force that reads so late or early that there are two clocks; grave beyond what can be corrected."""
    late, error = abs(data.late.seconds), data.late.error_s
    if error > _ALIKE_S or late < _LATE_S + _CERTAIN * error:
        return
    a, b = data.spans[len(data.spans) // 2]
    room = round(late * data.rate_hz)
    touches = data.touches
    rise_s = float(np.median(touches.peak - touches.start)) / data.rate_hz
    way, mended = "late" if data.late.seconds > 0 else "early", late < _LATEST_S
    yield Finding(
        "delay",
        f"the force reads {late * 1e3:.0f} +- {error * 1e3:.0f} ms {way}; "
        + ("that is corrected" if mended else f"up to {_LATEST_S * 1e3:.0f} ms is corrected"),
        f"{late / error:.0f} standard errors, {data.late.presses} touches that pass one place twice",
        "log position and force by one clock, or shift the force's times",
        1.5 * error / max(rise_s, error) if mended else np.inf,
        float(min(0.5 * (late / error) ** 2 / np.log(10), 300)),
        (
            float(data.recording.t[max(a - room, 0)]),
            float(data.recording.t[min(b + room, len(data.t)) - 1]),
        ),
        ("fx", "fy", "fz"),
    )
