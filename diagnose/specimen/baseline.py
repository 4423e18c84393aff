"""What a machine's force does in free air beside its level: a slope along the travel, a drift with time.

Both are nuisances of a curve: fitted where the tip is in the air, on the way in and back, taken off the whole
curve before anything is read off it, and what they are known by goes into the modulus's interval.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.specimen.bench import MachineCycle, touched
from palpate.mechanics.contact.tip import Tip

_AWAY, _BACK = 0.15, 0.5
"""Shares of the depth before first touch, and after it is lost, in which the tip may pull or push already."""
_ROWS = 12
_SURE, _MATTERS = 4.0, 0.01
"""Standard errors, and share of the peak over the depth, from which a slope or a drift is there."""
_MOST = 0.5
"""Share of the rise from air to the peak from which a slope is a contact's own."""
_PLACES = 60
_TURNS = 4
"""First touch and slope change one another."""


@dataclass(frozen=True)
class Baseline:
    """Curves without their slopes. slope_n_per_m: (k,) N/m of those that have one, as they are on the way in.
    later: the same curves with the force at the peak one standard error of what was taken off higher."""

    curves: list[MachineCycle]
    slope_n_per_m: np.ndarray
    later: list[MachineCycle]


def without_slope(curves: Sequence[MachineCycle], tip: Tip, *, timed: bool = True) -> Baseline:
    """timed: whether times are more than an order of rows. Raises ContactError where no curve has a
    contact."""
    found = touched(curves, tip)
    at = np.full(len(curves), np.nan)
    at[found.used] = found.onset
    rows = [
        _plain(curve)
        if not np.isfinite(onset) or curve.level_n is not None
        else _one(curve, onset, tip, timed)
        for curve, onset in zip(curves, at, strict=True)
    ]
    return Baseline(
        [curve for curve, _, _ in rows],
        np.array([slope for _, slope, _ in rows if slope]),
        [later for _, _, later in rows],
    )


def _plain(curve: MachineCycle) -> tuple[MachineCycle, float, MachineCycle]:
    return curve, 0.0, curve


def _one(
    curve: MachineCycle, onset: float, tip: Tip, timed: bool
) -> tuple[MachineCycle, float, MachineCycle]:
    """(the curve without slope and drift, N/m on the way in, the curve one standard error off)."""
    made = _plain(curve)
    if (curve.travel[: int(np.argmax(curve.force))] < onset).sum() < 2 * _ROWS:
        onset = _touch_beside_a_slope(curve, tip)  # a slope was taken for the touch
    for _ in range(_TURNS):
        made = _fitted(curve, onset, timed)
        if not made[1]:
            return made
        onset = float(touched([made[0]], tip).onset[0])
    return made


def _fitted(curve: MachineCycle, onset: float, timed: bool) -> tuple[MachineCycle, float, MachineCycle]:
    peak = int(np.argmax(curve.force))
    u, t, force = curve.travel, curve.t, curve.force
    deep = float(u[peak]) - onset
    before = np.arange(len(u)) < peak
    way_in = before & (u < onset - _AWAY * deep)
    back = ~before & (u < onset - _BACK * deep)
    if way_in.sum() < _ROWS or not np.ptp(u[way_in]) > 0 or not deep > 0 or _bends(u[way_in], force[way_in]):
        return _plain(curve)
    first = int(np.argmax(u > onset))
    span = np.array([u[peak] - u[first], t[peak] - t[first]])
    columns = np.column_stack([(u - u[first]) / max(span[0], 1e-300), (t - t[first]) / max(span[1], 1e-300)])
    both = timed and back.sum() >= _ROWS  # on the way in alone a drift is a slope
    air = way_in | back if both else way_in
    kept = [0, 1] if both else [0]
    top = float(force[peak] - np.median(force[way_in]))
    while kept:
        basis = np.column_stack([np.ones(int(air.sum())), columns[air][:, kept]])
        values, *_ = np.linalg.lstsq(basis, force[air], rcond=None)
        left = force[air] - basis @ values
        variance = float(left @ left) / max(len(left) - basis.shape[1], 1)
        covariance = variance * np.linalg.pinv(basis.T @ basis)
        sure = np.abs(values[1:]) / np.sqrt(np.maximum(np.diag(covariance)[1:], 1e-300))
        there = (sure > _SURE) & (np.abs(values[1:]) > _MATTERS * top)
        if there.all():
            if abs(values[1:].sum() / span[0]) * np.median(u[peak] - u[way_in]) > _MOST * top:
                break  # a contact's own
            moved = columns[:, kept] @ values[1:]
            error = np.sqrt(float(covariance[1:, 1:].sum()))
            free = dataclasses.replace(curve, force=force - moved)
            later = dataclasses.replace(free, force=free.force + error * columns[:, 0])
            return free, float(values[1:].sum() / span[0]), later
        kept = [k for k, good in zip(kept, there, strict=True) if good]
    return _plain(curve)


def _bends(u: np.ndarray, force: np.ndarray) -> bool:
    """Whether what should be air surely bends upwards, as the beginning of a contact does."""
    x = (u - u.mean()) / np.ptp(u)
    (bend, *_), covariance = np.polyfit(x, force, 2, cov=True)
    return bool(bend > _SURE * np.sqrt(covariance[0, 0]))


def _touch_beside_a_slope(curve: MachineCycle, tip: Tip) -> float:
    """m, first touch where level, slope and the tip's force are fitted to the way in together."""
    peak = int(np.argmax(curve.force))
    u, force = curve.travel[: peak + 1], curve.force[: peak + 1]
    best = (np.inf, float(u[0]))
    for at in np.linspace(u[0], u[-1], _PLACES, endpoint=False):
        deep = np.maximum(u - at, 0.0) ** tip.power
        basis = np.column_stack([np.ones(len(u)), (u - u[0]) / np.ptp(u), deep / deep.max()])
        values, *_ = np.linalg.lstsq(basis, force, rcond=None)
        missed = float(((force - basis @ values) ** 2).sum())
        best = min(best, (missed, float(at)))
    return best[1]
