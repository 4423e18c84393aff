"""Palpations of a model that nobody palpated, so that 1D renderers have parameters to interpolate.

Straight presses along the inward normal at spread places, force from the model itself
(mechanics.contact.touch), then the 1D models fitted to them as to recorded ones.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palpate.mechanics.compliance.sites import LoadPatch, touch_sites, touch_solver
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.errors import SceneError
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.making import of_paths
from palpate.mechanics.progress import Progress, silent

SITES = 32
DEPTH_M = 0.005
SPEED_M_PER_S = 0.02
RATE_HZ = 500.0
CLEARANCE_M = 0.008
"""Least height of a place over the support: a tip must get there."""
LEAST_FLATNESS = 0.9
"""Cosine between a place's normal and those of its triangles: rims are not pressed."""


def palpate_model(
    model: Model, progress: Progress = silent, *, sites: int = SITES, depth_m: float = DEPTH_M
) -> Model:
    """The model with a table of presses: one to `depth_m` at each of `sites` places."""
    from palpate.reconstruction.steps.s6_one_d.one_d import (  # here: a touch spreads places alone
        columns,
        fit_robust,
    )

    chosen = spread_places(model, sites)
    points, normals = model.mesh.points[chosen], model.normals[chosen]
    if model.mesh.shape is not None:
        points, normals = model.mesh.shape.foot(points, normals)
    nu, balls = model.material.poisson_ratio, tuple(model.material.inclusions.values())
    touched = touch_sites(
        model.mesh,
        points,
        normals,
        nu,
        solver=touch_solver(model.mesh, nu, model.ratio_without_balls, balls=balls),
        patch=LoadPatch(tip_radius_m=model.tool.tip_radius_m),
        progress=progress,
    )
    samples = max(8, round(depth_m / SPEED_M_PER_S * RATE_HZ))
    ramp = np.arange(1, samples) * (depth_m / samples)
    depth = np.concatenate([ramp, ramp[::-1]])
    paths = (-depth[None, :, None] * touched.normals[:, None, :]).reshape(-1, 3)
    starts = np.arange(len(chosen) + 1) * len(depth)
    forces = forces_at(
        touched,
        paths,
        starts,
        young_modulus_pa=model.material.young_modulus_pa,
        tip_radius_m=model.tool.tip_radius_m,
        law=model.material.dent_law,
    )
    centres = touched.points + model.tool.tip_radius_m * touched.normals
    presses = of_paths(
        starts,
        np.repeat(centres, len(depth), axis=0) + paths,
        forces,
        centres,
        touched.normals,
        tip_radius_m=model.tool.tip_radius_m,
        sample_rate_hz=RATE_HZ,
    )
    presses = replace(presses, depth_m=np.full(len(chosen), depth_m))
    fitted = columns(fit_robust(presses), np.full(len(chosen), model.material.young_modulus_pa))
    return model.replaced(presses=presses.with_fits(**fitted))


def spread_places(model: Model, count: int, *, clearance_m: float = CLEARANCE_M) -> np.ndarray:
    """(k,) touchable surface nodes, each farthest from those before; the first is the highest.

    Rims, and places near the support where a tip would not fit, are left out.
    """
    mesh = model.mesh
    height = model.support.height(mesh.points)
    triangles = mesh.touchable_surface[:, :3]
    corners = np.unique(triangles)
    flatness = np.ones(len(mesh.points))
    p = mesh.points[triangles]
    area = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    cosine = np.einsum("tkx,tx->tk", model.normals[triangles], area / np.linalg.norm(area, axis=1)[:, None])
    np.minimum.at(flatness, triangles, cosine)
    able = corners[
        mesh.touchable[corners] & (height[corners] > clearance_m) & (flatness[corners] > LEAST_FLATNESS)
    ]
    if not len(able):
        raise SceneError("the object has no smooth place above the support to press: use a finer mesh_size_m")
    chosen = [int(able[np.argmax(height[able])])]
    distance = np.linalg.norm(mesh.points[able] - mesh.points[chosen[0]], axis=1)
    while len(chosen) < min(count, len(able)):
        chosen.append(int(able[np.argmax(distance)]))
        distance = np.minimum(distance, np.linalg.norm(mesh.points[able] - mesh.points[chosen[-1]], axis=1))
    return np.array(chosen)
