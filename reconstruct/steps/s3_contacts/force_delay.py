"""How late the force reads: coarsely by places passed twice, finely by first and last touch together.

Where the force passes one level on its way up and down, the tip is at nearly the same place: the shift of
time that brings both together is right to some milliseconds, however late the force is. A force that reads
tau late moves first touch deeper by tau times the speed of approach, and loss of touch further out by tau
times the speed of withdrawal. Their difference, over presses of unlike speed, gives tau; what does not depend
on the speed (adhesion, relaxation, backlash) is a constant beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.statistics import biweight, spread_about_zero
from palpate.reconstruction.steps.s1_filter.signals import Signals
from palpate.reconstruction.steps.s3_contacts.contact_law import fit_rise
from palpate.reconstruction.steps.s3_contacts.single_press import FoundPress

_TAIL_S = 0.15
_AWAY_M = 0.004
_SPEED_S = 0.03
_FIT_SAMPLES = 120
_SIDEWAYS_M = 0.001
_LEAST_PRESSES = 8
_CERTAIN = 5.0
_LEAST_S = 0.003
_LEVEL = 0.3
_SHIFTS_S = np.arange(-0.5, 0.5001, 0.004)
_LEAST_TOUCHES = 6


@dataclass(frozen=True)
class Delay:
    """seconds: how late the force reads (negative: early). error_s: its standard error. presses: used."""

    seconds: float
    error_s: float
    presses: int

    @property
    def certain(self) -> bool:
        """Whether it is beyond five standard errors and 3 ms: less moves first touch within its own error."""
        return abs(self.seconds) > max(_CERTAIN * self.error_s, _LEAST_S)


def delay_by_places(
    t: np.ndarray, path: np.ndarray, size: np.ndarray, spans: Sequence[tuple[int, int]]
) -> Delay:
    """How late the force reads, by the places that touches pass twice; zero with an infinite error where
    fewer than 6 can tell.

    t: (n,) s. path: (n, 3) m. size: (n,) N, of the force. spans: [start, end) samples of each touch.
    """
    lags = []
    for a, b in spans:
        level = size[a:b] > _LEVEL * size[a:b].max()
        first, last = a + np.flatnonzero(level)[[0, -1]]
        gap = np.zeros(len(_SHIFTS_S))
        for axis in range(3):
            up = np.interp(t[first] - _SHIFTS_S, t, path[:, axis])
            gap += (up - np.interp(t[last] - _SHIFTS_S, t, path[:, axis])) ** 2
        best = int(np.argmin(gap))
        if 0 < best < len(gap) - 1:
            lags.append(_SHIFTS_S[best])
    if len(lags) < _LEAST_TOUCHES:
        return Delay(0.0, np.inf, len(lags))
    middle = float(np.median(lags))
    scatter = max(spread_about_zero(np.array(lags) - middle), float(_SHIFTS_S[1] - _SHIFTS_S[0]))
    return Delay(middle, 1.25 * scatter / float(np.sqrt(len(lags))), len(lags))


def force_delay(signals: Signals, contacts: Sequence[FoundPress]) -> Delay:
    """How late the force reads; zero with an infinite error where fewer than 8 presses can tell.

    Presses that end over 1 mm beside their first touch are left out: a dragged surface lets go elsewhere.
    """
    rows = [row for c in contacts if (row := _gap_and_speed(signals, c)) is not None]
    if len(rows) < _LEAST_PRESSES:
        return Delay(0.0, np.inf, len(rows))
    gap, error, speed = np.array(rows).T
    system = np.column_stack([np.ones_like(speed), speed])
    least = max(float(np.median(error)), 1e-5)
    known = 1 / np.maximum(error, least)

    def line(weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        root = np.sqrt(weight) * known
        found = np.linalg.lstsq(system * root[:, None], gap * root, rcond=None)[0]
        return found, gap - system @ found

    fit = biweight(line, len(gap), least=least)
    variance = np.linalg.inv((system * fit.weight[:, None]).T @ system)[1, 1]
    return Delay(float(fit.fitted[1]), float(fit.scale * np.sqrt(variance)), len(rows))


def _gap_and_speed(signals: Signals, contact: FoundPress) -> tuple[float, float, float] | None:
    """Depth of first touch less that of loss of touch, its error (m), and both speeds' sum (m/s)."""
    rate, normal = signals.recording.sample_rate_hz, contact.normal
    until = min(len(signals.position), contact.end + int(_TAIL_S * rate))
    moved = signals.position[contact.peak : until] - contact.centre
    travel = -moved @ normal
    push = signals.raw_force[contact.peak : until] @ normal
    if not travel.max() > 0.0:  # a touch from the side: the tip was never below its first place
        return None
    first = int(np.flatnonzero(travel >= 0.9 * travel.max())[-1])
    # a force that reads late is still felt where a fast hand has long gone
    quiet = np.arange(len(travel)) >= contact.end - contact.peak
    away = np.flatnonzero((travel < -_AWAY_M)[first:] & quiet[first:])
    part = slice(first, first + int(away[0]) if len(away) else None)
    moved, travel, push = moved[part], travel[part], push[part]
    block = max(1, len(travel) // _FIT_SAMPLES)
    count = len(travel) // block
    if count < 10:
        return None
    rise = fit_rise(
        travel[: count * block].reshape(count, block).mean(axis=1),
        push[: count * block].reshape(count, block).mean(axis=1),
        signals.noise_n / np.sqrt(block),
        guess_m=0.0,
    )
    lost = int(np.argmin(np.abs(travel - rise.u0_m)))
    beside = float(np.linalg.norm(moved[lost] + travel[lost] * normal))
    half, t = max(1, int(_SPEED_S * rate / 2)), signals.recording.t
    around = [slice(max(k - half, 0), k + half) for k in (contact.start, contact.peak + first + lost)]
    # by the clock: a busy program leaves samples out
    speeds = [np.ptp(signals.position[a] @ normal) / max(np.ptp(t[a]), 1 / rate) for a in around]
    if beside > _SIDEWAYS_M or min(speeds) <= 0:
        return None
    return -rise.u0_m, float(np.hypot(rise.u0_error_m, contact.onset_error_m)), sum(speeds)
