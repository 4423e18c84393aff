"""The renderers by name, and the module whose `create(name, model, options, progress)` makes each; of another
simulator its adapter."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from palpate.mechanics.errors import OptionError
from palpate.mechanics.progress import Progress, silent
from palpate.render.options import RenderOptions

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model
    from palpate.render.base import Renderer
    from palpate.render.simulators.base import Adapter

RENDERERS = {
    "fem": "palpate.render.fem.renderer",
    "kelvin-voigt": "palpate.render.one_d",
    "hunt-crossley": "palpate.render.one_d",
    "hunt-crossley-undamped": "palpate.render.one_d",
    "hunt-crossley-kh": "palpate.render.one_d",
}
"""Our own."""

_SIMULATORS = {
    "scikit-fem": "palpate.render.simulators.scikit_fem:ScikitFem",
    "mujoco": "palpate.render.simulators.mujoco:MuJoCo",
    "drake": "palpate.render.simulators.drake:Drake",
    "newton": "palpate.render.simulators.newton:Newton",
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
    from palpate.render.simulators.base import changed, installed

    installed(adapter_of(name))
    changed(adapter_of(name).settings[settings], numbers)


def adapter_of(name: str) -> type[Adapter]:
    """The adapter of a simulator, installed or not."""
    module, _, kind = _SIMULATORS[name].partition(":")
    adapter: type[Adapter] = getattr(importlib.import_module(module), kind)
    return adapter


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
    options = options or RenderOptions()
    if name in _SIMULATORS:
        from palpate.render.simulators.base import SimulatorRenderer

        return SimulatorRenderer(name, model, adapter_of(name), options)
    kept = {"on_demand": on_demand, "coarse": coarse} if name == "fem" else {}
    return importlib.import_module(known[name]).create(name, model, options, progress, **kept)
