"""Shape as a cause: how far each site's stiffness may be off, and whether sites differ by more than that."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.options import NuisanceOptions
from palpate.diagnosis.search.fit import Fit
from palpate.mechanics.law_errors import Repeats, Stiffness
from palpate.mechanics.presses.table import Presses


def site_stiffness_sd(forward: Forward, options: NuisanceOptions) -> np.ndarray:
    """(p,) share by which a press's stiffness may be wrong: mesh and law, or the solution of its place, and
    the surface's own uncertainty."""
    touches, model = forward.touches, forward.model
    of_law = forward.law_error(options.site_stiffness)
    if model.shape_uncertainty_m is None:
        return of_law
    surface = np.flatnonzero(model.mesh.touchable)
    height = np.ptp(model.support.height(model.mesh.points))
    tree = cKDTree(model.mesh.points[surface])
    near = tree.query_ball_point(touches.point, 0.35 * height)
    spread = np.array(
        [np.sqrt(np.mean(model.shape_uncertainty_m[surface[i]] ** 2)) if len(i) else 0.0 for i in near]
    )
    return np.sqrt(of_law**2 + (Stiffness.surface.value * spread / height) ** 2)


def site_factors(found: Fit, touches: Presses) -> tuple[np.ndarray, np.ndarray]:
    """(s,) factor by which each site is stiffer than predicted, and its standard error (repeats and
    noise)."""
    factor, error = np.ones(touches.sites), np.ones(touches.sites)
    predicted = touches.local_force - found.residual
    for site in range(touches.sites):
        rows = (touches.site[touches.press] == site) & touches.counted
        f, r = predicted[rows].ravel(), found.residual[rows].ravel()
        power = max(f @ f, 1e-12)
        factor[site] = 1 + f @ r / power
        error[site] = np.sqrt(touches.noise_n**2 / power + Repeats.verdict.value**2)
    return factor, error


def repeat_scatter(residual: np.ndarray, touches: Presses) -> float:
    """N rms by which presses of one place differ in what they leave of their force; nan without repeats."""
    t = touches
    each = np.zeros(len(t))
    for press in range(len(t)):
        rows = (t.press == press) & t.counted
        f, r = (t.local_force[rows] - residual[rows]).ravel(), residual[rows].ravel()
        each[press] = f @ r / max(f @ f, 1e-12)
    factors = [
        each[own] - each[own].mean()
        for own in (np.flatnonzero(t.site == s) for s in range(t.sites))
        if len(own) > 1
    ]
    if not factors:
        return float("nan")
    spread = np.concatenate(factors)
    rms = t.force_rms_n
    return float(np.sqrt((spread**2).sum() / max(len(spread) / 2, 1)) * rms)


def heterogeneity(factor: np.ndarray, error: np.ndarray, prior: np.ndarray) -> tuple[float, float]:
    """(gain in log likelihood, spread) of letting sites differ by more than their prior (s,) allows."""
    log = np.log(np.clip(factor, 0.2, 5))
    log = log - np.median(log)

    def likelihood(extra: float) -> float:
        variance = prior**2 + error**2 + extra**2
        return float(-0.5 * (log**2 / variance + np.log(variance)).sum())

    grid = np.concatenate([[0.0], np.geomspace(0.005, 1.0, 60)])
    values = [likelihood(x) for x in grid]
    best = int(np.argmax(values))
    return values[best] - values[0], float(grid[best])
