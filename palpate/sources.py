"""What a command may name as MODEL_OR_SCENE: a MODEL folder, a scene file, or the name of an embedded
scene."""

from __future__ import annotations

from pathlib import Path

from mechanics.model import Model, read_model
from mechanics.progress import Progress, silent


def open_model(source: str | Path, progress: Progress = silent) -> Model:
    """The model of a folder or scene; raises ModelError or SceneError where there is none."""
    if Path(source).is_dir():
        return read_model(source)
    from scenes.build import model_of
    from scenes.scene import load_scene

    return model_of(load_scene(source), progress)
