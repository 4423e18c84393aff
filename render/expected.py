"""A force response beside a stored one: pressed alike or not, and by how much the forces differ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.render.press import Curve

SHARE = 0.02
"""Of the stored curve's greatest force, by which forces may differ where nothing else is stated; of its
depth, speed and ways, by which paths may."""
TURNED_DEG = 0.5


def greatest_difference(curve: Curve, expected: Curve) -> tuple[float, float]:
    """(N, s): the longest difference of the force vectors, and when; the expected curve is read at curve.t.

    Where one lasts longer than the other, the rest counts in full against zero force.
    """
    t = np.union1d(curve.t, expected.t)

    def at(c: Curve) -> np.ndarray:
        return np.column_stack([np.interp(t, c.t, f, left=0.0, right=0.0) for f in c.force.T])

    difference = np.linalg.norm(at(curve) - at(expected), axis=1)
    worst = int(np.argmax(difference))
    return float(difference[worst]), float(t[worst])


@dataclass(frozen=True)
class _Press:
    """A press: deepest (3,) m, of the tip's centre; direction (3,) from the start to it."""

    deepest: np.ndarray
    direction: np.ndarray
    depth_m: float
    approach_m: float
    speed_m_per_s: float
    hold_s: float
    step_s: float


def _way(curve: Curve) -> _Press:
    steps_s = np.diff(curve.t)
    lengths = np.linalg.norm(np.diff(curve.position, axis=0), axis=1)
    moving = lengths > 0
    speed = float(np.median(lengths[moving] / steps_s[moving])) if moving.any() else 0.0
    deepest = curve.position[curve.deepest]
    line = deepest - curve.position[0]
    held = np.flatnonzero(curve.depth >= curve.depth.max() * (1 - 1e-9))
    before = curve.position[: max(int(np.argmax(curve.depth > 0)), 1)]
    return _Press(
        deepest,
        line / max(float(np.linalg.norm(line)), 1e-12),
        float(curve.depth.max()),
        float(np.linalg.norm(before[-1] - before[0])),
        speed,
        float(curve.t[held[-1]] - curve.t[held[0]]),
        float(np.median(steps_s)) if len(steps_s) else 0.0,
    )


def path_differences(curve: Curve, expected: Curve) -> list[str]:
    """In what the stored press differs from this one, in words; [] where they are the same.

    Compared are the line, and depth, approach, speed and hold along it. Where along the line the object is
    met is its answer, and may have changed.
    """
    own, stored = _way(curve), _way(expected)
    aside = stored.deepest - own.deepest
    aside_m = float(np.linalg.norm(aside - (aside @ own.direction) * own.direction))
    turned = float(np.degrees(np.arccos(np.clip(own.direction @ stored.direction, -1.0, 1.0))))
    found = []
    if aside_m > SHARE * own.depth_m:
        found.append(f"it went in {1e3 * aside_m:.3g} mm aside")
    if turned > TURNED_DEG:
        found.append(f"its direction is turned by {turned:.3g} degrees")
    step_s = 2 * max(own.step_s, stored.step_s)
    step_m = step_s * max(own.speed_m_per_s, stored.speed_m_per_s)
    for name, here, there, sample, scale, unit in (
        ("depth", own.depth_m, stored.depth_m, step_m, 1e3, "mm"),
        ("free air before it", own.approach_m, stored.approach_m, step_m, 1e3, "mm"),
        ("speed", own.speed_m_per_s, stored.speed_m_per_s, 0.0, 1e3, "mm/s"),
        ("time at depth", own.hold_s, stored.hold_s, step_s, 1.0, "s"),
    ):
        if abs(here - there) > SHARE * here + sample:
            found.append(f"its {name} is {scale * there:.3g} {unit}, not {scale * here:.3g}")
    return found
