"""Where a lump could be: balls on a grid inside the object, ranked by how well they explain the sites'
stiffness."""

from __future__ import annotations

import numpy as np

from diagnose.effects.inclusion import inside, softness
from diagnose.fields import energy_fields
from diagnose.fit import Fit, settings_of
from diagnose.forward import Forward

GRID_M = 0.007
RADII_M = (0.006, 0.010, 0.015)


def inclusion_starts(forward: Forward, base: Fit, site_sd: np.ndarray, most: int = 6) -> list[np.ndarray]:
    """Start vectors (centre, radius, log ratio) for a fit; also kept in forward.stages['inclusion_starts'].

    First order: the share of each place's give that lies in the ball, times how its force answers to its
    give, against each press's factor on the force, weighted by noise and shape prior, with a free common
    factor.
    """
    fields = energy_fields(forward)
    t = forward.touches
    rows = t.counted
    predicted = np.where(rows[:, None], t.f - base.residual, 0.0)
    residual = np.where(rows[:, None], base.residual, 0.0)

    def sums(a: np.ndarray) -> np.ndarray:
        return np.bincount(t.press, weights=a, minlength=len(t))

    power = np.maximum(sums(predicted[:, 0] ** 2), 1e-12)
    level = sums(predicted[:, 0] * residual[:, 0]) / power
    settings = settings_of(forward, base.effects, base.values, base.onset)
    step = 1.0
    settings.far = settings.far.copy()
    settings.far[:, 0, 0] += step
    moved = np.where(rows[:, None], forward.predict(settings), 0.0)
    answer = sums(predicted[:, 0] * (moved - predicted)[:, 0]) / power / step
    weight = 1 / (site_sd**2 + t.noise_n**2 / power + 0.015**2)
    give = fields.energy[:, :, 0, 0]
    blur = float(np.cbrt(np.median(fields.volume))) * 1.5
    low, high = fields.centroid.min(axis=0), fields.centroid.max(axis=0)
    axes = [np.arange(a + GRID_M / 2, b, GRID_M) for a, b in zip(low, high, strict=True)]
    centres = np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1).T
    near = np.linalg.norm(centres[:, None] - fields.centroid[None, ::4], axis=2).min(axis=1)
    centres = centres[near < GRID_M]
    found = []
    for radius in RADII_M:
        share = np.array([inside(fields.centroid, c, radius, blur) for c in centres], dtype=np.float32)
        pattern = (give @ share.T)[fields.place] * answer[:, None]
        for i, column in enumerate(pattern.T):
            x = np.stack([np.ones_like(column), column], axis=1)
            normal = x.T @ (weight[:, None] * x)
            if abs(np.linalg.det(normal)) < 1e-12:
                continue
            beta = np.linalg.solve(normal, x.T @ (weight * level))
            gain = 0.5 * beta @ (x.T @ (weight * level))
            # softness - 1 lies between -1.5 (hard) and 1.67 (void)
            effect = float(np.clip(beta[1], -1.2, 1.3))
            found.append((float(gain), centres[i], radius, effect))
    found.sort(key=lambda item: -item[0])
    starts: list[np.ndarray] = []
    for _, centre, radius, effect in found:
        if all(np.linalg.norm(centre - s[:3]) > 1.5 * GRID_M or abs(radius - s[3]) > 1e-6 for s in starts):
            starts.append(np.array([*centre, radius, _log_ratio(effect)]))
        if len(starts) == most:
            break
    forward.stages["inclusion_starts"] = starts
    return starts


def _log_ratio(change: float) -> float:
    grid = np.linspace(-1.8, 2.9, 200)
    return float(grid[np.argmin([abs(softness(np.exp(g)) - 1 - change) for g in grid])])
