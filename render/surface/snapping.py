"""The contact surface drawn to the touched points: where a hand touched is better known than what lies
between.

A reconstructed surface smooths over the touches (mesh, primitive, hull), by a millimetre at worst; a soft
object of 300 N/m turns that into 0.3 N at the wrong time. The palpations say where the tip's centre was at
first touch; their gaps to the surface are spread as a Gaussian process (zero mean, so untouched regions stay
as modelled) and move the surface along its normals.
"""

from __future__ import annotations

import dataclasses
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.disk.store import content_key, load_or_build
from palpate.mechanics.law_errors import FirstTouch
from palpate.mechanics.model.model import Model
from palpate.render.options import RenderOptions
from palpate.render.surface.bvh import STACK, closest_triangle
from palpate.render.surface.contact import outside
from palpate.render.surface.contact_surface import (
    ContactSurface,
    SurfaceArrays,
    contact_surface,
    with_vertices,
)
from palpate.render.surface.shaped import rim_strip
from palpate.render.surface.walking import place

REACH_M = 0.012  # correlation length of shape errors: about a mesh edge
DOUBT_M = 1e-3  # their size
ONSET_NOISE_M = FirstTouch.felt_surface.value
LARGEST_M = 4e-3  # a palpation further off than this is no witness of the surface


def touched_surface(model: Model, options: RenderOptions) -> ContactSurface:
    """The model's contact surface: its shape where that is known; else the mesh's, through its palpations'
    first touches where the options ask for it. Kept in the model's folder, keyed by content; the last one in
    memory too, where all renderers of a model share it."""
    return _touched_surface(model, options.surface_edge_m, options.snap_to_touches)


@lru_cache(maxsize=1)
def _touched_surface(model: Model, edge_m: float, snap: bool) -> ContactSurface:
    drawn = snap and model.mesh.shape is None and len(model.presses) > 0
    if model.path is None:
        return _made(model, edge_m, drawn)
    mesh = model.mesh
    key = content_key(
        "contact surface 1",
        mesh.points,
        mesh.tetrahedra,
        mesh.fixed,
        mesh.touchable,
        "" if mesh.shape is None else f"turns at corners {mesh.shape.key}",
        float(edge_m),
        *([] if mesh.shape is None else [rim_strip(model.tool.tip_radius_m)]),
        *([model.presses.point, model.presses.normal, float(model.tool.tip_radius_m)] if drawn else []),
    )
    path = model.path / f"contact-{key[:16]}.bin"
    return ContactSurface.from_flat(load_or_build(path, key, lambda: _made(model, edge_m, drawn).flat()))


def _made(model: Model, edge_m: float, drawn: bool) -> ContactSurface:
    surface = contact_surface(model.mesh, edge_m=edge_m, strip_m=rim_strip(model.tool.tip_radius_m))
    if not drawn:
        return surface
    feet, normals, gaps = touch_gaps(surface.arrays, model)
    if not len(gaps):
        return surface
    arrays = surface.arrays
    covariance = DOUBT_M**2 * _kernel(feet, normals, feet, normals) + ONSET_NOISE_M**2 * np.eye(len(gaps))
    weights = np.linalg.solve(covariance, gaps)
    touched = np.unique(arrays.triangles[arrays.free > 0])
    vertices = arrays.vertices.copy()
    lift = DOUBT_M**2 * _kernel(vertices[touched], arrays.normals[touched], feet, normals) @ weights
    vertices[touched] += lift[:, None] * arrays.normals[touched]
    moved = with_vertices(vertices, arrays.triangles, arrays.neighbours, arrays.free)
    return dataclasses.replace(surface, arrays=moved)


def is_given(model: Model) -> bool:
    """Whether its shape is no measurement: a file's or a phantom's, not one that touches have placed."""
    return model.mesh.shape is not None and model.shape_uncertainty_m is None


def surface_uncertainty(model: Model, surface: ContactSurface) -> np.ndarray:
    """(v,) m, standard deviation of the fine vertices along their normals: the model's, less near touches.

    The model's shape uncertainty takes the place of the process's size DOUBT_M (which stands in where the
    model has none); a first touch is known to ONSET_NOISE_M. A shape that is given without one is the
    object's own, and so is what is felt of it.
    """
    arrays = surface.arrays
    own = model.shape_uncertainty_m
    if is_given(model):
        return np.zeros(len(arrays.vertices))
    if own is None:
        sd = np.full(len(arrays.vertices), DOUBT_M)
    else:
        sd = np.einsum("vc,vc->v", surface.node_weights, np.asarray(own, dtype=float)[surface.nodes])
    feet, normals, gaps = touch_gaps(arrays, model)
    if not len(gaps):
        return sd
    at_feet = sd[cKDTree(arrays.vertices).query(feet)[1]]
    covariance = np.outer(at_feet, at_feet) * _kernel(feet, normals, feet, normals)
    covariance += ONSET_NOISE_M**2 * np.eye(len(gaps))
    touched = np.unique(arrays.triangles[arrays.free > 0])
    shared = at_feet * _kernel(arrays.vertices[touched], arrays.normals[touched], feet, normals)
    explained = np.einsum("vk,kv->v", shared, np.linalg.solve(covariance, shared.T))
    sd[touched] *= np.sqrt(np.clip(1 - explained, 0.0, 1.0))
    return sd


def touch_gaps(arrays: SurfaceArrays, model: Model) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Feet (k, 3) m, normals (k, 3) and gaps (k,) m of the palpations whose tip met the surface within
    LARGEST_M.

    A gap is positive where the tip was still off the surface at first touch: there the surface lies further
    out.
    """
    feet, normals, gaps = [], [], []
    weights, stack = np.zeros(3), np.zeros(STACK, dtype=np.int64)
    point, normal = np.zeros(3), np.zeros(3)
    radius = model.tool.tip_radius_m
    for centre in model.presses.point + radius * model.presses.normal:
        if not np.isfinite(centre).all():
            continue
        triangle, distance = closest_triangle(
            arrays.bvh, arrays.vertices, arrays.triangles, centre, radius + LARGEST_M, weights, stack
        )
        if triangle < 0 or arrays.free[triangle] == 0 or not outside(arrays, triangle, weights, centre):
            continue
        place(arrays, triangle, weights, point, normal)
        if abs(distance - radius) < LARGEST_M:
            feet.append(point.copy())
            normals.append(normal.copy())
            gaps.append(distance - radius)
    return np.array(feet).reshape(-1, 3), np.array(normals).reshape(-1, 3), np.array(gaps)


def _kernel(a: np.ndarray, a_normals: np.ndarray, b: np.ndarray, b_normals: np.ndarray) -> np.ndarray:
    """Correlation of shape errors: near one another and facing alike, so that a rim separates its two
    sides."""
    squared = ((a[:, None] - b[None]) ** 2).sum(axis=2)
    facing = (1 + a_normals @ b_normals.T) / 2
    return np.exp(-squared / (2 * REACH_M**2)) * facing**4
