"""Where the models of scenes are kept: a folder each, named by all that the model depends on."""

from __future__ import annotations

import hashlib
import json
import shutil
import warnings
from dataclasses import asdict
from pathlib import Path

from palpate.mechanics.disk.reading import reading
from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.disk.writing import atomic_folder
from palpate.mechanics.errors import FileError, ModelError, PalpateWarning, SceneError
from palpate.mechanics.model.files import FELT, MODEL, read_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.files import recording_files
from palpate.scenes.embedded import embedded_names, embedded_recording
from palpate.scenes.scene import Scene
from palpate.scenes.shipped import DamagedError, part_of, shipped_model, unpack

VERSION = 7


def kept_surface(scene: Scene, *, cache: Path | None = None) -> bytes | None:
    """What a tip meets in the scene's model, as its .vtp holds it; None where no model is kept or shipped."""
    path = folder_of(scene, cache)
    try:
        if (path / FELT).is_file():
            return (path / FELT).read_bytes()
        archive = shipped_model(path.name)
        return None if archive is None else part_of(archive, FELT)
    except (OSError, DamagedError):
        return None


def kept_model(path: Path, archive: Path | None) -> Model | None:
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
        with atomic_folder(folder_of(scene, cache), MODEL) as folder:
            shutil.copytree(model, folder, dirs_exist_ok=True)
    except OSError as error:
        raise SceneError(
            f"'{model}' cannot be kept ({error}): set PALPATE_CACHE to a folder of yours"
        ) from error


def folder_of(scene: Scene, cache: Path | None) -> Path:
    """The scene's folder in the cache, there or not."""
    return (cache or cache_folder()) / "scenes" / folder_name(scene)


def folder_name(scene: Scene) -> str:
    """Scenes of one object share a folder: its name is the object's and its content's, not the scene's."""
    return f"{Path(scene.source).name.split('.')[0]}-{_key(scene)}"


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
        return list(recording_files(recording_path(scene)))
    if scene.kind == "model":
        return [Path(scene.source) / "model.toml", Path(scene.source) / "mesh.vtu"]
    return [Path(scene.source)] if Path(scene.source).is_file() else []


def recording_path(scene: Scene) -> Path:
    """The recording that a scene names."""
    return embedded_recording(scene.source) if scene.source in embedded_names() else Path(scene.source)
