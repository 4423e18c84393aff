"""What a machine's force does in free air beside its level: a slope along the travel, a drift with time.

Both are nuisances of the fit of the ways in (`elastic_fit`), which the modulus's interval is of. Here they
are taken off the whole curve, back included, for what else is read off it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.specimen.approach import SURE_PULL
from palpate.diagnosis.specimen.bench import MachineCycle, touched
from palpate.diagnosis.specimen.elastic_fit import Elastic, elastic_fit
from palpate.mechanics.contact.tip import Tip
from palpate.mechanics.plausible import USUAL_POISSON_RATIO
from palpate.reconstruction.steps.s1_filter.noise import white_noise_std

_AWAY, _BACK = 0.15, 0.5
"""Shares of the depth before first touch, and after it is lost, in which the tip may pull or push already."""
_ROWS = 12
_SURE = 4.0
"""Standard errors from which what differs between the air of both ways is a drift with time."""
_LIKELY = 0.5
"""Probability of a slope from which it is taken off."""


@dataclass(frozen=True)
class Baseline:
    """Curves without their slopes. slope_n_per_m: (k,) N/m of those that have one, as they are on the way
    in. fit: of curves of one modulus."""

    curves: list[MachineCycle]
    slope_n_per_m: np.ndarray
    fit: Elastic | None


def without_slope(
    curves: Sequence[MachineCycle],
    tip: Tip,
    *,
    timed: bool = True,
    poisson_ratio: float = USUAL_POISSON_RATIO,
    alike: bool = True,
) -> Baseline:
    """timed: whether times are more than an order of rows. alike: whether the curves are of one modulus.
    Raises ContactError where no curve has a contact."""
    found = touched(curves, tip)
    used = [curve for curve, use in zip(curves, found.used, strict=True) if use]
    groups = [list(range(len(used)))] if alike else [[k] for k in range(len(used))]
    slopes = np.zeros(len(used))
    for group in groups:
        own = [used[k] for k in group]
        pull = float(
            np.median([_pull(curve, float(found.onset[k])) for k, curve in zip(group, own, strict=True)])
        )
        fit = elastic_fit(own, found.onset[group], tip, poisson_ratio, pull_n=pull)
        if fit.sloped > _LIKELY:
            slopes[group] = fit.slope_n_per_m
    free = iter(
        _free(curve, float(at), float(slope), timed) if slope else curve
        for curve, at, slope in zip(used, found.onset, slopes, strict=True)
    )
    return Baseline(
        [next(free) if use else curve for curve, use in zip(curves, found.used, strict=True)],
        slopes[slopes != 0],
        fit if alike else None,
    )


def _pull(curve: MachineCycle, onset: float) -> float:
    """N, greatest pull on the way out below the air of the way in, 0 where noise alone reaches so far."""
    peak = int(np.argmax(curve.force))
    air = curve.force[:peak][curve.travel[:peak] < onset]
    level = float(np.median(air)) if len(air) else float(curve.force[0])
    pull = level - float(curve.force[peak:].min())
    return pull if pull > SURE_PULL * white_noise_std(curve.force[:, None]) else 0.0


def _free(curve: MachineCycle, onset: float, slope: float, timed: bool) -> MachineCycle:
    """Without a slope (N/m) of its way in, which is of the travel but for what of it is a drift with time."""
    peak = int(np.argmax(curve.force))
    u, t = curve.travel, curve.t
    deep = float(u[peak]) - onset
    before = np.arange(len(u)) < peak
    free = dataclasses.replace(curve, force=curve.force - slope * (u - u[0]))
    way_in = before & (u < onset - _AWAY * deep)
    back = ~before & (u < onset - _BACK * deep)
    if not timed or min(way_in.sum(), back.sum()) < _ROWS:
        return free
    pace = float(u[peak] - u[0]) / max(float(t[peak] - t[0]), 1e-300)
    apart = free.force[back].mean() - free.force[way_in].mean()
    error = np.sqrt(sum(float(free.force[air].var()) / air.sum() for air in (way_in, back)))
    if not pace > 0 or abs(apart) < _SURE * error:
        return free
    later = (t - t[0]) - (u - u[0]) / pace  # what a drift does beside the slope that the way in shows
    drift = apart / max(float(later[back].mean() - later[way_in].mean()), 1e-300)
    return dataclasses.replace(curve, force=free.force - drift * later)
