"""A scene's object as a MODEL folder: meshed or reconstructed once, then kept.

Meshing is not deterministic, and a model's compliance takes seconds: both are kept in a cache folder under a
name made from everything that the model depends on.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.disk.mesh_parts import words_of
from palpate.mechanics.disk.reading import reading
from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.disk.writing import atomic_folder
from palpate.mechanics.errors import FileError, ModelError, PalpateWarning, SceneError
from palpate.mechanics.model.files import FELT, MODEL, read_model, write_model
from palpate.mechanics.model.material import Ball, ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.plausible import USUAL_POISSON_RATIO, USUAL_TIP_RADIUS_M
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.recording.files import recording_files
from palpate.mechanics.recording.recording import read_recording
from palpate.mechanics.shape.flat_foot import Standing, direction, standing
from palpate.mechanics.shape.refine import refined_near_surface, typical_edge, typical_wall
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.mechanics.shape.true_shape import TrueShape
from palpate.scenes.embedded import embedded_names, embedded_recording
from palpate.scenes.phantoms import DEFAULT_MODULUS_PA, Region, phantom
from palpate.scenes.regions import moduli_of, ratio_of
from palpate.scenes.scene import Scene, ball_of
from palpate.scenes.shipped import DamagedError, part_of, shipped_model, unpack
from palpate.scenes.virtual_presses import palpate_model

VERSION = 7
MESH_SIZE_M, LEAST_EDGES, LEAST_ACROSS = 0.010, 8, 2
"""Edge length of the tetrahedra, and the least number of edges along an object and through its wall: one
across the 5 mm of a tube is 3 to 8 % too stiff, two lie within 1 % of three."""
_SIZES = 3
"""How many edge lengths are tried, each 1.3 times the one before, where the mesher takes too long."""


class CoarserMesh(PalpateWarning):
    """Tetrahedra are larger than what was asked for."""


def model_of(
    scene: Scene, progress: Progress = silent, *, cache: Path | None = None, shipped: bool = True
) -> Model:
    """The scene's model, with a path; a MODEL folder about which the scene changes nothing is used itself.

    shipped: whether one that comes with the program is taken, where the cache has none.
    """
    if scene.kind == "model" and _own(scene):
        return read_model(scene.source)
    path = _folder(scene, cache)
    kept = _kept(path, shipped_model(path.name) if shipped else None)
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


def kept_surface(scene: Scene, *, cache: Path | None = None) -> bytes | None:
    """What a tip meets in the scene's model, as its .vtp holds it; None where no model is kept or shipped."""
    path = _folder(scene, cache)
    try:
        if (path / FELT).is_file():
            return (path / FELT).read_bytes()
        archive = shipped_model(path.name)
        return None if archive is None else part_of(archive, FELT)
    except (OSError, DamagedError):
        return None


def _kept(path: Path, archive: Path | None) -> Model | None:
    """The model in a folder of the cache, else out of its archive; None where it is to be made anew."""
    try:
        if (path / "model.toml").is_file():
            return read_model(path)
    except (ModelError, FileError):
        pass  # damaged
    try:
        if archive is not None:
            unpack(archive, path)
            return read_model(path)
    except DamagedError as error:
        warnings.warn(f"{error}; the model is made anew", PalpateWarning, stacklevel=3)
    except (ModelError, FileError):
        pass  # a folder that refuses: making it says why
    return None


def keep(scene: Scene, model: Path, *, cache: Path | None = None) -> None:
    """Take a MODEL folder that was made from the scene's recording, with its compliance, for the scene's.

    A scene that is touched next then opens at once. Raises SceneError where the cache cannot be written.
    """
    try:
        with atomic_folder(_folder(scene, cache), MODEL) as folder:
            shutil.copytree(model, folder, dirs_exist_ok=True)
    except OSError as error:
        raise SceneError(
            f"'{model}' cannot be kept ({error}): set PALPATE_CACHE to a folder of yours"
        ) from error


def _folder(scene: Scene, cache: Path | None) -> Path:
    return (cache or cache_folder()) / "scenes" / folder_name(scene)


def folder_name(scene: Scene) -> str:
    """Scenes of one object share a folder: its name is the object's and its content's, not the scene's."""
    return f"{Path(scene.source).name.split('.')[0]}-{_key(scene)}"


def _own(scene: Scene) -> bool:
    changes = (scene.young_modulus_pa, scene.poisson_ratio, scene.tip_radius_m, scene.inclusions)
    return all(change is None for change in changes)


def _key(scene: Scene) -> str:
    """A hash of what the model depends on: the description, and the content of the files that it names."""
    content = asdict(scene)
    for name in ("name", "title", "about", "mapper", "renderer", "beside", "colour", "friction", "find"):
        content.pop(name)
    files = _files(scene)
    if files:  # what is in them counts, not where they lie
        content.pop("source")
    digest = hashlib.sha256(json.dumps([VERSION, content], sort_keys=True).encode())
    for file in files:
        with reading(file, SceneError):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def _files(scene: Scene) -> list[Path]:
    if scene.kind == "recording":
        return list(recording_files(_recording_path(scene)))
    if scene.kind == "model":
        return [Path(scene.source) / "model.toml", Path(scene.source) / "mesh.vtu"]
    return [Path(scene.source)] if Path(scene.source).is_file() else []


def _recording_path(scene: Scene) -> Path:
    return embedded_recording(scene.source) if scene.source in embedded_names() else Path(scene.source)


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
    return _built(scene, stood, own, about, progress)


def _from_mesh(scene: Scene, progress: Progress) -> Model:
    return model_of_mesh(scene.source, scene, progress)


def model_of_mesh(shape: Any, scene: Scene, progress: Progress = silent) -> Model:
    """The model of a surface's file, or of a mesh with `vertices` and `faces` in the scene's unit, in its
    own frame.

    Raises SurfaceError where it is open or has no flat foot, OptionError where it has parts and the scene
    says no modulus of each.
    """
    from palpate.reconstruction.geometry.filled import solid_of

    surface = solid_of(shape, scene.unit, direction(scene.up))
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
    return _built(scene, standing(surface, scene.up, scene.sink_m), own, about, progress, field)


def _built(
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
    _tell_of_coarse_touches(mesh)
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
    return palpate_model(model, lambda s, f: progress(s, 0.4 + 0.6 * f))


def _tell_of_coarse_touches(mesh: TetMesh) -> None:
    """Warn where the surface of a large object is not halved to what a touch asks for."""
    from palpate.mechanics.compliance.sites import SURFACE_EDGE_M

    edge = typical_edge(refined_near_surface(mesh, SURFACE_EDGE_M)[0])
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


def _balls(regions: Collection[Region]) -> dict[str, Ball]:
    balls = {region.name: ball_of(region) for region in regions}
    if len(balls) < len(regions):
        raise SceneError(
            f"inclusions need names of their own; these came: {', '.join(r.name for r in regions)}"
        )
    return balls


def _from_recording(scene: Scene, progress: Progress) -> Model:
    from palpate.reconstruction.pipeline import reconstruct

    return _changed(scene, reconstruct(read_recording(_recording_path(scene)), progress=progress))


def _from_model(scene: Scene, progress: Progress) -> Model:
    return _changed(scene, read_model(scene.source))


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


_MAKERS = {"phantom": _from_phantom, "mesh": _from_mesh, "recording": _from_recording, "model": _from_model}
