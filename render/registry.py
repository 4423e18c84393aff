"""The renderers by name, and the module whose `create(name, model, options, progress)` makes each."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from palpate.mechanics.errors import OptionError
from palpate.mechanics.progress import Progress, silent
from palpate.render.options import RenderOptions

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model
    from palpate.render.base import Renderer

RENDERERS = {
    "fem": "palpate.render.fem.renderer",
    "kelvin-voigt": "palpate.render.one_d",
    "hunt-crossley": "palpate.render.one_d",
    "hunt-crossley-undamped": "palpate.render.one_d",
    "hunt-crossley-kh": "palpate.render.one_d",
}
"""Our own."""

_SIMULATORS = {
    "scikit-fem": "palpate.render.simulators.scikit_fem",
    "mujoco": "palpate.render.simulators.mujoco",
    "drake": "palpate.render.simulators.drake",
    "newton": "palpate.render.simulators.newton",
}
"""Other simulators, which need packages of their own and take their time."""


def names() -> tuple[str, ...]:
    """The names of our own renderers."""
    return tuple(RENDERERS)


def simulator_names() -> tuple[str, ...]:
    """The names of the other simulators that `create` takes."""
    return tuple(_SIMULATORS)


def check_settings(name: str, settings: str, numbers: str) -> None:
    """Raise OptionError for a simulator that is not installed, or for numbers (KEY=VALUE, comma separated)
    that its settings do not have, before any work."""
    from palpate.render.simulators.base import Adapter, changed, installed

    module = importlib.import_module(_SIMULATORS[name])
    for each in vars(module).values():
        if isinstance(each, type) and issubclass(each, Adapter) and each.__module__ == module.__name__:
            installed(each)
    changed(module.SETTINGS[settings], numbers)


def create(
    name: str,
    model: Model,
    options: RenderOptions | None = None,
    progress: Progress = silent,
    *,
    on_demand: bool = False,
    coarse: bool = False,
) -> Renderer:
    """The renderer of that name for a model; raises OptionError for a name that is not there.

    on_demand: for one tip's path, headless: our finite-element renderer solves only the places that it comes
    to. coarse: for a free hand at once; it renders what is kept of the compliance (render.fem.renderer).
    """
    known = {**RENDERERS, **_SIMULATORS}
    if name not in known:
        raise OptionError(f"'{name}' is no renderer; allowed are {', '.join(known)}")
    kept = {"on_demand": on_demand, "coarse": coarse} if name == "fem" else {}
    module = importlib.import_module(known[name])
    return module.create(name, model, options or RenderOptions(), progress, **kept)
