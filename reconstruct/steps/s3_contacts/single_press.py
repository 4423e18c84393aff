"""One press of a recording: when it touched, where, and which way the surface faces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.reconstruction.steps.s1_filter.signals import Signals
from palpate.reconstruction.steps.s3_contacts.contact_law import contact_law, fit_rise

_LEAD_S = 0.15
_FIT_SAMPLES = 250
_TELLS = 0.7
"""A press's force rises and falls with its depth, which explains this share of it at least; of what passes in
free motion it explains less (half of a bump on an even way)."""


class FoundPress(NamedTuple):
    """One press where it was found; device frame, SI.

    start, peak, end: samples of first touch, greatest force, loss of the last force above the noise (end
    exclusive). centre: (3,) tip's centre at first touch. normal: (3,) outward, from the force. onset_error_m:
    standard error of the first touch along it. unbroken: cut out of a contact; start and end are the cuts.
    """

    start: int
    peak: int
    end: int
    centre: np.ndarray
    normal: np.ndarray
    onset_error_m: float = 0.0
    unbroken: bool = False


def paper_touch(signals: Signals, a: int, b: int) -> FoundPress | None:
    """First touch where the force started to rise: back from the threshold while each sample is above
    the last.

    a, b: samples between which the force is above its lower threshold. The normal is the force's direction at
    its peak.
    """
    magnitude = signals.magnitude
    start = a
    while start > 0 and magnitude[start - 1] < magnitude[start]:
        start -= 1
    peak = a + int(np.argmax(magnitude[a:b]))
    return FoundPress(start, peak, b, signals.position[start], signals.force[peak] / magnitude[peak])


def fitted_touch(signals: Signals, a: int, b: int) -> FoundPress | None:
    """First touch by fitting the contact law to the approach and rise; None where the force has no direction.

    a, b: samples between which the force is above its lower threshold.
    """
    peak = a + int(np.argmax(signals.magnitude[a:b]))
    normal = initial_normal(signals, a, peak)
    if normal is None or peak - a < 3:
        return None
    lead = max(0, a - int(_LEAD_S * signals.recording.sample_rate_hz))
    travel = -(signals.position[lead : peak + 1] - signals.position[a]) @ normal
    # only the approach itself: before it the hand may have come from anywhere
    away = np.flatnonzero(travel[: a - lead] > 0.0005)
    first = lead + (int(away[-1]) + 1 if len(away) else 0)
    travel = travel[first - lead :]
    push = signals.raw_force[first : peak + 1] @ normal
    block = max(1, len(travel) // _FIT_SAMPLES)
    rows = len(travel) // block
    rise = fit_rise(
        travel[-rows * block :].reshape(rows, block).mean(axis=1),
        push[-rows * block :].reshape(rows, block).mean(axis=1),
        signals.noise_n / np.sqrt(block),
        guess_m=0.0,
    )
    touched = np.flatnonzero(travel >= rise.u0_m)
    if not len(touched):
        return None
    start = first + int(touched[0])
    here = -(signals.position[start] - signals.position[a]) @ normal
    centre = signals.position[start] - (rise.u0_m - here) * normal
    depth = -(signals.position[first:b] - centre) @ normal
    law = contact_law(depth, rise.hertz, rise.compliance)
    if _explained(signals.force[first:b] @ normal, law) < _TELLS or depth.max() < rise.u0_error_m:
        return None
    return FoundPress(start, peak, b, centre, normal, rise.u0_error_m)


def _explained(push: np.ndarray, law: np.ndarray) -> float:
    """Share of a force (n,) that a law (n,) of the depth makes up, at its best scale."""
    return float((push @ law) * abs(push @ law) / max((push @ push) * (law @ law), 1e-300))


def initial_normal(signals: Signals, a: int, peak: int) -> np.ndarray | None:
    """Outward normal from the first force: its mean direction while it rises from 15 to 60 % of the peak."""
    level = signals.magnitude[a : peak + 1] / signals.magnitude[peak]
    chosen = (level > 0.15) & (level < 0.6)
    if chosen.sum() < 3:
        chosen = level > 0.1
    direction = signals.force[a : peak + 1][chosen].sum(axis=0)
    length = np.linalg.norm(direction)
    return direction / length if length > 0 else None
