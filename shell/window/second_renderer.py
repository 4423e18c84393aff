"""A second renderer beside the one that is felt: the same tip drives it, at every tick of the servo."""

from __future__ import annotations

import numpy as np

from palpate.render.base import Renderer
from palpate.render.scene import TouchScene
from palpate.window.frames import View


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

    def view(self) -> View:
        """Where it stands now."""
        moved = self._scene.renderer.displacement(self._state.touch)
        return View(self.name, self._force.copy(), moved)

    def change(self, renderer: Renderer) -> None:
        """Go on with another renderer of the same kind, for example of another modulus."""
        self._scene = self._scene.with_renderer(renderer)
