"""A scene's object as a MODEL folder: meshed or reconstructed once, then kept.

Meshing is not deterministic, and a model's compliance takes seconds: both are kept in a cache folder under a
name made from everything that the model depends on.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Collection
from dataclasses import asdict
from pathlib import Path

import numpy as np

from mechanics.errors import ModelError, SceneError
from mechanics.files import atomic_folder, cache_folder, reading
from mechanics.material import Ball, Material
from mechanics.model import MODEL, Model, Support, Tool, read_model, write_model
from mechanics.progress import Progress, silent
from mechanics.recording import read_recording, recording_files
from reconstruct.meshing import MeshingOptions, mesh_surface
from reconstruct.pipeline import reconstruct
from reconstruct.surface import Surface
from scenes.embedded import embedded_names, embedded_recording
from scenes.inclusions import ball_of
from scenes.phantoms import Region, phantom
from scenes.scene import Scene
from scenes.virtual_presses import palpate_model

VERSION = 5
DEFAULT_TIP_RADIUS_M = 0.005


def model_of(scene: Scene, progress: Progress = silent, *, cache: Path | None = None) -> Model:
    """The scene's model, with a path; a MODEL folder about which the scene changes nothing is used itself."""
    if scene.kind == "model" and _own(scene):
        return read_model(scene.source)
    path = _folder(scene, cache)
    if (path / "model.toml").is_file():
        try:
            return read_model(path)
        except ModelError:
            pass  # damaged: built again below
    model = _MAKERS[scene.kind](scene, progress)
    try:
        write_model(path, model)
        return read_model(path)
    except OSError as error:
        raise SceneError(
            f"'{path}' cannot be written ({error}): set PALPATE_CACHE to a folder of yours"
        ) from error


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
    return (cache or cache_folder()) / "scenes" / f"{scene.name}-{_key(scene)}"


def _own(scene: Scene) -> bool:
    changes = (scene.young_modulus_pa, scene.poisson_ratio, scene.tip_radius_m, scene.inclusions)
    return all(change is None for change in changes)


def _key(scene: Scene) -> str:
    """A hash of what the model depends on: the description, and the content of the files that it names."""
    content = asdict(scene)
    for name in ("name", "title", "about", "mapper", "renderer", "beside", "colour", "friction"):
        content.pop(name)
    digest = hashlib.sha256(json.dumps([VERSION, content], sort_keys=True).encode())
    for file in _files(scene):
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


def _from_phantom(scene: Scene, progress: Progress) -> Model:
    shape = phantom(scene.source)
    surface = Surface(
        vertices=shape.vertices,
        triangles=shape.faces,
        uncertainty_m=np.zeros(len(shape.vertices)),
        support_point=np.zeros(3),
        support_normal=np.array([0.0, 0.0, 1.0]),
        method="known",
        reason="the shape is given",
    )
    meshing = mesh_surface(
        surface, MeshingOptions(mesh_size_m=scene.mesh_size_m), lambda s, f: progress(s, 0.4 * f)
    )
    regions = shape.regions if scene.inclusions is None else scene.inclusions
    model = Model(
        mesh=meshing.mesh.quadratic(),
        material=Material(
            young_modulus_pa=scene.young_modulus_pa or shape.young_modulus_pa,
            poisson_ratio=shape.poisson_ratio if scene.poisson_ratio is None else scene.poisson_ratio,
            dent_law="neo-hookean" if scene.finite_strain else "linear",
            inclusions=_balls(regions),
        ),
        support=Support(surface.support_point, surface.support_normal),
        tool=Tool(scene.tip_radius_m or DEFAULT_TIP_RADIUS_M),
        mesh_size_m=scene.mesh_size_m,
        effects={"finite_strain": {}} if scene.finite_strain else {},
        provenance={"method": "scene", "phantom": shape.name, "shape": shape.shape},
    )
    return palpate_model(model, lambda s, f: progress(s, 0.4 + 0.6 * f))


def _balls(regions: Collection[Region]) -> dict[str, Ball]:
    balls = {region.name: ball_of(region) for region in regions}
    if len(balls) < len(regions):
        raise SceneError(
            f"inclusions need names of their own; these came: {', '.join(r.name for r in regions)}"
        )
    return balls


def _from_recording(scene: Scene, progress: Progress) -> Model:
    return _changed(scene, reconstruct(read_recording(_recording_path(scene)), progress=progress))


def _from_model(scene: Scene, progress: Progress) -> Model:
    return _changed(scene, read_model(scene.source))


def _changed(scene: Scene, model: Model) -> Model:
    """What the scene says over what the model holds."""
    if scene.young_modulus_pa is not None:
        model = model.with_modulus(scene.young_modulus_pa)
    if scene.poisson_ratio is not None:
        model = model.with_material(poisson_ratio=scene.poisson_ratio)
    if scene.inclusions is not None:
        model = model.with_material(inclusions=_balls(scene.inclusions))
    tool = model.tool if scene.tip_radius_m is None else Tool(scene.tip_radius_m)
    return model.replaced(tool=tool, path=None)


_MAKERS = {"phantom": _from_phantom, "recording": _from_recording, "model": _from_model}
