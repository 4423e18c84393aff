"""Where the gap is: shares along each axis, family-wise p values by sign flips of whole sites, worst
places."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from diagnose.forward import Forward
from diagnose.freeair import FreeAir
from mechanics.presses import HOLDING, LOADING, UNLOADING, Presses

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

    curves: name -> (x, mean, standard error) of the normal residual along depth, rate and time, for pictures.
    """

    axes: tuple[Axis, ...]
    worst: tuple[tuple[float, float, float, float], ...]
    site_rmse: np.ndarray
    curves: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]

    @property
    def leading(self) -> Axis:
        """The axis that the gap follows most: the largest share among those that are no chance.

        Places have a freedom each, so their share counts for 0.6 of its value.
        """
        real = [a for a in self.axes if a.p < 0.05] or list(self.axes)
        return max(real, key=lambda a: a.share * (0.6 if a.axis == "space" else 1.0))


def locate(
    forward: Forward, residual: np.ndarray, free: FreeAir | None, site_sd: np.ndarray, *, seed: int = 0
) -> Where:
    """residual: (n, 3) N, measured less the ideal model's force, local frames. site_sd: (p,) shape prior."""
    t = forward.touches
    contrasts = _contrasts(t, residual)
    p_values = _max_t(contrasts, t.sites, seed)
    p_values["space"] = _space(t, residual, site_sd)
    p_values["free_air"] = _free_p(free)
    shares = _shares(t, residual)
    shares["free_air"] = _free_share(t, residual, free)
    axes = tuple(Axis(a, float(np.clip(shares.get(a, 0.0), 0, 1)), float(p_values.get(a, 1.0))) for a in AXES)
    rmse = np.zeros(t.sites)
    for site in range(t.sites):
        rows = (t.site[t.press] == site) & t.counted
        rmse[site] = np.sqrt((residual[rows] ** 2).sum(axis=1).mean() + t.thinned_away)
    order = np.argsort(-rmse)[:5]
    worst = tuple((*map(float, t.site_point[s]), float(rmse[s])) for s in order)
    return Where(axes, worst, rmse, _curves(t, residual))


def _contrasts(t: Presses, residual: np.ndarray) -> dict[str, np.ndarray]:
    """(p,) per press: one signed number an axis (nan where the press cannot tell)."""
    out = {
        name: np.full(len(t), np.nan) for name in ("depth", "rate", "phase", "direction", "order", "repeat")
    }
    level = np.full(len(t), np.nan)
    for p in range(len(t)):
        rows = np.flatnonzero((t.press == p) & t.counted & (t.phase != 3))
        if len(rows) < 8:
            continue
        r, y, v, phase = residual[rows], t.y[rows, 0], t.speed[rows], t.phase[rows]
        force = max(np.abs(t.f[rows, 0]).max(), 1e-3)
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
        drag = t.y[rows, 1:] - t.y[rows[0], 1:]
        length = np.linalg.norm(drag, axis=1)
        if length.max() > 2e-4:
            out["direction"][p] = (r[:, 1:] * drag).sum() / (length.sum() * force)
    good = ~np.isnan(level)
    clock = (t.onset_s - t.onset_s[good].mean()) / max(t.onset_s.std(), 1e-9)
    out["order"] = level * clock
    for p in np.flatnonzero(t.repeat > 0):
        earlier = [q for q in range(p) if t.site[q] == t.site[p]]
        out["repeat"][p] = level[p] - np.nanmean(level[earlier])
    return out


def _slope(x: np.ndarray, y: np.ndarray) -> float:
    return float(x @ y / max(x @ x, 1e-12))


def _at_depth(shape: np.ndarray, r: np.ndarray, rows: np.ndarray) -> float:
    middle = rows & (shape > 0.25) & (shape < 0.92)
    return float(r[middle].mean()) if middle.any() else float(r[rows].mean())


def _max_t(contrasts: dict[str, np.ndarray], sites_count: int, seed: int) -> dict[str, float]:
    """Family-wise p of each contrast's mean: whole sites change sign together, the largest |t| counts."""
    rng = np.random.default_rng(seed)
    names = list(contrasts)
    values = np.stack([contrasts[n] for n in names], axis=1)
    fine = ~np.isnan(values)
    filled = np.where(fine, values, 0.0)
    count = np.maximum(fine.sum(axis=0), 1)

    def t_of(v: np.ndarray) -> np.ndarray:
        mean = v.sum(axis=0) / count
        spread = np.sqrt(np.maximum((v**2).sum(axis=0) / count - mean**2, 1e-18) / count)
        return np.abs(mean) / spread

    observed = t_of(filled)
    larger = np.zeros(len(names))
    for _ in range(FLIPS):
        signs = rng.choice([-1.0, 1.0], size=len(filled))
        larger += t_of(filled * signs[:, None]).max() >= observed - 1e-12
    result = dict(zip(names, (larger + 1) / (FLIPS + 1), strict=True))
    for i, name in enumerate(names):
        if fine[:, i].sum() < 5:
            result[name] = 1.0
    return result


def _levels(t: Presses, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(s,) relative residual of each site and its standard error from repeats and noise."""
    level, se = np.zeros(t.sites), np.zeros(t.sites)
    for site in range(t.sites):
        rows = (t.site[t.press] == site) & t.counted
        f = (t.f - residual)[rows, 0]
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


def _free_p(free: FreeAir | None) -> float:
    if free is None:
        return 1.0
    z = max(
        np.abs(free.bias_n).max() / free.bias_se_n,
        np.abs(free.rate_n_per_s).max() / free.rate_se_n_per_s,
        abs(free.mass_kg) / free.mass_se_kg,
    )
    return float(min(1.0, 7 * chi2.sf(z**2, 1)))


def _free_share(t: Presses, residual: np.ndarray, free: FreeAir | None) -> float:
    if free is None:
        return 0.0
    total = (residual[t.counted] ** 2).sum(axis=1).mean()
    return float((free.bias_n**2).sum() / max(total, 1e-12))


def _shares(t: Presses, residual: np.ndarray) -> dict[str, float]:
    """Share of the mean square that each axis's own patterns explain, alone, by least squares."""
    rows = np.flatnonzero(t.counted)
    r = residual[rows]
    f = (t.f - residual)[rows]
    normal = f[:, 0]
    press, y, v = t.press[rows], t.y[rows, 0], t.speed[rows]
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
    normal = residual[rows, 0]
    result = {}
    axes = {
        "depth (mm)": t.y[rows, 0] * 1e3,
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
            presses = np.unique(t.press[rows][inside])
            if len(presses) < 2:
                continue
            each = np.array([normal[inside & (t.press[rows] == p)].mean() for p in presses])
            centres.append(x[inside].mean())
            means.append(each.mean())
            errors.append(each.std() / np.sqrt(len(each)))
        result[name] = (np.array(centres), np.array(means), np.array(errors))
    return result
