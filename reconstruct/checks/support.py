"""The traced base against the presses: one support, one object."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palpate.mechanics.statistics import spread_about_zero, weighted_median
from palpate.reconstruction.checks.finding import ALL_THE_SAME, OF_A_KNOWN_OBJECT, OF_A_SHAPE, Finding, Way
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s2_base import LEAN
from palpate.reconstruction.steps.s3_contacts.on_support import supported

_BELOW = 6.0
_SCALE = 1.35
_LEAST = 4
_CERTAIN = 4.0
_PRESS_S, _FEEBLE = 0.5, 0.2
"""A contact that stays below this share of the usual press's force in its first half second was none."""
_STEEP = 0.85
"""A wall's normal rises from the horizontal by less than this cosine."""


def support(measured: Measured) -> Iterator[Finding]:
    """A tip below the support; a base of another size than the walls that stand on it."""
    boundary = measured.boundary
    if not boundary.interval[1] > boundary.interval[0]:
        return
    yield from _beside(measured)
    yield from _below(measured)
    yield from _hollow(measured)
    yield from _size(measured)


def _without_base(measured: Measured) -> tuple[Way, ...]:
    """Ways to go on without the traced base."""
    walls = np.abs(measured.presses.contact_normal @ measured.boundary.support_normal) < _STEEP
    return (*(OF_A_KNOWN_OBJECT if walls.sum() < _LEAST else OF_A_SHAPE), ALL_THE_SAME)


def _beside(measured: Measured) -> Iterator[Finding]:
    """A stated tracing that nothing pushed sideways: one that is not stated is none (`ContactSpans.base`)."""
    why = measured.spans.beside_foot(measured.boundary) if measured.spans is not None else ""
    if not why:
        return
    t, (a, b) = measured.recording.t, measured.boundary.interval
    yield Finding(
        "beside the foot",
        why,
        "5 standard errors",
        LEAN,
        np.inf,
        np.inf,
        (float(t[a]), float(t[b - 1])),
        ("fx", "fy", "fz"),
        _without_base(measured),
    )


def _below(measured: Measured) -> Iterator[Finding]:
    recording, boundary = measured.recording, measured.boundary
    radius = recording.tip_radius_m
    height = boundary.height(measured.position) - radius
    height[: boundary.interval[1]] = 0.0
    least = max(_BELOW * boundary.flatness_m, 0.1 * radius, 10 * (recording.position_resolution_m or 0.0))
    # a tool that yields is pressed below what is rigid, and a base traced once more is where it has gone
    below = (height < -least) & ~supported(measured.presses, recording.t)
    if not below.any():
        return
    deepest = int(np.argmin(np.where(below, height, 0.0)))
    away = np.flatnonzero(~below)
    before, after = away[away < deepest], away[away > deepest]
    a = int(before[-1]) if len(before) else 0
    b = int(after[0]) if len(after) else len(below) - 1
    yield Finding(
        "below the support",
        f"the tip is {-1e3 * height[deepest]:.3g} mm below the support that was traced, at "
        f"{recording.t[deepest]:.1f} s; {100 * below.mean():.2g} % of the samples are",
        f"{-height[deepest] / max(boundary.flatness_m, 1e-6):.0f} times the trace's rms off its plane",
        "trace on the support that the object stands on, in one frame; do not move the device in between",
        np.inf,
        np.inf,
        (float(recording.t[a]), float(recording.t[b])),
        ("x", "y", "z"),
        _without_base(measured),
    )


def _hollow(measured: Measured) -> Iterator[Finding]:
    """A tip goes round a base on a wider path than itself: what it goes round has a size."""
    boundary, radius = measured.boundary, measured.recording.tip_radius_m
    path = boundary.centres - boundary.centres.mean(axis=0)
    reach = float(np.median(np.linalg.norm(path, axis=1)))
    if reach > 1.2 * radius:
        return
    t, (a, b) = measured.recording.t, boundary.interval
    yield Finding(
        "tip radius",
        f"the tip went round the base on a path of radius {reach * 1e3:.3g} mm, and its own radius is "
        f"{radius * 1e3:.3g} mm: nothing is left for the object",
        f"ratio {reach / radius:.2f}; it is above 1.2 for anything that can be pressed",
        "state [tool] tip_radius_m in metres, and check the positions' unit",
        np.inf,
        np.inf,
        (float(t[a]), float(t[b - 1])),
        ("x", "y", "z"),
        _without_base(measured),
    )


def _size(measured: Measured) -> Iterator[Finding]:
    """The base ends no farther in than what bulges over it, and no farther out than walls lead along their
    slope: where a wall is upright the two are one."""
    boundary, presses = measured.boundary, measured.presses
    up = boundary.support_normal
    rise = presses.contact_normal @ up
    height = boundary.height(presses.point)
    wall = (np.abs(rise) < _STEEP) & (height > 0)
    if wall.sum() < _LEAST:
        return
    middle = boundary.outline.mean(axis=0)
    rim = boundary.outline - middle
    extent = np.linalg.norm(rim, axis=1)
    along = presses.contact_normal[wall] - rise[wall, None] * up
    flat = np.linalg.norm(along, axis=1)
    along /= flat[:, None]

    def over(place: np.ndarray) -> np.ndarray:
        """(n,) log of how far out places (n, 3) are, over the traced base in their direction."""
        place = place - middle
        place = place - (place @ up)[:, None] * up
        reach = np.maximum(np.linalg.norm(place, axis=1), 1e-6)
        nearest = np.argmax((place / reach[:, None]) @ (rim / extent[:, None]).T, axis=1)
        return np.log(reach / np.maximum(extent[nearest], 1e-6))

    # the wall's tangent, followed down by the height: outwards where the wall leans in
    here = over(presses.point[wall])
    foot = over(presses.point[wall] + (height[wall] * rise[wall] / flat)[:, None] * along)
    least, most = np.minimum(here, foot), np.maximum(here, foot)
    ratio = np.where(least > 0, least, np.minimum(most, 0.0))
    # the lower a press, the better it tells
    weight = 1 / (0.05 + (height[wall] / np.median(extent)) ** 2)
    centre = weighted_median(ratio, weight)
    error = 1.25 * max(spread_about_zero(ratio - centre), 0.05) / np.sqrt(wall.sum())
    if abs(centre) < np.log(_SCALE) + _CERTAIN * error:
        return
    t, (a, b) = measured.recording.t, boundary.interval
    yield Finding(
        "base size",
        f"the walls that were pressed stand {np.exp(centre):.2f} times as far out as the traced base",
        f"{abs(centre) / error:.0f} standard errors, {wall.sum()} presses on walls",
        "trace the base of the same object in the same units, or give [object] model instead of the trace",
        np.inf,
        float(min(0.5 * (centre / error) ** 2 / np.log(10), 300)),
        (float(t[a]), float(t[b - 1])),
        ("x", "y", "z"),
        _without_base(measured),
    )


def dropped(measured: Measured) -> Iterator[Finding]:
    """Contacts that were not used, and why, where they are many."""
    used, lost = len(measured.presses), measured.rejected
    # what is over in an instant was never meant as a press
    lost = tuple((t, why) for t, why in lost if not why.startswith("lasts only"))
    t, size = measured.recording.t, np.linalg.norm(measured.force, axis=1)

    def peak(start: float) -> float:
        return float(size[slice(*np.searchsorted(t, [start, start + _PRESS_S]))].max(initial=0.0))

    least = _FEEBLE * float(np.median([peak(at) for at in measured.presses.onset_s]))
    lost = tuple((at, why) for at, why in lost if peak(at) > least)
    if len(lost) < 3 or len(lost) < 0.25 * (used + len(lost)):
        return
    why = [_kind(reason) for _, reason in lost]
    most = max(set(why), key=why.count)
    share = len(lost) / (used + len(lost))
    first = next(t for (t, _), kind in zip(lost, why, strict=True) if kind == most)
    yield Finding(
        "presses dropped",
        f"{len(lost)} of {used + len(lost)} contacts were not used, {why.count(most)} as one "
        f"{most} (the first at {first:.1f} s)",
        f"{100 * share:.0f} %; up to 25 % is usual",
        "press longer, harder and from the air; look at the named ones",
        float(0.05 + 0.1 * share),
        np.inf,
        (max(first - 0.5, float(measured.recording.t[0])), first + 1.0),
        ("fx", "fy", "fz"),
    )


def _kind(reason: str) -> str:
    """A reason without its figures."""
    words = reason.split("(")[0].split(",")[0].split()
    return "that " + " ".join(w for w in words if not any(c.isdigit() for c in w)).removesuffix(" ms")
