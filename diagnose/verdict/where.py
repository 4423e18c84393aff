"""Where the gap is: shares along each axis, family-wise p values by sign flips of whole sites, worst
places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.instrument.free_air import FreeAir
from palpate.mechanics.presses.gap_bins import gap_by_bin
from palpate.mechanics.presses.table import HOLDING, LOADING, UNLOADING, Presses

AXES = ("depth", "rate", "phase", "direction", "space", "order", "repeat", "free_air")
FLIPS = 2000


@dataclass(frozen=True)
class Axis:
    """One axis: share of the gap's mean square that its pattern explains (0 to 1), family-wise p value."""

    axis: str
    share: float
    p: float


@dataclass(frozen=True)
class Where:
    """axes: in the contract's order. worst: (x, y, z, rmse_n) of the sites, worst first. site_rmse: (s,) N.

    bins: N rms of the gap that the verdict states (mechanics.presses.gap_bins); beside `press_n` each press's
    `press_s`, s of its first touch, and `site`.
    curves: name -> (x, mean over sites, its error) of the normal residual along depth, rate and time, for
    pictures.
    """

    axes: tuple[Axis, ...]
    worst: tuple[tuple[float, float, float, float], ...]
    site_rmse: np.ndarray
    bins: dict[str, list[float]]
    curves: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]

    @property
    def leading(self) -> Axis:
        """The axis that the gap follows most: the largest share among those that are no chance.

        Places have a freedom each, so their share counts for 0.6 of its value.
        """
        real = [a for a in self.axes if a.p < 0.05] or list(self.axes)
        return max(real, key=lambda a: a.share * (0.6 if a.axis == "space" else 1.0))


def locate(
    forward: Forward,
    residual: np.ndarray,
    free: FreeAir | None,
    site_sd: np.ndarray,
    stated: np.ndarray,
    *,
    seed: int = 0,
) -> Where:
    """residual: (n, 3) N, measured less the ideal model's force, local frames. site_sd: (p,) shape prior.
    stated: (n,) N^2, the verdict's own gap (diagnose.verdict.stated)."""
    t = forward.touches
    contrasts = _contrasts(t, residual)
    p_values = family_wise(contrasts, t.site, seed)
    p_values["space"] = _space(t, residual, site_sd)
    p_values["free_air"] = 1.0 if free is None else free.p
    shares = _shares(t, residual)
    shares["free_air"] = _free_share(t, residual, free)
    axes = tuple(Axis(a, float(np.clip(shares.get(a, 0.0), 0, 1)), float(p_values.get(a, 1.0))) for a in AXES)
    rmse = np.zeros(t.sites)
    for site in range(t.sites):
        rows = (t.site[t.press] == site) & t.counted
        rmse[site] = np.sqrt((residual[rows] ** 2).sum(axis=1).mean() + t.thinned_away)
    order = np.argsort(-rmse)[:5]
    worst = tuple(
        (float(x), float(y), float(z), float(rmse[s])) for s in order for x, y, z in [t.site_point[s]]
    )
    return Where(axes, worst, rmse, _bins(t, stated), _curves(t, residual))


def _bins(t: Presses, stated: np.ndarray) -> dict[str, list[float]]:
    rows = t.counted
    bins = gap_by_bin(stated[rows], t.press[rows], len(t), t.travel[rows, 0], t.phase[rows], t.t[rows])
    return {"press_s": t.onset_s.round(3).tolist(), "site": t.site.tolist(), **bins}


def _contrasts(t: Presses, residual: np.ndarray) -> dict[str, np.ndarray]:
    """(p,) per press: one signed number an axis (nan where the press shows nothing of it)."""
    out = {
        name: np.full(len(t), np.nan) for name in ("depth", "rate", "phase", "direction", "order", "repeat")
    }
    level = np.full(len(t), np.nan)
    for p in range(len(t)):
        rows = np.flatnonzero((t.press == p) & t.counted & (t.phase != 3))
        if len(rows) < 8:
            continue
        r, y, v, phase = residual[rows], t.travel[rows, 0], t.speed[rows], t.phase[rows]
        force = max(np.abs(t.local_force[rows, 0]).max(), 1e-3)
        level[p] = r[:, 0].mean() / force
        shape = y / max(y.max(), 1e-4)
        out["depth"][p] = _slope(shape - shape.mean(), r[:, 0]) / force
        out["rate"][p] = (r[:, 0] * v).mean() / (force * np.sqrt((v**2).mean() + 1e-12))
        load, unload = phase == LOADING, phase == UNLOADING
        if load.sum() > 2 and unload.sum() > 2:
            out["phase"][p] = (_at_depth(shape, r[:, 0], load) - _at_depth(shape, r[:, 0], unload)) / force
        hold = phase == HOLDING
        if hold.sum() > 8:
            half = np.flatnonzero(hold)
            a, b = half[: len(half) // 2], half[len(half) // 2 :]
            decay = (r[a, 0].mean() - r[b, 0].mean()) / force
            out["phase"][p] = decay if np.isnan(out["phase"][p]) else out["phase"][p] + decay
        drag = t.travel[rows, 1:] - t.travel[rows[0], 1:]
        length = np.linalg.norm(drag, axis=1)
        if length.max() > 2e-4:
            out["direction"][p] = (r[:, 1:] * drag).sum() / (length.sum() * force)
    good = ~np.isnan(level)
    clock = (t.onset_s - t.onset_s[good].mean()) / max(t.onset_s.std(), 1e-9)
    out["order"] = level * clock
    for again in np.flatnonzero(t.repeat > 0):
        earlier = [q for q in range(again) if t.site[q] == t.site[again]]
        out["repeat"][again] = level[again] - np.nanmean(level[earlier])
    return out


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    return float(x @ y / max(x @ x, 1e-12))


def _at_depth(shape: np.ndarray, r: np.ndarray, rows: np.ndarray) -> float:
    middle = rows & (shape > 0.25) & (shape < 0.92)
    return float(r[middle].mean()) if middle.any() else float(r[rows].mean())


def family_wise(contrasts: dict[str, np.ndarray], site: np.ndarray, seed: int) -> dict[str, float]:
    """Family-wise p of each contrast's mean: whole sites change sign together, the largest |t| counts.

    contrasts: name -> (p,) a signed number a press, nan where it has none; site: (p,) its site. Presses of
    one site share that place's errors, so a site is one draw. A contrast that fewer than 5 sites have is 1.
    """
    names = list(contrasts)
    values = np.stack([contrasts[n] for n in names], axis=1)
    fine = ~np.isnan(values)
    sums, counted = np.zeros((2, site.max() + 1, len(names)))
    np.add.at(sums, site, np.where(fine, values, 0.0))
    np.add.at(counted, site, fine)
    counted = counted > 0
    count = np.maximum(counted.sum(axis=0), 1)
    square = (sums**2).sum(axis=0)

    def t_of(total: np.ndarray) -> np.ndarray:
        """|t| of sites' sums; signs do not change their squares."""
        return np.abs(total) / np.sqrt(np.maximum(square - total**2 / count, 1e-18))

    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(FLIPS, len(sums)))
    largest = t_of(signs @ sums).max(axis=1)
    larger = (largest[:, None] >= t_of(sums.sum(axis=0)) - 1e-12).sum(axis=0)
    p = np.where(counted.sum(axis=0) < 5, 1.0, (larger + 1) / (FLIPS + 1))
    return dict(zip(names, map(float, p), strict=True))


def _levels(t: Presses, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(s,) relative residual of each site and its standard error from noise."""
    level, se = np.zeros(t.sites), np.zeros(t.sites)
    for site in range(t.sites):
        rows = (t.site[t.press] == site) & t.counted
        f = (t.local_force - residual)[rows, 0]
        power = max(f @ f, 1e-9)
        level[site] = f @ residual[rows, 0] / power
        se[site] = t.noise_n / np.sqrt(power)
    return level, se


def _space(t: Presses, residual: np.ndarray, site_sd: np.ndarray) -> float:
    level, se = _levels(t, residual)
    prior = np.array([site_sd[t.site == s].mean() for s in range(t.sites)])
    weight = 1 / (prior**2 + se**2 + 0.01**2)
    centred = level - (weight @ level) / weight.sum()
    return float(chi2.sf((weight * centred**2).sum(), t.sites - 1))


def _free_share(t: Presses, residual: np.ndarray, free: FreeAir | None) -> float:
    if free is None:
        return 0.0
    total = (residual[t.counted] ** 2).sum(axis=1).mean()
    return float((free.bias_n**2).sum() / max(total, 1e-12))


def _shares(t: Presses, residual: np.ndarray) -> dict[str, float]:
    """Share of the mean square that each axis's own patterns explain, alone, by least squares."""
    rows = np.flatnonzero(t.counted)
    r = residual[rows]
    f = (t.local_force - residual)[rows]
    normal = f[:, 0]
    press, y, v = t.press[rows], t.travel[rows, 0], t.speed[rows]
    depth = np.clip(y, 0, None)
    total = (r**2).sum()
    floor = 3 * len(rows) * t.noise_n**2
    signal = max(total - floor, 1e-12)
    scale = max(depth.max(), 1e-4)
    rate = v / max(np.abs(v).max(), 1e-6)
    fdot = np.gradient(normal)
    clock = (t.t[rows] - t.t[rows].mean()) / max(np.ptp(t.t[rows]), 1e-9)
    site = t.site[press]
    since = t.t[rows] - t.onset_s[press]
    patterns = {
        "depth": [normal * (depth / scale) ** k for k in (0, 1, 2)],
        "rate": [normal * rate, normal * np.abs(rate), fdot],
        "phase": [normal * (t.phase[rows] == k) for k in (0, 1, 2)] + [normal * since],
        "order": [normal, normal * clock],
        "repeat": [normal * (t.repeat[press] == 0), normal * (t.repeat[press] > 0)],
        "space": [normal * (site == s) for s in range(t.sites)],
    }
    shares = {}
    for name, columns in patterns.items():
        x = np.stack(columns, axis=1)
        weight = np.linalg.lstsq(x, r[:, 0], rcond=None)[0]
        shares[name] = ((x @ weight) ** 2).sum() / signal
    shares["direction"] = max((r[:, 1:] ** 2).sum() - 2 * floor / 3, 0.0) / signal
    return shares


def _curves(t: Presses, residual: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    rows = np.flatnonzero(t.counted)
    normal, site = residual[rows, 0], t.site[t.press[rows]]
    result = {}
    axes = {
        "depth (mm)": t.travel[rows, 0] * 1e3,
        "speed of pressing (mm/s)": t.speed[rows] * 1e3,
        "time since first touch (s)": t.t[rows] - t.onset_s[t.press[rows]],
        "clock (s)": t.t[rows],
    }
    for name, x in axes.items():
        edges = np.quantile(x, np.linspace(0.01, 0.99, 13))
        bins = np.digitize(x, edges)
        centres, means, errors = [], [], []
        for b in range(1, len(edges)):
            inside = bins == b
            sites = np.unique(site[inside])
            if len(sites) < 2:
                continue
            each = np.array([normal[inside & (site == s)].mean() for s in sites])
            centres.append(x[inside].mean())
            means.append(each.mean())
            errors.append(each.std(ddof=1) / np.sqrt(len(each)))
        result[name] = (np.array(centres), np.array(means), np.array(errors))
    return result
