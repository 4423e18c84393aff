"""Places of a zoo's shape, and what presses there say on meshes of two sizes, by Hertz and by the solver."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import palpate as pp
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.model.model import Model, Tool
from palpate.mechanics.shape.nearest import farthest_apart, first_hits, sample
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.render.base import Renderer
from palpate.render.force_error import thickness_under
from palpate.render.registry import create

TIP_M, DEEPEST_M, LEAST_M = 5e-3, 2e-3, 1e-4
_TIP_SHARE, _DEPTH_SHARE = 0.12, 0.12
"""Of the object's least extent: its tip; of what lies under a place: its depth, at most DEEPEST_M."""
_HERTZ_SHARE, _HERTZ_RADII = 0.4, 0.1
"""Of the tip by which Hertz is asked; and how deep, radii."""
_THICK, _GENTLE, _RIM = 75.0, 0.1, 20.0
"""Hertz applies where the object is so many times thicker than that contact is wide, bends by less than this
over that tip, has no crease or support nearer than so many contact radii, and is pressed towards its support
within 30 degrees: pressed on its side a body of 30 mm bends, which takes a tenth off."""


@dataclass(frozen=True)
class Places:
    """points, normals (k, 3); thickness (k,) m along the inward normal; curvature (k,) 1/m, mean, convex
    positive; upright (k,) cosine between the normal and the support's; creased (k,) m to the nearest surface
    of another direction, or the support; tip_m of them all, depth_m (k,)."""

    points: np.ndarray
    normals: np.ndarray
    thickness: np.ndarray
    curvature: np.ndarray
    upright: np.ndarray
    creased: np.ndarray
    tip_m: float
    depth_m: np.ndarray

    @property
    def hertz_tip_m(self) -> float:
        """m, of the tip by which Hertz is asked."""
        return _HERTZ_SHARE * self.tip_m

    @property
    def hertz(self) -> np.ndarray:
        """(k,) bool: where Hertz applies."""
        tip = self.hertz_tip_m
        contact = tip * np.sqrt(_HERTZ_RADII)
        thick, far = self.thickness > _THICK * contact / 2, self.creased > _RIM * contact
        upright = self.upright > np.cos(np.radians(30))
        return upright & thick & far & (np.abs(self.curvature) * tip < _GENTLE)


def tip_of(model: Model) -> float:
    """m, the radius of the tip by which an object is pressed."""
    shape = model.mesh.shape
    assert shape is not None
    return min(TIP_M, _TIP_SHARE * float(np.ptp(shape.vertices, axis=0).min()))


def places_of(model: Model, count: int, seed: int = 5) -> Places:
    """Places spread over a model's shape where a tip gets to them from outside."""
    shape, up = model.mesh.shape, model.support.normal
    assert shape is not None
    tip = tip_of(model)
    points, normals = shape.foot(sample(shape.vertices, shape.triangles, 60 * count, seed))
    height = model.support.height(points)
    from_above = np.einsum("kx,x->k", normals, up) > -0.3
    # the tip, and the rod behind it, come from outside
    free = first_hits(shape.vertices, shape.triangles, points + 0.2 * tip * normals, normals)[0] > 8 * tip
    able = np.flatnonzero(free & from_above & (height + tip * (normals @ up - 1) > 0.6 * tip))
    able = able[farthest_apart(points[able], count)]
    points, normals = points[able], normals[able]
    under = thickness_under(shape, points, normals, tip)
    thickness = np.where(np.isfinite(under), under, 0.0)
    bends = shape.curvatures(points, normals, tip)[0].mean(axis=1) if len(points) else np.zeros(0)
    depth = np.clip(_DEPTH_SHARE * thickness, LEAST_M, min(DEEPEST_M, 0.4 * tip))
    creased = np.minimum(_to_others(shape, points, normals), model.support.height(points))
    return Places(points, normals, thickness, bends, normals @ up, creased, tip, depth)


def _to_others(shape: TrueShape, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(k,) m to the nearest surface that looks another way by more than 30 degrees: beyond a crease, or
    where bodies cross."""
    there, facing = shape.foot(sample(shape.vertices, shape.triangles, 6000, 0))
    away = np.linalg.norm(points[:, None] - there, axis=2)
    away[normals @ facing.T > np.cos(np.radians(30))] = np.inf
    return away.min(axis=1) if len(points) else np.zeros(0)


def renderer_of(model: Model, tip_m: float) -> Renderer:
    """One for that tip that solves the places that it comes to, as `palpate press --tip-radius` does."""
    return create("fem", replace(model, tool=Tool(tip_m)), on_demand=True)


def pressed(
    renderer: Renderer, places: Places, k: int, *, exact: bool = False, hertz: bool = False
) -> tuple[Any, str]:
    """The curve of a press at place k, or None and what the refusal said."""
    tip = places.hertz_tip_m if hertz else places.tip_m
    depth = _HERTZ_RADII * tip if hertz else float(places.depth_m[k])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            curve = pp.press(
                renderer, at=places.points[k], direction=-places.normals[k], depth_m=depth,
                speed_m_per_s=depth / 0.1, approach_m=tip / 4, tip_radius_m=tip, exact=exact,
            )  # fmt: skip
    except PalpateError as error:
        return None, str(error)
    if curve.on_support:
        return None, "the support came first"
    first = curve.position[int(np.argmax(curve.depth > 0))]
    off = float(np.linalg.norm(first - places.points[k] - tip * places.normals[k]))
    return (curve, "") if off < 0.3 * tip else (None, "another place came first")


def over_hertz(curve: Any, places: Places, k: int, model: Model) -> float:
    """Normal force over Hertz's, of a sphere on a surface of the place's mean curvature."""
    tip, material = places.hertz_tip_m, model.material
    stiffness = material.young_modulus_pa / (1 - material.poisson_ratio**2)
    around = 1 / (1 / tip + places.curvature[k])
    known = 4 / 3 * stiffness * np.sqrt(around) * float(curve.depth.max()) ** 1.5
    return float(curve.force[curve.deepest] @ curve.normal) / known


def compare(models: list[Model], count: int, solved: int) -> dict[str, Any]:
    """What presses say on models of one shape, the first of the default size. solved: places of it that are
    solved too."""
    places = places_of(models[0], count)
    renderers = [renderer_of(model, places.tip_m) for model in models]
    forces = np.full((len(models), len(places.points)), np.nan)
    bound = np.full(len(places.points), np.nan)
    said, hertz, exact, unsettled = [], [], [], 0
    for k in range(len(places.points)):
        for m, renderer in enumerate(renderers):
            curve, words = pressed(renderer, places, k)
            if curve is None:
                said.append(words)
                continue
            unsettled += curve.unsettled
            forces[m, k] = float(np.linalg.norm(curve.force[curve.deepest]))
            if m == 0:
                bound[k] = curve.error_figures["force_error_n"] / max(forces[m, k], 1e-12)
        if places.hertz[k]:
            curve, words = pressed(renderers[0], places, k, hertz=True)
            if curve is not None:
                hertz.append(over_hertz(curve, places, k, models[0]))
    for k in np.flatnonzero(np.isfinite(forces[0]))[:solved]:
        curve, words = pressed(renderers[0], places, int(k), exact=True)
        place = None if curve is None else curve.exact
        if place is None:
            said.append(words)
            continue
        exact.append([1 - place.solved_n[-1] / place.law_n[-1], place.error_n[-1] / place.law_n[-1]])
    pressed_both = np.isfinite(forces).all(axis=0)
    sizes = forces[1:, pressed_both] / forces[0, pressed_both] - 1
    return {
        "places": len(places.points), "pressed": int(np.isfinite(forces[0]).sum()), "said": sorted(set(said)),
        "least_force_n": float(np.nanmin(forces)) if np.isfinite(forces).any() else None,
        "unsettled": unsettled, "between_sizes": sizes.ravel().tolist(),
        "stated_share": np.broadcast_to(bound[pressed_both], sizes.shape).ravel().tolist(),
        "over_hertz": hertz, "over_solver": exact, "tip_mm": 1e3 * places.tip_m,
        "depth_mm": (1e3 * places.depth_m).tolist(),
    }  # fmt: skip
