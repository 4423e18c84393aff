"""A scene's object as a MODEL folder: meshed or reconstructed once, then kept (scenes.kept).

Meshing is not deterministic, and a model's compliance takes seconds.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.disk.mesh_parts import words_of
from palpate.mechanics.disk.surface_files import ClosedSurface
from palpate.mechanics.errors import SceneError
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.material import Ball, ObjectMaterial
from palpate.mechanics.model.model import Model, Tool
from palpate.mechanics.plausible import USUAL_POISSON_RATIO
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.recording.recording import read_recording
from palpate.mechanics.shape.flat_foot import HangingError, Standing, direction, standing
from palpate.scenes.kept import folder_of, kept_model, recording_path
from palpate.scenes.meshed import meshed
from palpate.scenes.phantoms import DEFAULT_MODULUS_PA, Region, phantom
from palpate.scenes.regions import flags_of, left_in, moduli_of, ratio_of
from palpate.scenes.scene import Scene, ball_of
from palpate.scenes.shipped import shipped_model


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
