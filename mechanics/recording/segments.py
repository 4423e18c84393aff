"""Stretches of a recording and their kinds: what was done when; runs of samples, series that read late."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

KINDS = ("trace", "press", "free", "rigid", "retrace", "slide", "cycle", "points")
"""Kinds of segments: the base's outline, a press, free air, presses on something rigid, the outline once
more, sliding over a surface, a press cut out of a contact that never breaks, quasi-static points of one
place."""
STATED = KINDS[:5]
"""What a recording's TOML may say of a stretch ([[segment]])."""
ON_SUPPORT = ("rigid", "retrace")
"""Kinds of which every contact is with the support, not with the object."""


@dataclass(frozen=True)
class TimeSegment:
    """A stretch of the recording: its kind, one of KINDS, and when it lasts, s."""

    kind: str
    start_s: float
    end_s: float


def within(segments: Iterable[TimeSegment], kind: str, t: np.ndarray) -> np.ndarray:
    """(n,) bool for each time (n,) s: whether it lies in a segment of that kind."""
    inside = np.zeros(len(t), dtype=bool)
    for segment in segments:
        if segment.kind == kind:
            inside |= (t >= segment.start_s) & (t <= segment.end_s)
    return inside


def runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """[start, end) of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def delayed(parts: Iterable[slice], t: np.ndarray, values: np.ndarray, delay_s: float) -> np.ndarray:
    """(n, 3), values (n, 3) at times t (n,) s as they read `delay_s` late (negative: earlier).

    parts: stretches that know nothing of one another; the ends of each are held.
    """
    if delay_s == 0:
        return values
    out = np.empty_like(values)
    for part in parts:
        for axis in range(3):
            out[part, axis] = np.interp(t[part] - delay_s, t[part], values[part, axis])
    return out
