"""Renderers compute the force on a tip at 1 kHz; `replay` and `press` make theirs here too."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import unknown
from palpate.mechanics.progress import Progress
from palpate.operations._call import Call
from palpate.operations._declare import Given, operation, option
from palpate.operations._shared import with_friction
from palpate.operations.load import load
from palpate.render.options import RenderOptions
from palpate.render.registry import create, names, simulator_names
from palpate.render.support import SupportOptions

if TYPE_CHECKING:
    from palpate.operations._shared import ModelLike
    from palpate.render.base import Renderer
    from palpate.render.scene import TouchScene


@operation()
def renderer(
    model: Annotated[ModelLike | Renderer, option("of which object")],
    name: Annotated[str, option(f"one of {', '.join(names())}")] = "fem",
    *,
    render: Given[RenderOptions],
    call: Call,
) -> Renderer:
    """The renderer of a model: `state = r.start()`, then `state, forces = r.step(state, tips)` at 1 kHz.

    tips (m, 3) m are the tips' centres, forces (m, 3) N act on the tool; device frame. The model's compliance
    is computed, some seconds, or read from its folder. Raises OptionError.
    """
    make = touched_scene(model, name, render, SupportOptions(), on_demand=False)
    with call.progress("renderer") as show_progress:
        return make(show_progress).renderer


def touched_scene(
    model: Any,
    name: str,
    given: Mapping[str, Any],
    support: SupportOptions,
    *,
    on_demand: bool = True,
) -> Callable[[Progress], TouchScene]:
    """What will make the renderer, on its model's support; its options are looked at at once. on_demand: see
    render.registry.create."""
    from palpate.render.base import Renderer
    from palpate.render.scene import scene_of
    from palpate.render.surface.felt_surface import with_own_stiffness

    if isinstance(model, Renderer):
        if given:
            words = "a renderer that is there keeps its options; give them to pp.renderer"
            raise OptionError(f"{', '.join(given)}: {words}")
        return lambda show_progress: scene_of(model, support)
    allowed = (*names(), *simulator_names())
    if name not in allowed:
        raise OptionError(unknown(name, "renderer", allowed))
    chosen = _with_scene(model, RenderOptions(**given))

    def make(show_progress: Progress) -> TouchScene:
        made = create(name, load(model, progress=show_progress), chosen, show_progress, on_demand=on_demand)
        if not on_demand and made.model.path is not None:
            with_own_stiffness(made)
        return scene_of(made, support)

    return make


def _with_scene(model: Any, options: RenderOptions) -> RenderOptions:
    """The options with what the scene's file says, where a scene was given."""
    from palpate.scenes.scene import Scene, load_scene

    scene = load_scene(model) if isinstance(model, str | Path) else model
    return with_friction(options, scene) if isinstance(scene, Scene) else options
