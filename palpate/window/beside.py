"""A second renderer beside the one that is felt: the same tip drives it, at every tick of the servo."""

from __future__ import annotations

import numpy as np

from palpate.window.frames import View
from render.base import Renderer
from render.scene import TouchScene


class Beside:
    """scene: a renderer loaded in this process, on the support that is felt; tip_radius_m: of the one tip."""

    def __init__(self, name: str, scene: TouchScene, tip_radius_m: float) -> None:
        self.name = name
        self._scene = scene
        self._state = scene.start([tip_radius_m])
        self._force = np.zeros(3)

    def follow(self, tips_m: np.ndarray) -> np.ndarray:
        """(n,) N, the size of its force at each of (n, 3) m tips, one a tick."""
        sizes = np.zeros(len(tips_m))
        for i, tip in enumerate(np.ascontiguousarray(tips_m)):
            forces = self._scene.step(self._state, tip[None])[1]
            sizes[i] = np.linalg.norm(forces[0])
            self._force = forces[0]
        return sizes

    def view(self) -> View:
        """Where it stands now."""
        moved = self._scene.renderer.displacement(self._state.touch)
        return View(self.name, self._force.copy(), moved)

    def change(self, renderer: Renderer) -> None:
        """Go on with another renderer of the same kind, for example of another modulus."""
        self._scene = self._scene.with_renderer(renderer)
