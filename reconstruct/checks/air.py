"""What the force reads in free air, and how late it reads, where reconstruction cannot take it off."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from reconstruct.checks.base import Finding
from reconstruct.checks.sight import Sight

_STEADY = 0.35
_LATE_S = 0.075
"""A force that reads later than this is not corrected reliably (reconstruct.delay)."""
_CERTAIN = 5.0
_ALIKE_S = 0.01
"""Touches that disagree by more about the delay are none, or drags."""


def air(sight: Sight) -> Iterator[Finding]:
    """A reading in free air that does not stand still long enough to be taken off."""
    if sight.steady > _STEADY or not len(sight.t) > 8 * sight.rate_hz:
        return
    size = max(1, round(sight.rate_hz))
    means = sight.force[: len(sight.force) // size * size].reshape(-1, size, 3).mean(axis=1)
    step = float(np.median(np.linalg.norm(np.diff(means, axis=0), axis=1)))
    yield Finding(
        "drift",
        f"the force has no steady reading in free air: only {100 * sight.steady:.0f} % of the stretches of "
        f"8 s have one within {5 * sight.spread_n:.2g} N; its mean over a second changes by {step:.2g} N to "
        "the next",
        f"{step / sight.spread_n:.0f} standard deviations of the filtered force; above {100 * _STEADY:.0f} % "
        "of the stretches is usual",
        "let the sensor warm up, lift the tip for a second between presses, log the tool's orientation",
        np.inf,
        np.inf,
        (float(sight.recording.t[0]), float(sight.recording.t[-1])),
        ("fx", "fy", "fz"),
    )


def delay(sight: Sight) -> Iterator[Finding]:
    """A force that reads later (or earlier) than reconstruction can correct."""
    late, error = sight.lag_s
    if error > _ALIKE_S or abs(late) < _LATE_S + _CERTAIN * error:
        return
    a, b = sight.spans[len(sight.spans) // 2]
    room = round(abs(late) * sight.rate_hz)
    yield Finding(
        "delay",
        f"the force reads {abs(late) * 1e3:.0f} +- {error * 1e3:.0f} ms {'late' if late > 0 else 'early'}; "
        f"up to {_LATE_S * 1e3:.0f} ms is corrected",
        f"{abs(late) / error:.0f} standard errors, {len(sight.lags)} touches that pass one place twice",
        "log position and force by one clock, or shift the force's times",
        np.inf,
        float(min(0.5 * (late / error) ** 2 / np.log(10), 300)),
        (
            float(sight.recording.t[max(a - room, 0)]),
            float(sight.recording.t[min(b + room, len(sight.t)) - 1]),
        ),
        ("fx", "fy", "fz"),
    )
