"""The renderers of the window's process, which draw and are compared: what the user changes, they follow.

A second renderer beside the one that is felt: the same tip drives it, at every tick of the servo.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.render.base import Renderer
from palpate.render.options import RenderOptions
from palpate.render.registry import create
from palpate.render.scene import TouchScene
from palpate.render.surface.felt_surface import with_own_stiffness
from palpate.servo.source import FieldChange
from palpate.window.inclusion import InclusionMover
from palpate.window.worker import RendererView


class DrawnRenderers:
    """Renderers of one model by name, each made when it is first asked for.

    options: of those that are made from now on. young_modulus_pa: of all of them.
    """

    def __init__(self, model: Model, options: RenderOptions, inclusion: InclusionMover) -> None:
        self.options = options
        self.young_modulus_pa = model.material.young_modulus_pa
        self._model, self._inclusion = model, inclusion
        self._made: dict[str, Renderer] = {}

    def create(self, name: str, progress: Progress = silent) -> Renderer:
        """One as the user has changed it so far, not kept."""
        made = self._inclusion.laid_on(create(name, self._model, self.options, progress, coarse=True))
        changed = self.young_modulus_pa != self._model.material.young_modulus_pa
        return made.with_modulus(self.young_modulus_pa) if changed else made

    def load(self, name: str, progress: Progress = silent) -> Renderer:
        """The one of this name."""
        if name not in self._made:
            self._made[name] = self.create(name, progress)
        return self._made[name]

    def for_drawing(self, name: str) -> Renderer:
        """The one of this name where it is loaded, else any: they share the surface."""
        return self._made.get(name) or next(iter(self._made.values()))

    def put(self, name: str, renderer: Renderer) -> None:
        """Go on with this one under its name."""
        self._made[name] = renderer

    @property
    def made(self) -> tuple[str, ...]:
        """The names of those that are loaded."""
        return tuple(self._made)

    def change(self, change: FieldChange) -> None:
        """All of them on a changed object."""
        for name, renderer in list(self._made.items()):
            self._made[name] = change.changed(renderer)

    def know_stiffness(self) -> None:
        """Each place's own, which colours the pictures, where it was kept with the model."""
        for renderer in self._made.values():
            with_own_stiffness(renderer)

    def make_anew(self, names: Iterable[str], progress: Progress) -> None:
        """One after the other, while those of before still draw; others are forgotten."""
        self._made = {name: self.create(name, progress) for name in names}

    def set_modulus(self, young_modulus_pa: float) -> None:
        """Stiffer or softer, all of them."""
        self.young_modulus_pa = young_modulus_pa
        for name, renderer in list(self._made.items()):
            self._made[name] = renderer.with_modulus(young_modulus_pa)


class Beside:
    """scene: a renderer loaded in this process, on the support that is felt; tip_radius_m: of the one tip."""

    def __init__(self, name: str, scene: TouchScene, tip_radius_m: float) -> None:
        self.name = name
        self._scene = scene
        self._state = scene.start([tip_radius_m])
        self._force = np.zeros(3)

    def follow(self, tips_m: np.ndarray) -> np.ndarray:
        """(n,) N, the size of its force at each of (n, 3) m tips, one a tick."""
        if not len(tips_m):
            return np.zeros(0)
        steps_s = np.full(len(tips_m), self._state.touch.dt_s)
        forces = self._scene.follow(self._state, np.ascontiguousarray(tips_m[:, None]), steps_s)[:, 0]
        self._force = forces[-1]
        return np.linalg.norm(forces, axis=1)

    def view(self) -> RendererView:
        """Where it stands now."""
        moved = self._scene.renderer.displacement(self._state.touch)
        return RendererView(self.name, self._force.copy(), moved)

    def change(self, renderer: Renderer) -> None:
        """Go on with another renderer of the same kind, for example of another modulus."""
        self._scene = self._scene.with_renderer(renderer)
