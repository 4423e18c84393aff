"""A scene's object as a MODEL folder: meshed or reconstructed once, then kept (scenes.kept).

Meshing is not deterministic, and a model's compliance takes seconds.

The model of a scene's shape: tetrahedra as small as it asks for and the machine affords, its presses.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.compliance.sites import SURFACE_EDGE_M
from palpate.mechanics.disk.mesh_parts import words_of
from palpate.mechanics.disk.surface_files import ClosedSurface
from palpate.mechanics.errors import PalpateWarning, SceneError
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.material import Ball, ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.plausible import USUAL_POISSON_RATIO, USUAL_TIP_RADIUS_M
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.recording.recording import read_recording
from palpate.mechanics.shape.flat_foot import HangingError, Standing, direction, standing
from palpate.mechanics.shape.refine import typical_edge, typical_wall
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.scenes.kept import folder_of, kept_model, recording_path
from palpate.scenes.phantoms import DEFAULT_MODULUS_PA, Region, phantom
from palpate.scenes.regions import flags_of, left_in, moduli_of, ratio_of
from palpate.scenes.scene import Scene, ball_of
from palpate.scenes.shipped import shipped_model
from palpate.scenes.virtual_presses import palpate_model, solver_of

MESH_SIZE_M, LEAST_EDGES, LEAST_ACROSS = 0.010, 8, 2
"""Edge length of the tetrahedra, and the least number of edges along an object and through its wall: one
across the 5 mm of a tube is 3 to 8 % too stiff, two lie within 1 % of three."""
_SIZES = 3
"""How many edge lengths are tried, each 1.3 times the one before, where the mesher takes too long."""


class CoarserMesh(PalpateWarning):
    """Tetrahedra are larger than what was asked for."""


def meshed(
    scene: Scene,
    stood: Standing,
    own: ObjectMaterial,
    provenance: dict[str, Any],
    progress: Progress,
    field: Callable[[TetMesh], np.ndarray] | None = None,
) -> Model:
    """The model of a shape that stands in its own frame; own: its material where the scene says nothing;
    field: (m,) modulus of a mesh's tetrahedra over the global one."""
    # here, and below: a model that is kept or shipped is opened without loading what makes one
    from palpate.reconstruction.shapes.drawing import decimated
    from palpate.reconstruction.steps.s4_surface import Surface
    from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions, mesh_surface
    from palpate.reconstruction.steps.s5_mesh.tetwild import (
        AFFORDABLE,
        AFFORDABLE_ASKED,
        MeshTooDear,
        affordable,
    )

    surface = Surface(
        vertices=stood.vertices,
        triangles=stood.triangles,
        uncertainty_m=np.zeros(len(stood.vertices)),
        support_point=stood.support_point,
        support_normal=stood.support_normal,
        method="known",
        reason="the shape is given",
        redraw=lambda edge_m: decimated(stood, edge_m),
        shape=TrueShape(stood.vertices, stood.triangles),
    )
    asked = scene.mesh_size_m or _usual_edge(stood)
    most = AFFORDABLE_ASKED if scene.mesh_size_m else AFFORDABLE
    edge = affordable(stood.vertices, stood.triangles, asked, most)
    for rest in reversed(range(_SIZES)):
        try:
            sized = MeshingOptions(mesh_size_m=edge)
            meshing = mesh_surface(surface, sized, lambda s, f: progress(s, 0.4 * f))
            break
        except MeshTooDear:
            if not rest:
                raise
            edge *= 1.3
    if edge > asked:
        warnings.warn(
            f"tetrahedra of {1e3 * asked:.3g} mm take too much memory or time for this object: "
            f"{1e3 * edge:.3g} mm are taken, --mesh-size {edge:.2g}",
            CoarserMesh,
            stacklevel=3,
        )
    mesh = meshing.mesh.quadratic()
    material = replace(
        own,
        field=field(mesh) if field else None,
        young_modulus_pa=scene.one_modulus_pa or own.young_modulus_pa,
        poisson_ratio=own.poisson_ratio if scene.poisson_ratio is None else scene.poisson_ratio,
        dent_law="neo-hookean" if scene.finite_strain else "linear",
    )
    model = Model(
        mesh=mesh,
        material=material,
        support=Support(surface.support_point, surface.support_normal),
        tool=Tool(scene.tip_radius_m or USUAL_TIP_RADIUS_M),
        mesh_size_m=edge,
        effects={"finite_strain": {}} if scene.finite_strain else {},
        provenance=provenance,
    )
    solver = solver_of(model)
    _tell_of_coarse_touches(typical_edge(solver.mesh))
    return palpate_model(model, lambda s, f: progress(s, 0.4 + 0.6 * f), solver=solver)


def _tell_of_coarse_touches(edge: float) -> None:
    """Warn where the surface of a large object, of edges of that length, m, is not halved to what a touch
    asks for."""
    if edge > SURFACE_EDGE_M:
        warnings.warn(
            f"the object is large: touches are solved on tetrahedra of {1e3 * edge:.2g} mm at its surface, "
            f"{1e3 * SURFACE_EDGE_M:g} mm on others: near a rim or the base forces may be 3 % off and "
            "more; cut out the part that is touched",
            CoarserMesh,
            stacklevel=4,
        )


def _usual_edge(stood: Standing) -> float:
    """Edge length, m, of the tetrahedra of a shape where none is asked for."""
    length = float(np.ptp(stood.vertices, axis=0).max())
    wall = typical_wall(stood.vertices, stood.triangles)
    return min(MESH_SIZE_M, length / LEAST_EDGES, wall / LEAST_ACROSS)


def model_of(
    scene: Scene, progress: Progress = silent, *, cache: Path | None = None, shipped: bool = True
) -> Model:
    """The scene's model, with a path; a MODEL folder about which the scene changes nothing is used itself.

    shipped: whether one that comes with the program is taken, where the cache has none.
    """
    if scene.kind == "model" and _own(scene):
        return read_model(scene.source)
    path = folder_of(scene, cache)
    kept = kept_model(path, shipped_model(path.name) if shipped else None)
    if kept is not None:
        return kept
    model = _MAKERS[scene.kind](scene, progress)
    _check_inside(model)
    try:
        write_model(path, model)
        return read_model(path)
    except OSError as error:
        raise SceneError(
            f"'{path}' cannot be written ({error}): set PALPATE_CACHE to a folder of yours"
        ) from error


def _own(scene: Scene) -> bool:
    changes = (scene.young_modulus_pa, scene.poisson_ratio, scene.tip_radius_m, scene.inclusions)
    return all(change is None for change in changes)


def _check_inside(model: Model) -> None:
    """Raises SceneError for a ball that lies wholly beside the object."""
    low, high = model.mesh.points.min(axis=0), model.mesh.points.max(axis=0)
    for name, ball in model.material.inclusions.items():
        centre = np.array(ball.centre_m)
        if (centre + ball.radius_m < low).any() or (centre - ball.radius_m > high).any():
            raise SceneError(
                f"the inclusion '{name}' at {centre.tolist()} m lies outside the object "
                f"({np.round(low, 4).tolist()} to {np.round(high, 4).tolist()} m): move it inside"
            )


def _from_phantom(scene: Scene, progress: Progress) -> Model:
    shape = phantom(scene.source)
    stood = Standing(shape.vertices, shape.faces, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    about = {"method": "scene", "phantom": shape.name, "shape": shape.shape}
    own = ObjectMaterial(
        young_modulus_pa=shape.young_modulus_pa,
        poisson_ratio=shape.poisson_ratio,
        inclusions=_balls(shape.regions if scene.inclusions is None else scene.inclusions),
    )
    return meshed(scene, stood, own, about, progress)


def model_of_mesh(shape: Any, scene: Scene, progress: Progress = silent) -> Model:
    """The model of a surface's file, or of a mesh with `vertices` and `faces` in the scene's unit, in its
    own frame.

    Raises SurfaceError where it is open or has no flat foot, OptionError where it has parts and the scene
    says no modulus of each.
    """
    from palpate.reconstruction.geometry.filled import solid_of

    surface = solid_of(shape, scene.unit, direction(scene.up))
    surface, stated = left_in(surface, scene.young_modulus_pa)
    scene = replace(scene, young_modulus_pa=stated)
    stood = _stood(surface, scene)
    moduli: dict[str, float] = {}
    if surface.parts or isinstance(scene.young_modulus_pa, Mapping):
        moduli = moduli_of(surface.parts, scene.young_modulus_pa, surface.name)
    if moduli:
        scene = replace(scene, young_modulus_pa=next(iter(moduli.values())))
    own = ObjectMaterial(DEFAULT_MODULUS_PA, USUAL_POISSON_RATIO, inclusions=_balls(scene.inclusions or ()))
    about = {
        "method": "scene",
        "mesh": surface.name,
        "mended": ", ".join(surface.notes),
        "parts": words_of(surface.parts, moduli),
        "modulus_of": next(iter(moduli), ""),
    }
    field = partial(ratio_of, parts=surface.parts, moduli=moduli) if moduli else None
    return meshed(scene, stood, own, about, progress, field)


def _stood(surface: ClosedSurface, scene: Scene) -> Standing:
    """The surface on its support; a refusal of parts that hang in the air names how they are left out."""
    try:
        return standing(surface, scene.up, scene.sink_m)
    except HangingError as error:
        if not error.parts:
            raise
        flags = flags_of(error.parts, "0")
        raise HangingError(f"{error}; or leave out what hangs, {flags}", error.parts) from error


def _balls(regions: Collection[Region]) -> dict[str, Ball]:
    balls = {region.name: ball_of(region) for region in regions}
    if len(balls) < len(regions):
        raise SceneError(
            f"inclusions need names of their own; these came: {', '.join(r.name for r in regions)}"
        )
    return balls


def _from_recording(scene: Scene, progress: Progress) -> Model:
    from palpate.reconstruction.pipeline import reconstruct

    return _changed(scene, reconstruct(read_recording(recording_path(scene)), progress=progress))


def _changed(scene: Scene, model: Model) -> Model:
    """What the scene says over what the model holds."""
    if scene.one_modulus_pa is not None:
        model = model.with_modulus(scene.one_modulus_pa)
    if scene.poisson_ratio is not None:
        model = model.with_material(poisson_ratio=scene.poisson_ratio)
    if scene.inclusions is not None:
        model = model.with_material(inclusions=_balls(scene.inclusions))
    tool = model.tool if scene.tip_radius_m is None else Tool(scene.tip_radius_m)
    return model.replaced(tool=tool, path=None)


_MAKERS = {
    "phantom": _from_phantom,
    "mesh": lambda scene, progress: model_of_mesh(scene.source, scene, progress),
    "recording": _from_recording,
    "model": lambda scene, progress: _changed(scene, read_model(scene.source)),
}
