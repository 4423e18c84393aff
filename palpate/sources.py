"""What a command may name as MODEL_OR_SCENE: a MODEL folder, a scene file, or the name of an embedded
scene."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mechanics.model import Model, read_model
from mechanics.progress import Progress, silent

if TYPE_CHECKING:
    from render.options import RenderOptions
    from render.scene import TouchScene
    from render.support import SupportOptions
    from scenes.scene import Scene


def open_model(source: str | Path, progress: Progress = silent) -> Model:
    """The model of a folder or scene; raises ModelError or SceneError where there is none."""
    if Path(source).is_dir():
        return read_model(source)
    from scenes.build import model_of
    from scenes.scene import load_scene

    return model_of(load_scene(source), progress)


def open_scene(
    source: str | Path,
    renderer: str = "fem",
    options: RenderOptions | None = None,
    support: SupportOptions | None = None,
    progress: Progress = silent,
) -> TouchScene:
    """What a tip meets there: what `palpate touch` lets feel with the same options.

    Raises what `open_model` does, and OptionError for a renderer that is not there.
    """
    from render.felt import with_own_stiffness
    from render.options import RenderOptions
    from render.registry import create
    from render.scene import scene_of
    from scenes.scene import load_scene

    model = open_model(source, progress)
    options = with_friction(options or RenderOptions(), load_scene(source))
    made = create(renderer, model, options, progress)
    with_own_stiffness(made)
    return scene_of(made, support)


def with_friction(options: RenderOptions, scene: Scene) -> RenderOptions:
    """The renderers' options with the scene file's friction, where they have none of their own."""
    return options if options.friction is not None else replace(options, friction=scene.friction)
