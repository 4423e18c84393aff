"""Palpations of a model that nobody palpated, so that 1D renderers have parameters to interpolate.

Straight presses along the inward normal at spread places, force from the model itself
(mechanics.contact.touch), then the 1D models fitted to them as to recorded ones.

A whole exploration of a model by the simulated hand: the base traced on the support, then palpations.

The path is where the hand *means* to be; what it touches pushes it back. Geometry only: lengths in m, the
model's frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from palpate.devices.intention import HandPath
from palpate.devices.virtual_hand import LONGEST_CATCH_UP_S
from palpate.mechanics.compliance.near_field import surface_softness
from palpate.mechanics.compliance.patch import half_space_compliance
from palpate.mechanics.compliance.sites import LoadPatch, touch_sites, touch_solver
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.errors import SceneError
from palpate.mechanics.model.model import Model
from palpate.mechanics.options import option
from palpate.mechanics.presses.making import of_paths
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.shape.nearest import closest

SITES = 32
DEPTH_M = 0.005
SPEED_M_PER_S = 0.02
RATE_HZ = 500.0
CLEARANCE_M, CLEARANCE_SHARE = 0.008, 0.5
"""Least height of a place over the support, where a tip must get; of a lower object so much of its height."""
LEAST_FLATNESS = 0.9
"""Cosine between a place's normal and those of its triangles: rims are not pressed."""


def solver_of(model: Model) -> Solver:
    """The solver of touches on the model, balls and all."""
    balls = tuple(model.material.inclusions.values())
    return touch_solver(
        model.mesh, model.material.poisson_ratio, model.surface_ratio, balls=balls,
        stretch_m=model.stretch_m,
    )  # fmt: skip


def palpate_model(
    model: Model,
    progress: Progress = silent,
    *,
    sites: int = SITES,
    depth_m: float = DEPTH_M,
    solver: Solver | None = None,
) -> Model:
    """The model with a table of presses: one to `depth_m` at each of `sites` places. solver: `solver_of` it,
    where the caller has it."""
    from palpate.reconstruction.steps.s6_one_d import (  # here: a touch spreads places alone
        columns,
        fit_robust,
    )

    chosen = spread_places(model, sites)
    points, normals = model.mesh.points[chosen], model.normals[chosen]
    if model.mesh.shape is not None:
        points, normals = model.mesh.shape.foot(points, normals)
    nu = model.material.poisson_ratio
    touched = touch_sites(
        model.mesh,
        points,
        normals,
        nu,
        solver=solver or solver_of(model),
        patch=LoadPatch(tip_radius_m=model.tool.tip_radius_m, balls=bool(model.material.inclusions)),
        progress=progress,
    )
    # over the modulus of what the tip meets, of which the dent is, as the renderer has it
    soft = surface_softness(model.mesh, model.surface_ratio, touched.points, model.tool.tip_radius_m)
    within = (1 - soft)[:, None, None] * half_space_compliance(touched.normals, nu, touched.patch_width_m)
    touched = replace(touched, far=(touched.far + within) / soft[:, None, None])
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
    forces /= np.repeat(soft, len(depth))[:, None]
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
    fitted = columns(fit_robust(presses), model.material.young_modulus_pa / soft)
    return model.replaced(presses=presses.with_fits(**fitted))


def spread_places(model: Model, count: int, *, clearance_m: float = CLEARANCE_M) -> np.ndarray:
    """(k,) touchable surface nodes, each farthest from those before; the first is the highest.

    Rims, and places near the support where a tip would not fit, are left out.
    """
    mesh = model.mesh
    height = model.support.height(mesh.points)
    clearance_m = min(clearance_m, CLEARANCE_SHARE * float(height.max()))
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
        raise SceneError(
            "the object has no smooth place above the support to press, each node lies on a rim: use "
            f"--mesh-size {model.mesh_size_m / 2:.2g}"
        )
    chosen = [int(able[np.argmax(height[able])])]
    distance = np.linalg.norm(mesh.points[able] - mesh.points[chosen[0]], axis=1)
    while len(chosen) < min(count, len(able)):
        chosen.append(int(able[np.argmax(distance)]))
        distance = np.minimum(distance, np.linalg.norm(mesh.points[able] - mesh.points[chosen[-1]], axis=1))
    return np.array(chosen)


ANGLES = 180
UNFELT_S = 2 * LONGEST_CATCH_UP_S
"""In free air at first: so far a hand may have gone when the loop that it feels begins, late before its first
pose and once more after it."""


@dataclass(frozen=True)
class ExplorationOptions:
    """How the simulated hand explores. Depths are meant; a soft hand reaches less."""

    sites: int = option(16, "places to press")
    repeats: int = option(2, "presses of each place")
    least_depth_m: float = option(0.003, "shallowest press", unit="m")
    most_depth_m: float = option(0.006, "deepest press", unit="m")
    press_speed_m_per_s: float = option(0.015, "mean speed of a press", unit="m/s")
    travel_speed_m_per_s: float = option(0.20, "mean speed in free air", unit="m/s")
    tracing_speed_m_per_s: float = option(0.03, "speed along the base", unit="m/s")
    turns: float = option(1.1, "turns around the base")
    lean_m: float = option(0.0002, "how far the tracing leans into the object", unit="m")
    bear_down_m: float = option(0.0004, "how far the tracing presses into the support", unit="m")
    clearance_m: float = option(0.010, "distance from the surface between presses", unit="m")


def explore(
    model: Model,
    options: ExplorationOptions | None = None,
    *,
    hand_stiffness_n_per_m: float = 600.0,
    seed: int = 0,
) -> tuple[HandPath, float]:
    """The hand's path and the time, s, at which the tracing ends (phase I).

    hand_stiffness_n_per_m: the hand means to go deeper by its own give under about 1 N.
    """
    options = options or ExplorationOptions()
    random = np.random.default_rng(seed)
    trace = base_tracing(model, options)
    # from beside the object: what begins in a wall is not felt until it has left it
    out = trace[0] - trace.mean(axis=0)
    beside = trace[0] + options.clearance_m * out / np.linalg.norm(out)
    times, points = [0.0], [beside + 0.03 * model.support.normal]
    _rest(times, points, UNFELT_S)
    _go(times, points, beside, options.travel_speed_m_per_s)
    _go(times, points, trace[0], options.tracing_speed_m_per_s)
    for point in trace[1:]:
        _go(times, points, point, options.tracing_speed_m_per_s)
    traced_s = times[-1]
    high = _top(model) + 0.02
    _go(times, points, _raised(model, points[-1], high), options.travel_speed_m_per_s)
    for place in _sites(model, options):
        n, centre = (
            model.normals[place],
            model.mesh.points[place] + model.tool.tip_radius_m * model.normals[place],
        )
        before = centre + options.clearance_m * n
        _go(times, points, _raised(model, before, high), options.travel_speed_m_per_s)
        _go(times, points, before, options.travel_speed_m_per_s)
        for _ in range(options.repeats):
            depth = random.uniform(options.least_depth_m, options.most_depth_m)
            speed = options.press_speed_m_per_s * random.uniform(0.6, 1.6)
            give = 1.0 / hand_stiffness_n_per_m
            _go(times, points, centre - (depth + give) * n, speed)
            _rest(times, points, random.uniform(0.1, 0.3))
            _go(times, points, before, 1.5 * speed)
            _rest(times, points, 0.15)
        _go(times, points, _raised(model, before, high), options.travel_speed_m_per_s)
    return HandPath(np.array(times), np.array(points), even=True), traced_s


def base_tracing(model: Model, options: ExplorationOptions) -> np.ndarray:
    """(k, 3) places of the tip's centre around the object's foot, on the support, more than a full turn.

    Along each ray from the base's middle, the outermost place whose distance to the surface is the tip's
    radius less the lean; raises SceneError where the object cannot be gone around.
    """
    mesh = model.mesh
    up = model.support.normal
    e1 = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(up, e1)
    triangles = mesh.surface[:, :3]
    base = mesh.points[mesh.fixed]
    middle = base.mean(axis=0)
    middle += (model.tool.tip_radius_m - options.bear_down_m - model.support.height(middle)) * up
    turn = np.linspace(0.0, 2 * np.pi, ANGLES, endpoint=False)
    rays = np.cos(turn)[:, None] * e1 + np.sin(turn)[:, None] * e2
    wanted = model.tool.tip_radius_m - options.lean_m
    far = np.linalg.norm(mesh.points - middle, axis=1).max() + 2 * model.tool.tip_radius_m
    reach = np.full(ANGLES, far)
    for _ in range(60):  # sphere tracing inwards: a step of the distance itself never passes the surface
        centres = middle + reach[:, None] * rays
        gap = np.linalg.norm(closest(mesh.points, triangles, centres)[0] - centres, axis=1) - wanted
        reach = reach - gap
        if (reach < 0).any():
            raise SceneError("the object's foot cannot be traced: its base does not surround its middle")
        if np.abs(gap).max() < 1e-6:
            break
    circle = middle + reach[:, None] * rays
    count = int(np.ceil(options.turns * ANGLES)) + 1
    return circle[np.arange(count) % ANGLES]


def _top(model: Model) -> float:
    return float(model.support.height(model.mesh.points).max())


def _raised(model: Model, point: np.ndarray, height_m: float) -> np.ndarray:
    up = model.support.normal
    return point + (height_m - model.support.height(point)) * up


def _sites(model: Model, options: ExplorationOptions) -> np.ndarray:
    clearance = 2.0 * model.tool.tip_radius_m + options.clearance_m
    return spread_places(model, options.sites, clearance_m=clearance)


def _go(times: list[float], points: list[np.ndarray], to: np.ndarray, speed_m_per_s: float) -> None:
    duration = float(np.linalg.norm(to - points[-1])) / speed_m_per_s
    if duration > 0:
        times.append(times[-1] + duration)
        points.append(np.asarray(to, dtype=float))


def _rest(times: list[float], points: list[np.ndarray], duration_s: float) -> None:
    times.append(times[-1] + duration_s)
    points.append(points[-1])
