"""Models: read, built from a shape, reconstructed, exported."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanics.errors import OptionError
from mechanics.progress import Progress
from palpate.api.reading import read_recording
from palpate.api.telling import told
from palpate.keywords import taken

if TYPE_CHECKING:
    from mechanics.model import Model
    from palpate.api.telling import ModelLike, RecordingLike
    from reconstruct.pipeline import Reconstruction


def load(source: ModelLike, *, progress: bool | Progress = True) -> Model:
    """The model of a MODEL folder; or of a scene, which is built the first time and then kept.

    source: a folder that `reconstruct` wrote; the name of a scene ("demo", "nodule", "bean", ...), a scene's
    .toml, a phantom ("cylinder", ..., or a closed surface as STL, PLY or VTU in m), or a recording, which is
    then reconstructed. progress: True draws a bar where stderr is a terminal. Raises ModelError or SceneError
    where there is none.
    """
    from mechanics.model import Model
    from mechanics.model_files import read_model
    from scenes.build import model_of as scene_model
    from scenes.scene import Scene, load_scene

    if isinstance(source, Model):
        return source
    held = getattr(source, "model", None)
    if isinstance(held, Model):
        return held
    if isinstance(source, str | Path):
        if Path(source).is_dir():
            return read_model(source)
        source = load_scene(source)
    if not isinstance(source, Scene):
        raise OptionError(f"a {type(source).__name__} is no model: give one, a MODEL folder or a scene")
    with told("load", progress) as tell:
        return scene_model(source, tell)


def model_of(
    shape: Any,
    young_modulus_pa: float | None = None,
    *,
    unit: str = "m",
    up: str = "+z",
    sink_m: float = 0.0,
    poisson_ratio: float | None = None,
    tip_radius_m: float | None = None,
    mesh_size_m: float | None = None,
    save: str | Path | None = None,
    progress: bool | Progress = True,
) -> Model:
    """The model of an object whose shape is known, in the frame of its file.

    shape: an STL, OBJ, PLY, glTF, VTP, VTU, MSH or INP file with lengths in `unit` ("m", "cm", "mm", "um",
    "in"), or a triangle mesh with `vertices` and `faces` (trimesh's). young_modulus_pa: None takes 20 kPa.
    up: out of the support, "+z", "-x", ... or "X,Y,Z" in the file's frame; sink_m: cut off flat at the
    bottom. poisson_ratio: None takes 0.49; tip_radius_m: 5 mm; mesh_size_m: 10 mm, or an eighth of the
    object. save: MODEL folder to write. Raises SurfaceError where the surface is open or has no flat foot.
    """
    from dataclasses import replace as changed

    from mechanics.files import check_target
    from mechanics.model_files import MODEL
    from scenes.build import model_of_mesh
    from scenes.scene import Scene

    if save is not None:
        check_target(save, MODEL)
    scene = Scene("mesh", "mesh", "", unit=unit, up=up, sink_m=sink_m, mesh_size_m=mesh_size_m)
    scene = changed(
        scene, young_modulus_pa=young_modulus_pa, poisson_ratio=poisson_ratio, tip_radius_m=tip_radius_m
    )
    for name in ("young_modulus_pa", "tip_radius_m", "mesh_size_m"):
        value = getattr(scene, name)
        if value is not None and not value > 0:
            raise OptionError(f"{name} is {value}; it must be greater than 0")
    with told("model", progress) as tell:
        made = model_of_mesh(shape, scene, tell)
    return made if save is None else made.save(save)


def reconstruct(
    recording: RecordingLike,
    *,
    method: str = "finite-tip",
    save: str | Path | None = None,
    seed: int = 0,
    progress: bool | Progress = True,
    **options: Any,
) -> Reconstruction:
    """A recording becomes a model: contacts, base, surface, tetrahedra, Young's modulus, 1D models.

    method: "finite-tip", or "paper" for Goksel et al.'s own. save: MODEL folder to write, where what is
    computed for the model later is kept too. options: see `pp.options("reconstruct")`; lengths m, forces N.
    The result goes wherever a model goes. Raises OptionError, ContactError, SurfaceError or MeshError.
    """
    from mechanics.files import check_target
    from mechanics.model_files import MODEL
    from reconstruct.pipeline import ReconstructOptions, reconstruct_fully
    from render.felt import felt_surface

    given = taken("reconstruct", {"method": method, **options})
    if save is not None:
        check_target(save, MODEL)
    steps: dict[str, Any] = {
        field.name: kind(**values)
        for field in dataclasses.fields(ReconstructOptions)
        for kind, values in given.items()
        if field.default_factory is kind
    }
    chosen = ReconstructOptions(**given[ReconstructOptions], **steps, seed=seed)
    with told("reconstruct", progress) as tell:
        made = reconstruct_fully(read_recording(recording), chosen, tell)
    if save is not None:
        made = dataclasses.replace(made, model=made.model.save(save))
        felt_surface(made.model, made.sites)
    return made


def export(
    model: ModelLike,
    to: str,
    path: str | Path,
    *,
    at: Sequence[float] | None = None,
    depth_m: float | None = None,
    unit: str = "m",
    progress: bool | Progress = True,
) -> tuple[str, ...]:
    """Write a model for another program: a minimal scene that runs there, or its mesh.

    to: "mujoco" (.xml), "sofa" (.scn), "abaqus" (.inp), "gmsh" (.msh) or "stl"; path: the file to write.
    at: (3,) m, where the scene's tip presses, None is the middle of the top; depth_m: how deep, None is half
    the tip's radius.
    unit: of an STL's lengths; all else is in SI units and the model's frame. Returns what the format cannot
    say, one line each. progress: a bar while a scene is built. Raises OptionError for an unknown format or a
    place that misses the object, FileError where the file cannot be written.
    """
    import numpy as np

    from palpate.exporting.registry import write

    plain = load(model, progress=progress)
    return write(plain, to, path, at=None if at is None else np.asarray(at), depth_m=depth_m, unit=unit)
