"""Free air that slopes with the travel: what a cable or a spring beside the tip reads before anything is
touched, and goes on to read in contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.statistics import spread_about_zero
from palpate.reconstruction.steps.s1_filter.signals import Filtered, filtered_of, read_rate_hz
from palpate.reconstruction.steps.s3_contacts.single_press import FoundPress

_LEAST, _READINGS = 4, 4
"""Stretches of free air either way, and readings in each."""
_SURE, _REACH = 6.0, 0.1
"""Standard errors that the slope is from zero, half of what the ways in and out differ by among them; tip's
radii that a stretch reaches over at least."""
_NEAR = 0.2
"""Share of a stretch next to the touch that is left out: the low-pass smears the touch, and it may pull."""
_PARALLEL = np.cos(np.radians(10.0))


@dataclass(frozen=True)
class AirSlope:
    """The force along `normal` falls by so many newtons a metre of travel out of the object; error: standard
    error, N/m."""

    n_per_m: float
    error_n_per_m: float
    normal: np.ndarray

    def force(self, position: np.ndarray) -> np.ndarray:
        """(n, 3) N that it reads at tip positions (n, 3) m; its level is free air's."""
        height = position @ self.normal
        return -self.n_per_m * np.outer(height - np.median(height), self.normal)


def air_slope(filtered: Filtered, touches: Sequence[FoundPress]) -> AirSlope | None:
    """What all approaches and all retracts agree in; None where they show no slope, or presses are not
    parallel."""
    normals = np.array([touch.normal for touch in touches])
    if len(touches) < _LEAST:
        return None
    up = normals.mean(axis=0) / np.linalg.norm(normals.mean(axis=0))
    if (normals @ up).min() < _PARALLEL:
        return None
    recording, signals = filtered.signals.recording, filtered.signals
    height, push = signals.position @ up, signals.force @ up
    least = _READINGS * recording.sample_rate_hz / read_rate_hz(recording)
    ways: tuple[list[float], list[float]] = ([], [])
    between = zip([0, *(t.end for t in touches)], [*(t.start for t in touches), len(height)], strict=True)
    for a, b in between:
        top = a + int(np.argmax(height[a:b])) if b > a else a
        for way, rows in zip(ways, (np.arange(a, top), np.arange(top, b)), strict=True):
            if len(rows) < least:
                continue
            low, reach = height[rows].min(), float(np.ptp(height[rows]))
            rows = rows[height[rows] > low + _NEAR * reach]
            if len(rows) >= least and reach > _REACH * recording.tip_radius_m:
                way.append(-float(np.polyfit(height[rows], push[rows], 1)[0]))
    if min(map(len, ways)) < _LEAST:
        return None
    (out, into), every = (float(np.median(way)) for way in ways), np.concatenate(ways)
    slope = 0.5 * (out + into)
    error = max(float(spread_about_zero(every - slope)) / np.sqrt(len(every)), 0.5 * abs(out - into))
    return AirSlope(slope, error, up) if abs(slope) > _SURE * error else None


def without_air_slope(recording: Recording, slope: AirSlope, cutoff_hz: float) -> Filtered:
    """The recording low-passed, with the slope among what it reads in free air."""
    sloping = slope.force(recording.position)
    level = replace(recording, force_on_tool=recording.force_on_tool - sloping)
    found = filtered_of(level, cutoff_hz)
    return replace(
        found, free_air=found.free_air + sloping, signals=replace(found.signals, recording=recording)
    )
