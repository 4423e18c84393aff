"""Shape as a cause: how far each site's stiffness may be off, and whether sites differ by more than that."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.options import NuisanceOptions
from palpate.diagnosis.search.fit import Fit
from palpate.mechanics.contact.edges import nearness
from palpate.mechanics.law_errors import Repeats
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.geometry.known_shape import OPEN
from palpate.render.force_error import SURE, law_share, way_aside


def site_stiffness_sd(forward: Forward, options: NuisanceOptions) -> np.ndarray:
    """(p,) share by which a press's stiffness may be wrong: mesh and law, or the solution of its place, and
    the surface's own uncertainty."""
    of_law = forward.law_error(options.law_bound * bound_sd(forward))
    return np.hypot(of_law, options.surface * surface_error(forward))


def surface_error(forward: Forward) -> np.ndarray:
    """(p,) standard error of the surface about each press, over the object's height; 0 where it is known."""
    touches, model = forward.touches, forward.model
    if model.shape_uncertainty_m is None:
        return np.zeros(len(touches))
    surface = np.flatnonzero(model.mesh.touchable)
    height = np.ptp(model.support.height(model.mesh.points))
    tree = cKDTree(model.mesh.points[surface])
    near = tree.query_ball_point(touches.point, 0.35 * height)
    of = model.shape_uncertainty_m[surface]
    return np.array([np.sqrt(np.mean(of[i] ** 2)) if len(i) else 0.0 for i in near]) / height


def stands_open(model: Model) -> str:
    """That a registered shape may stand so otherwise that its base tells nothing, in words; '' where not."""
    open_m = float(model.about.get("geometry", {}).get("surface_sd_p95_m", 0.0))
    if open_m <= OPEN * float(np.linalg.norm(np.ptp(model.mesh.points, axis=0))):
        return ""
    return (
        f"how the shape stands is open by {1e3 * open_m:.0f} mm, which looks like a base that gives or is "
        "loose: trace the table or touch its other faces, to tell"
    )


def bound_sd(forward: Forward) -> np.ndarray:
    """(p,) one standard deviation of the bound that the law carries at each press, of a shallow dent, as a
    share of the force (render.force_error.law_share)."""
    t, places, model = forward.touches, forward.places, forward.model
    sideways = way_aside(places.far[:, 0, 0], np.linalg.norm(places.far[:, 1:, 0], axis=1), t.tip_radius_m)
    bent = np.abs(places.curvature) * t.tip_radius_m
    rim, base = nearness(model.mesh, t.point, t.normal)
    ratio = model.material.poisson_ratio
    return law_share(np.zeros(len(t)), bent, sideways, rim, base, poisson_ratio=ratio) / SURE


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
