"""The renderers by name, and the module whose `create(name, model, options, progress)` makes each."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from mechanics.errors import OptionError
from mechanics.progress import Progress, silent
from render.options import RenderOptions

if TYPE_CHECKING:
    from mechanics.model import Model
    from render.base import Renderer

_RENDERERS = {
    "fem": "render.fem",
    "kelvin-voigt": "render.one_d_laws",
    "hunt-crossley": "render.one_d_laws",
    "hunt-crossley-undamped": "render.one_d_laws",
    "hunt-crossley-kh": "render.one_d_laws",
}


def names() -> tuple[str, ...]:
    """The names that `create` takes."""
    return tuple(_RENDERERS)


def create(
    name: str, model: Model, options: RenderOptions | None = None, progress: Progress = silent
) -> Renderer:
    """The renderer of that name for a model; raises OptionError for a name that is not there."""
    if name not in _RENDERERS:
        raise OptionError(f"'{name}' is no renderer; allowed are {', '.join(_RENDERERS)}")
    module = importlib.import_module(_RENDERERS[name])
    return module.create(name, model, options or RenderOptions(), progress)
