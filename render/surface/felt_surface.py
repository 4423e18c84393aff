"""The surface that a tip meets, as a file beside the mesh: what is felt is what is seen.

MODEL/surface.vtp: the contact surface (rounded, drawn through the first touches) as triangles in the device
frame, metres. Point data: `uncertainty_m`, `touchable`, `own_stiffness_n_per_m` (NaN where nothing can be
touched). A reconstruction knows the far field at its touches only and spreads that; the first renderer whose
compliance is condensed presses every place instead (field data `stiffness_from` says which). Field data also
say which mesh, touches and material it was made from: a file of others is made anew.
"""

from __future__ import annotations

import json
import logging
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance
from palpate.mechanics.contact.touch import TouchedPlaces, touch_forces
from palpate.mechanics.disk.overheard import overheard
from palpate.mechanics.disk.store import content_key
from palpate.mechanics.disk.toml_text import plain
from palpate.mechanics.disk.vtk_files import vtk_bytes
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.model.files import FELT
from palpate.mechanics.model.model import Model
from palpate.render.base import Renderer
from palpate.render.effects import rendered_touch
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.render.surface.snapping import is_given, surface_uncertainty, touched_surface

_LOG = logging.getLogger(__name__)
OWN_DEPTH_M = 1e-3
"""Depth of the press by which a place's own stiffness is stated."""
PRESSES, TOUCHES = "presses", "touch sites"
_STEPS = 7
_PLACES = 2500


@dataclass(frozen=True)
class FeltSurface:
    """points, normals: (v, 3) m and unit, outward where touchable. triangles: (k, 3) outward, the base too.

    touchable: (v,) bool. uncertainty_m: (v,) standard deviation along the normal. own_stiffness_n_per_m: (v,)
    force over depth of a straight press to OWN_DEPTH_M with the model's tip, NaN where it is not known.
    stiffness_from: PRESSES, TOUCHES or ''.
    """

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    touchable: np.ndarray
    uncertainty_m: np.ndarray
    own_stiffness_n_per_m: np.ndarray
    stiffness_from: str = ""


def felt_surface(model: Model, sites: TouchSites | None = None) -> FeltSurface:
    """What a tip meets of a model, as its renderers have it: from its folder, or made and kept there.

    sites: touch sites of a reconstruction, which tell the own stiffness where nothing better is known yet.
    """
    surface = _load(model)
    if surface is not None and (surface.stiffness_from or sites is None):
        return surface
    surface = surface or _made(model)
    if sites is not None and len(sites):
        stiffness = np.where(surface.touchable, _from_touches(model, surface, sites), np.nan)
        surface = replace(surface, own_stiffness_n_per_m=stiffness, stiffness_from=TOUCHES)
    return _keep(model, surface)


def _from_touches(model: Model, surface: FeltSurface, sites: TouchSites) -> np.ndarray:
    """(v,) N/m, by the dent law and the far field and curvature of the touch sites, spread over the surface.

    Radial basis functions as for the 1D renderers' parameters (linear kernel), within the sites' range.
    """
    from scipy.interpolate import RBFInterpolator  # here: a press of a given shape needs none

    far = np.einsum("ka,kab,kb->k", sites.normals, sites.far, sites.normals)
    at_sites = np.column_stack([far, sites.curvature])
    scale = np.linalg.norm(np.ptp(surface.points, axis=0))
    spread = at_sites[[0] * len(surface.points)]
    if len(sites) > 1:
        smooth = RBFInterpolator(sites.points / scale, at_sites, kernel="linear", degree=0, smoothing=1e-3)
        spread = np.clip(smooth(surface.points / scale), at_sites.min(axis=0), at_sites.max(axis=0))
    depths = np.linspace(0.0, OWN_DEPTH_M, _STEPS)
    up = np.array([0.0, 0.0, 1.0])
    forces = touch_forces(
        np.tile(-depths[:, None] * up, (len(spread), 1)),
        _STEPS * np.arange(len(spread) + 1),
        TouchedPlaces(np.tile(up, (len(spread), 1)), spread[:, 0, None, None] * np.eye(3), spread[:, 1]),
        young_modulus_pa=model.material.young_modulus_pa,
        poisson_ratio=model.material.poisson_ratio,
        tip_radius_m=model.tool.tip_radius_m,
        law=rendered_touch(model, RenderOptions()).law_of_dent(model.material.poisson_ratio),
    )
    return forces[_STEPS - 1 :: _STEPS, 2] / OWN_DEPTH_M


def with_own_stiffness(renderer: Renderer) -> FeltSurface:
    """The felt surface of the renderer's model, its own stiffness computed where the folder has none.

    Only a finite-element renderer that knows all places tells a place's own stiffness; others leave the
    surface as it is.
    """
    surface = felt_surface(renderer.model)
    if not isinstance(renderer, FemRenderer) or surface.stiffness_from == PRESSES:
        return surface
    if not isinstance(renderer.compliance, SurfaceCompliance):
        return surface
    plain = RenderOptions()
    if replace(renderer.options, friction=plain.friction) != plain:
        return surface  # not the surface or the law that the model has by itself
    ideal = renderer.with_friction(rendered_touch(renderer.model, plain).friction)
    stiffness = local_stiffness(ideal, renderer.model.tool.tip_radius_m, OWN_DEPTH_M)
    made = replace(surface, own_stiffness_n_per_m=stiffness, stiffness_from=PRESSES)
    return _keep(renderer.model, made)


def local_stiffness(renderer: Renderer, tip_radius_m: float, depth_m: float) -> np.ndarray:
    """(v,) N/m: force over depth of a straight press to `depth_m` at each point of the renderer's surface.

    Pressed at about 2,500 places, and interpolated between them; NaN where nothing can be touched.
    """
    arrays = renderer.contact.arrays
    touchable = np.unique(arrays.triangles[arrays.free > 0])
    # a tip cannot press the rim of the base from outside the support
    pressed = np.setdiff1d(touchable, arrays.triangles[arrays.free == 0])
    chosen = pressed[:: max(1, len(pressed) // _PLACES)]
    depths = np.concatenate([[-0.002], np.linspace(0.0, depth_m, _STEPS)])
    values = np.empty(len(chosen))
    for i, k in enumerate(chosen):
        state = renderer.start([tip_radius_m], dt_s=10.0)
        # by steps, whose kernel the servo has compiled already
        for tip in arrays.vertices[k] + (tip_radius_m - depths)[:, None] * arrays.normals[k]:
            forces = renderer.step(state, tip[None])[1]
        values[i] = max(float(forces[0] @ arrays.normals[k]), 0.0) / depth_m
    distance, near = cKDTree(arrays.vertices[chosen]).query(arrays.vertices[touchable], k=min(4, len(chosen)))
    weight = 1.0 / np.maximum(distance.reshape(len(touchable), -1), 1e-6)
    result = np.full(len(arrays.vertices), np.nan)
    result[touchable] = (weight * values[near].reshape(weight.shape)).sum(axis=1) / weight.sum(axis=1)
    return result


def _made(model: Model) -> FeltSurface:
    surface = touched_surface(model, RenderOptions())
    arrays = surface.arrays
    touchable = np.zeros(len(arrays.vertices), dtype=bool)
    touchable[arrays.triangles[arrays.free > 0]] = True
    return FeltSurface(
        arrays.vertices,
        arrays.normals,
        arrays.triangles,
        touchable,
        surface_uncertainty(model, surface),
        np.full(len(touchable), np.nan),
    )


def _shape_key(model: Model) -> str:
    mesh = model.mesh
    sd = model.shape_uncertainty_m
    return content_key(
        "felt surface 3",
        mesh.points,
        mesh.tetrahedra,
        mesh.fixed,
        "" if mesh.shape is None else f"turns at corners {mesh.shape.key}",
        np.zeros(0) if sd is None else sd,
        np.hstack([model.presses.point, model.presses.normal]),
        float(model.tool.tip_radius_m),
    )


def _material_key(model: Model) -> str:
    return content_key(
        "own stiffness 4",
        OWN_DEPTH_M,
        float(model.material.young_modulus_pa),
        float(model.material.poisson_ratio),
        model.element_ratio,
        json.dumps(plain(model.effects), sort_keys=True),
        rendered_touch(model, RenderOptions()).law_of_dent(model.material.poisson_ratio).table,
    )


def _keep(model: Model, surface: FeltSurface) -> FeltSurface:
    """Write it into the model's folder, where there is one that may be written to."""
    import pyvista

    if model.path is None or not (Path(model.path) / "model.toml").is_file():
        return surface
    shape = pyvista.PolyData.from_regular_faces(surface.points, surface.triangles)
    shape.point_data["normals"] = surface.normals
    shape.point_data["touchable"] = surface.touchable.astype(np.uint8)
    shape.point_data["uncertainty_m"] = surface.uncertainty_m
    shape.point_data["own_stiffness_n_per_m"] = surface.own_stiffness_n_per_m
    shape.field_data["shape_key"] = [_shape_key(model)]
    shape.field_data["material_key"] = [_material_key(model)]
    shape.field_data["stiffness_from"] = [surface.stiffness_from]
    try:
        with atomic_file(Path(model.path) / FELT) as temporary:
            temporary.write_bytes(vtk_bytes(shape))
    except OSError as refused:  # a full or read-only disk: the surface in memory serves as well
        _LOG.info("'%s' is not kept: %s", Path(model.path) / FELT, refused)
    return surface


def _load(model: Model) -> FeltSurface | None:
    """What the model's folder holds; None where that is absent, damaged or of another mesh or touches."""
    import pyvista

    path = None if model.path is None else Path(model.path) / FELT
    if path is None or not path.is_file():
        return None
    try:
        # what a damaged file makes the reader say is an answer here, not a warning
        with overheard(_LOG), pyvista.VtkErrorCatcher(raise_errors=True):
            shape = pyvista.read(path)
        if str(shape.field_data["shape_key"][0]) != _shape_key(model):
            return None
        data = {name: np.asarray(shape.point_data[name]) for name in shape.point_data}
        stiffness = data["own_stiffness_n_per_m"].astype(float)
        source = str(shape.field_data["stiffness_from"][0])
        if str(shape.field_data["material_key"][0]) != _material_key(model):
            stiffness, source = np.full(len(stiffness), np.nan), ""
        return FeltSurface(
            np.asarray(shape.points, dtype=float),
            data["normals"].astype(float),
            np.asarray(shape.regular_faces, dtype=np.int64),
            data["touchable"] > 0,
            # a folder of before held a doubt of a shape that is the object's own
            np.where(is_given(model), 0.0, data["uncertainty_m"]).astype(float),
            stiffness,
            source,
        )
    except (AttributeError, KeyError, IndexError, RuntimeError, ValueError, OSError) as wrong:
        _LOG.info("'%s' is made anew: %s", path, wrong)
        return None
