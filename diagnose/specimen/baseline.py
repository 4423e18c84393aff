"""What a machine's force does in free air beside its level: a slope along the travel, a drift with time.

Both are nuisances of the fit of the ways in (`elastic_fit`), which the modulus's interval is of. Here they
are taken off the whole curve, back included, for what else is read off it.

Which form of tip a machine's curves are of, where nobody said it: each form is a hypothesis.

The force of a form grows by a power of the depth of its own. Each is fitted to the ways in, with a first
touch of its own, and blocks of force are left out in turn. A sphere may be held by a machine that yields,
which makes a straight line of its curve, so it is fitted on either.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.specimen.approach import SURE_PULL
from palpate.diagnosis.specimen.bench import MachineCycle, touched
from palpate.diagnosis.specimen.elastic_fit import Elastic, elastic_fit
from palpate.diagnosis.specimen.machine_compliance import BLOCKS, held_out_laws, way_of
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


_COMES = {"sphere": 0.95, "punch": 0.025, "cone": 0.025}
"""How often a tip is of a form where only a radius is said; a pyramid's curve is a cone's."""
_LAW_MISSES = 0.01
"""Share of the force that the right law misses."""
_CURVES = 8
_ANY_ANGLE = 45.0
"""Degrees: the angle changes the modulus alone."""


def form_scores(curves: Sequence[MachineCycle], radius_m: float, poisson_ratio: float) -> dict[str, float]:
    """Form -> log likelihood (nats) of its power, with how often it comes. Raises ContactError where no curve
    has a contact."""
    some = curves[:: max(1, len(curves) // _CURVES)]
    return {
        form: float(np.log(comes)) + _score(some, Tip(form, radius_m, _ANY_ANGLE), poisson_ratio)
        for form, comes in _COMES.items()
    }


def _score(curves: Sequence[MachineCycle], tip: Tip, poisson_ratio: float) -> float:
    """Nats of the blocks of force that the form misses; a sphere's by the best of its laws, on a rigid
    machine or one that yields. Machines take any share of the travel alike: the more of it, the fewer do."""
    curves = without_slope(curves, tip, timed=False).curves
    found = touched(curves, tip)
    used = [c for c, u in zip(curves, found.used, strict=True) if u]
    ways = [way_of(c.travel, c.force, float(at)) for c, at in zip(used, found.onset, strict=True)]
    deep = max(float(w.travel[-1] - w.travel[0]) for w in ways)
    guess = tip.guess_modulus(deep, max(float(w.push.max()) for w in ways), poisson_ratio)
    laws = held_out_laws(ways, poisson_ratio, tip, guess, (False, True) if tip.form == "sphere" else (False,))
    return max(
        float(np.log(max(1 - each.share, 1e-9)) - BLOCKS * np.log(np.hypot(each.missed, _LAW_MISSES)))
        for each in laws
    )
