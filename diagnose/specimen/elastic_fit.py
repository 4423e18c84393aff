"""What the ways in of a machine's curves tell of an elastic sample: one fit of all that moves its modulus.

The force of a way in is level + slope u + f(u - u0 - c f), with the travel u, the tip's force f by a law of
the dent, each curve's first touch u0, level of free air and modulus, and the machine's compliance c.
Hypotheses are the laws (JKR's too where the sample pulls: Johnson, Kendall & Roberts 1971,
doi:10.1098/rspa.1971.0141), a machine that is rigid or takes any share of the travel, free air that is flat,
slopes in all curves alike or in each by itself, and curves of one modulus or of moduli that differ. Each is
fitted by least squares to all rows, in air and in contact; its likelihood, integrated over what is fitted
(Laplace), weighs it. The modulus's interval is that of all hypotheses together. Residuals of the best say how
large and how long errors are: a law that misses the curves counts as noise that lasts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.special import ndtr

from palpate.diagnosis.specimen.bench import MachineCycle, touched
from palpate.diagnosis.specimen.way_in import JKR, DentTables, WayFit, WayFitted, lasting, way_of
from palpate.mechanics.contact.tip import Tip

_SHARES = np.array(
    [0, 0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.27, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.93, 0.98]
)
"""Of the travel in contact at the greatest force, that the machine takes."""
_RIGID, _FLAT, _ALIKE = 0.5, 0.5, 0.5
"""How often a machine yields by nothing that matters, free air is flat, and curves are of one modulus."""
_SLOPES = 0.1
"""Standard deviation of a slope, where free air slopes: of the peak over the depth."""
_APART = np.geomspace(0.002, 2.0, 14)
"""Standard deviations of ln E between curves, where they differ: each factor as often."""
_CURVES = 10
"""Curves that are fitted, spread over all."""
_PULLS = 0.1
"""Standard deviation of the log of a pull about the one that was read on the way out."""
_LEAST = 3e-4
"""Of the force: errors of tables and travels, where a curve has no noise."""
_FINE, _EVEN, _UNLIKELY = 6000, 200, 25.0
"""Steps of the share where it is looked for, and where it is likely: within so many nats of the likeliest."""
_TOLD = (-100.0, 100.0)
"""Of ln E, where a curve leaves it open."""
NAMED = 0.9
"""Probability from which a machine that yields is named: nine to one."""
ALL = 0.95
"""A machine that takes this share of the travel in contact leaves too little to tell a modulus by: the dent
is then no greater than what law, zero and tip are known by."""


@dataclass(frozen=True)
class Elastic:
    """modulus_pa: median, with its 95 % interval, of all hypotheses. yields: probability of a machine that
    yields; stiffness_n_per_m, share: of it, median (nan where none is likely), with the stiffness's 95 %;
    rigid_pa, yielding_pa: the modulus by either. sloped: probability that free air slopes; slope_n_per_m (c,)
    of each curve given, mean of all. law: the likeliest. laws: probability of each.
    missed: rms of blocks of force that were left out by the likeliest, over that of the force; rigid_missed:
    by the best on a rigid machine. along_m, along_n: (k,) travel m, of dent and machine, and force N of the
    likeliest; touch_m: where the first curve touches, after what was told."""

    modulus_pa: float
    interval_pa: tuple[float, float]
    yields: float
    stiffness_n_per_m: float
    stiffness_ci95_n_per_m: tuple[float, float]
    share: float
    rigid_pa: float
    yielding_pa: float
    sloped: float
    slope_n_per_m: np.ndarray
    law: str
    laws: dict[str, float]
    missed: float
    rigid_missed: float
    along_m: np.ndarray
    along_n: np.ndarray
    touch_m: float

    @property
    def machine(self) -> bool:
        """Whether a machine that yields is named."""
        return self.yields > NAMED

    @property
    def takes_all(self) -> bool:
        """Whether nothing of the travel is left that would tell a modulus."""
        return self.machine and self.share > ALL


_Row = tuple[float, list[WayFitted]]
"""A share of the machine, and each way's fit."""


def elastic_of(
    curves: Sequence[MachineCycle], tip: Tip, poisson_ratio: float, pull_n: float = 0.0
) -> Elastic:
    """Of curves that may have no contact. Raises ContactError where none has one."""
    found = touched(curves, tip)
    used = [curve for curve, use in zip(curves, found.used, strict=True) if use]
    return elastic_fit(used, found.onset, tip, poisson_ratio, pull_n=pull_n)


def elastic_fit(
    curves: Sequence[MachineCycle],
    onset_m: np.ndarray,
    tip: Tip,
    poisson_ratio: float,
    *,
    pull_n: float = 0.0,
) -> Elastic:
    """curves, with a contact each; onset_m: (c,) m, about where each touches. pull_n: N, greatest pull on the
    way out, 0 for none."""
    every = np.arange(len(curves))[:: max(1, -(-len(curves) // _CURVES))]
    ways = [way_of(curves[k], float(onset_m[k])) for k in every]
    deep = max(float(w.travel[-1]) for w in ways)
    peak = max(float(w.force[-1]) for w in ways)
    guess = tip.guess_modulus(deep, peak, poisson_ratio)
    names = [*tip.laws, *([JKR] if pull_n > 0 and tip.form == "sphere" else [])]
    rigid = tip.form == "punch" or all(curve.own for curve in curves)
    shares = _SHARES[:1] if rigid else _SHARES
    tried = []
    for name in names:
        law = DentTables(name, tip, poisson_ratio, deep, pull_n)
        for sloped in (False, True):
            fits = [WayFit(way, law, sloped, deep, peak, guess) for way in ways]
            tried.append(_Tried(fits, _along(fits, shares)))
    return _weighed(tried, every, len(curves))


@dataclass(frozen=True)
class _Tried:
    """One law, with flat or sloped air: each way's fit along shares of the machine."""

    fits: list[WayFit]
    rows: list[_Row]

    @property
    def best(self) -> _Row:
        """The row that leaves least."""
        return min(self.rows, key=_squares)


def _squares(row: _Row) -> float:
    return sum(each.squares for each in row[1])


def _along(fits: Sequence[WayFit], shares: np.ndarray) -> list[_Row]:
    """Fits along the machine's share, closer where they are best."""
    start = [fit.start(float(shares[0])) for fit in fits]
    rows: list[_Row] = []
    for share in shares:
        rows.append((float(share), [f.at(float(share), v) for f, v in zip(fits, start, strict=True)]))
        start = [each.values for each in rows[-1][1]]
    for _ in range(3 if len(shares) > 1 else 0):  # towards the least, which lies between what was fitted
        rows.sort(key=lambda row: row[0])
        best = min(range(len(rows)), key=lambda k: _squares(rows[k]))
        start = [each.values for each in rows[best][1]]
        ends = [rows[k][0] for k in (max(best - 1, 0), best, min(best + 1, len(rows) - 1))]
        for a, b in zip(ends, ends[1:], strict=False):
            for share in np.linspace(a, b, 5)[1:-1] if b > a else ():
                rows.append((float(share), [f.at(share, v) for f, v in zip(fits, start, strict=True)]))
    return sorted(rows, key=lambda row: row[0])


@dataclass(frozen=True)
class _Table:
    """One hypothesis over (n,) shares and differences between curves: log of its weight, with how often such
    a one comes; log E and its standard error; slope N/m of each way (w,)."""

    law: str
    share: np.ndarray
    log: np.ndarray
    log_e: np.ndarray
    error: np.ndarray
    slope: np.ndarray | None = None


def _weighed(tried: Sequence[_Tried], every: np.ndarray, curves: int) -> Elastic:
    """All hypotheses by their likelihood, integrated over the machine's share."""
    first = tried[0].fits[0]
    readings = sum(len(fit.way.travel) for fit in tried[0].fits)

    def per_reading(each: _Tried) -> float:
        return _squares(each.best) / max(readings - sum(len(f.values) for f in each.best[1]), 1)

    nearest = min(tried, key=per_reading)
    lasts = float(np.mean([lasting(each.left) for each in nearest.best[1]]))
    force = float(np.mean([fit.root**2 * np.mean(fit.way.force**2) for fit in tried[0].fits]))
    variance = max(per_reading(nearest), _LEAST**2 * force) * lasts
    tables = [table for each in tried for table in _tables(each, variance)]
    top = max(float(table.log.max()) for table in tables)
    weights = [np.exp(table.log - top) for table in tables]
    whole = sum(float(w.sum()) for w in weights)
    weights = [w / whole for w in weights]
    share, log_e, error = (
        np.concatenate([getattr(t, n) for t in tables]) for n in ("share", "log_e", "error")
    )
    weight = np.concatenate(weights)
    low, middle, high = _quantiles(log_e, error, weight)
    laws: dict[str, float] = {}
    slope, sloped = np.zeros(len(every)), 0.0
    for table, w in zip(tables, weights, strict=True):
        laws[table.law] = laws.get(table.law, 0.0) + float(w.sum())
        if table.slope is not None:
            slope, sloped = slope + w.sum() * table.slope, sloped + float(w.sum())
    yields = share > 0
    chance, nan = float(weight[yields].sum()), float("nan")
    taken: list[float] = [nan, nan, nan]
    yielding = nan
    if chance > 0:
        taken = _quantiles(share[yields], 0 * share[yields], weight[yields])
        yielding = float(np.exp(_quantiles(log_e[yields], error[yields], weight[yields])[1]))
    law = max(laws, key=lambda name: laws[name])
    mine = min((each for each in tried if each.fits[0].law.name == law), key=per_reading)
    rigid = min(tried, key=lambda each: _squares(each.rows[0]))
    along, push = mine.fits[0].curve(mine.best[1][0].values, mine.best[0])
    stiff = np.array([first.peak / first.deep / max(x, 1e-300) for x in taken])
    near = np.clip(np.searchsorted(every, np.arange(curves), side="right") - 1, 0, len(every) - 1)
    return Elastic(
        modulus_pa=float(np.exp(middle)),
        interval_pa=tuple(np.exp(np.clip([low, high], *_TOLD)).tolist()),
        yields=chance,
        stiffness_n_per_m=float(stiff[1]),
        stiffness_ci95_n_per_m=(float(stiff[2]), float(stiff[0])),
        share=taken[1],
        rigid_pa=float(np.exp(np.median([each.values[0] for each in rigid.rows[0][1]]))),
        yielding_pa=yielding,
        sloped=sloped,
        slope_n_per_m=slope[near],
        law=law,
        laws=laws,
        missed=_missed(mine.fits, mine.best),
        rigid_missed=_missed(rigid.fits, rigid.rows[0]),
        along_m=along[push < 1.1 * first.peak],
        along_n=push[push < 1.1 * first.peak],
        touch_m=float(mine.best[1][0].values[1]),
    )


def _missed(fits: Sequence[WayFit], row: _Row) -> float:
    """rms of what was left out over the rms of the force."""
    found = np.array([f.left_out(row[0], each.values) for f, each in zip(fits, row[1], strict=True)])
    missed, whole = found.sum(axis=0)
    return float(np.sqrt(missed / max(whole, 1e-300)))


def _tables(each: _Tried, variance: float) -> list[_Table]:
    """Of flat air one; of sloped air one alike in all curves and one of each curve's own."""
    kinds = (None,) if not each.fits[0].sloped else ((True,) if len(each.fits) == 1 else (True, False))
    return [_marginal(each, alike, (1 - _FLAT) / len(kinds) if alike is not None else _FLAT, variance)
            for alike in kinds]  # fmt: skip


def _marginal(each: _Tried, alike: bool | None, often: float, variance: float) -> _Table:
    apart = np.append(0.0, _APART) if len(each.fits) > 1 else np.zeros(1)
    comes = np.append(_ALIKE, np.full(len(apart) - 1, (1 - _ALIKE) / max(len(apart) - 1, 1)))
    comes = comes / comes.sum()
    shares = np.array([share for share, _ in each.rows])
    of_rows = np.array([_of_row(row, alike, variance, apart) for _, row in each.rows])  # (rows, 3, apart)
    law = each.fits[0].law.name
    of_rows[:, 0] += np.log(often) + np.log(comes)
    if law == JKR:
        pulls = np.array([[one.values[-1] for one in row] for _, row in each.rows])
        prior = -0.5 * (pulls / _PULLS) ** 2 - np.log(_PULLS * np.sqrt(2 * np.pi))
        of_rows[:, 0] += prior.sum(axis=1)[:, None]
    slope = _slopes(each)
    if len(shares) == 1:
        log, log_e, error = of_rows[0]
        return _Table(law, np.zeros(len(apart)), log, log_e, error, slope)
    fine = np.linspace(0.0, shares[-1], _FINE)
    likely = PchipInterpolator(shares, of_rows[:, 0].max(axis=1))(fine)
    near = fine[likely > likely.max() - _UNLIKELY]
    step = (near[-1] - near[0] + fine[1]) / _EVEN
    fine = near[0] + step * (np.arange(_EVEN) + 0.5)
    fine = fine[fine < shares[-1]]
    between = PchipInterpolator(shares, of_rows)(fine)
    between[:, 0] += np.log((1 - _RIGID) * step / shares[-1])
    of_rows[:1, 0] += np.log(_RIGID)
    log, log_e, error = np.moveaxis(np.concatenate([of_rows[:1], between]), 1, 0)
    at = np.repeat(np.append(0.0, fine), len(apart))
    return _Table(law, at, log.ravel(), log_e.ravel(), error.ravel(), slope)


def _of_row(row: Sequence[WayFitted], alike: bool | None, variance: float, apart: np.ndarray) -> np.ndarray:
    """(3, a): log of the likelihood, integrated over all that is fitted, log E, its standard error, for
    curves that differ by each of `apart`. alike: None for flat air, else whether all slopes are one."""
    log = sum(-each.squares / (2 * variance) for each in row)
    log += sum(0.5 * float(np.linalg.slogdet(2 * np.pi * variance * each.covariance)[1]) for each in row)
    moduli = np.array([each.values[0] for each in row])
    spread = np.diag([variance * each.covariance[0, 0] for each in row])
    if alike is False:
        slopes = np.array([each.values[2] for each in row])
        log += float((-0.5 * (slopes / _SLOPES) ** 2 - np.log(_SLOPES * np.sqrt(2 * np.pi))).sum())
    elif alike:
        slopes = np.array([each.values[2] for each in row])
        square = np.array([variance * each.covariance[2, 2] for each in row])
        turn = np.array([each.covariance[0, 2] / each.covariance[2, 2] for each in row])
        precision = (1 / square).sum() + 1 / _SLOPES**2
        one = (slopes / square).sum() / precision
        log -= 0.5 * float(((slopes - one) ** 2 / square).sum() + (one / _SLOPES) ** 2)
        log -= 0.5 * float(np.log(2 * np.pi * square).sum() + np.log(_SLOPES**2 * precision))
        moduli = moduli + turn * (one - slopes)
        spread = spread - np.diag(turn**2 * square) + np.outer(turn, turn) / precision
    found = np.empty((3, len(apart)))
    for k, each in enumerate(apart):
        inverse = np.linalg.inv(spread + each**2 * np.eye(len(moduli)))
        known = float(inverse.sum())
        mean = float(inverse.sum(axis=0) @ moduli) / known
        off = moduli - mean
        weigh = 0.5 * float(np.linalg.slogdet(inverse / (2 * np.pi))[1] + np.log(2 * np.pi / known))
        found[:, k] = log + weigh - 0.5 * float(off @ inverse @ off), mean, np.sqrt(1 / known)
    return found


def _slopes(each: _Tried) -> np.ndarray | None:
    """N/m of each way, at the share that leaves least; None of flat air."""
    fit = each.fits[0]
    if not fit.sloped:
        return None
    return fit.peak / fit.deep * np.array([one.values[2] for one in each.best[1]])


def _quantiles(middle: np.ndarray, error: np.ndarray, weight: np.ndarray) -> list[float]:
    """Median and 95 % interval, (low, middle, high), of a mixture of normal distributions."""
    kept = weight > 1e-5 * weight.max()
    middle, weight = middle[kept], weight[kept]
    error = np.maximum(error[kept], 1e-9 * np.abs(middle) + 1e-300)
    ends = float((middle - 5 * error).min()), float((middle + 5 * error).max())
    found = []
    for each in (0.025, 0.5, 0.975):
        low, high = ends
        for _ in range(50):
            half = 0.5 * (low + high)
            below = float(weight @ ndtr((half - middle) / error)) / float(weight.sum())
            low, high = (half, high) if below < each else (low, half)
        found.append(0.5 * (low + high))
    return found
