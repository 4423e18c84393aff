"""What the diagnosis is measured against: the best in-sample fit, and a regression that names nothing."""

from __future__ import annotations

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.search.attribution import Attribution


def best_by_bic(found: Attribution) -> str:
    """The single effect (or 'none') with the least Bayesian information criterion in sample."""
    samples = found.base.dof
    best, name = found.base.found.loss, "none"
    for score in found.scores.values():
        extra = len(score.candidate.found.values) - len(found.base.found.values)
        criterion = score.candidate.found.loss + 0.5 * extra * np.log(samples)
        if criterion < best:
            best, name = criterion, score.name
    return name


def regressed_gap(forward: Forward, residual: np.ndarray, penalty: float = 1.0) -> float:
    """Held-out rms (N) of the thinned residual after a ridge regression on place, depth, rate and history.

    residual: (n, 3) N, local frames, of the ideal model. Sites are left out one at a time; 40 features:
    products of depth, speed, time since touch, lagged depths and place, times the predicted force.
    """
    t = forward.touches
    rows = np.flatnonzero(t.counted)
    r = residual[rows]
    f = (t.local_force - residual)[rows, 0]
    deepest = max(t.deepest.max(), 1e-6)
    depth = np.clip(t.travel[rows, 0], 0, None) / deepest
    speed = t.speed[rows] / max(np.abs(t.speed[rows]).max(), 1e-9)
    since = np.clip(t.t[rows] - t.onset_s[t.press[rows]], 0, 3)
    lags = [np.clip(np.roll(t.travel[:, 0], k)[rows], 0, None) / deepest for k in (2, 5, 10)]
    place = (t.point[t.press[rows]] - t.point.mean(axis=0)) / max(t.point.std(), 1e-9)
    base = [np.ones_like(f), depth, depth**2, speed, speed**2, since, *lags, *place.T]
    features = np.stack([b * f for b in base] + base[1:] + [depth * speed, speed * since], axis=1)
    features = features / np.maximum(features.std(axis=0), 1e-9)
    site = t.site[t.press[rows]]
    total = 0.0
    gram, side = features.T @ features, features.T @ r
    for s in np.unique(site):
        held = site == s
        x, y = features[held], r[held]
        weight = np.linalg.solve(gram - x.T @ x + penalty * np.eye(x.shape[1]), side - x.T @ y)
        total += ((y - x @ weight) ** 2).sum()
    return float(np.sqrt(total / len(rows) + t.thinned_away))
