"""Models, by folder or scene, or from what already holds one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from palpate.mechanics.errors import OptionError
from palpate.operations._call import Call
from palpate.operations._declare import operation, option

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model
    from palpate.operations._shared import ModelLike


@operation()
def load(
    source: Annotated[
        ModelLike,
        option(
            'a folder that `reconstruct` wrote; the name of a scene ("demo", "nodule", "bean", ...), a '
            'scene\'s .toml, a phantom ("cylinder", ..., or a closed surface as STL, PLY or VTU in m), or a '
            "recording, which is then reconstructed"
        ),
    ],
    *,
    call: Call,
) -> Model:
    """The model of a MODEL folder; or of a scene, which is built the first time and then kept.

    Moduli Pa, lengths m, device frame. Raises ModelError or SceneError where there is none.
    """
    from palpate.mechanics.model.files import read_model
    from palpate.mechanics.model.model import Model as Plain
    from palpate.scenes.build import model_of as scene_model
    from palpate.scenes.scene import Scene, load_scene

    if isinstance(source, Plain):
        return source
    held = getattr(source, "model", None)
    if isinstance(held, Plain):
        return held
    if isinstance(source, str | Path):
        if Path(source).is_dir():
            return read_model(source)
        source = load_scene(source)
    if not isinstance(source, Scene):
        raise OptionError(f"a {type(source).__name__} is no model: give one, a MODEL folder or a scene")
    with call.progress("load") as show_progress:
        return scene_model(source, show_progress)
