"""Contacts with the bare support after the base was traced: no palpations, but readings of the instrument."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import ON_SUPPORT
from palpate.reconstruction.steps.s1_filter.signals import Signals
from palpate.reconstruction.steps.s2_base import Boundary

_SLID = 2.0
"""Tip radii: what stays within is pressed, what goes farther slides."""
_ALONG = 0.8
"""Share of its force that a press on the support has along its normal: the object's foot pushes sideways."""
_NEAR_S = 0.2
_BINS, _ROUND = 36, 0.9
"""Directions around the base, and the share of them that a tracing has to pass."""


def stated(recording: Recording, a: int, b: int) -> str:
    """Why the contact of samples [a, b), stated to be with the support, is no palpation; '' elsewhere."""
    middle = float(recording.t[(a + b - 1) // 2])
    for each in recording.segments:
        if each.kind in ON_SUPPORT and each.start_s <= middle <= each.end_s:
            return f"is stated to be {each.kind}"
    return ""


def on_it(path: np.ndarray, boundary: Boundary, tip_radius_m: float) -> str:
    """Why a contact whose tip comes down to the support on its path (n, 3) m is no palpation; else ''."""
    gap = float(boundary.height(path).min()) - tip_radius_m
    if gap < max(3 * boundary.flatness_m, 1e-4):
        return f"is on the support (the tip comes within {gap * 1e3:.2f} mm of it)"
    return ""


def recognised(
    signals: Signals, boundary: Boundary, touches: Sequence[tuple[int, int]]
) -> dict[tuple[int, int], str]:
    """What contacts of samples [a, b) that nobody states are with the support.

    'rigid' where the tip stays in its place on it and feels it alone; 'retrace' where contacts slide near it,
    if together they go round the base: one that the frame has left may stand above or below.
    """
    radius = signals.recording.tip_radius_m
    middle = boundary.centres.mean(axis=0)
    axes = np.linalg.svd(boundary.support_normal[None])[2][1:]
    slid, found, seen = [], {}, np.zeros(_BINS, dtype=bool)
    for a, b in touches:
        here = (signals.position[a:b] - middle) @ axes.T
        if np.linalg.norm(np.ptp(here, axis=0)) < _SLID * radius:
            pushed = signals.force[a:b].sum(axis=0)
            alone = pushed @ boundary.support_normal > _ALONG * np.linalg.norm(pushed)
            if alone and on_it(signals.position[a:b], boundary, radius):
                found[a, b] = "rigid"
        elif np.median(np.abs(boundary.height(signals.position[a:b]) - radius)) < radius:
            slid.append((a, b))
            turn = np.arctan2(here[:, 1], here[:, 0]) / (2 * np.pi)
            seen[np.floor(_BINS * turn).astype(int) % _BINS] = True
    return found | (dict.fromkeys(slid, "retrace") if seen.mean() >= _ROUND else {})


def supported(presses: Presses, t: np.ndarray) -> np.ndarray:
    """(n,) bool: where the table says that the support was touched after the tracing, and just before and
    after, as a force is felt later than a tip is down."""
    near = np.zeros(len(t), dtype=bool)
    for each in presses.segments:
        if each.kind in ON_SUPPORT:
            near |= (t > each.start_s - _NEAR_S) & (t < each.end_s + _NEAR_S)
    return near
