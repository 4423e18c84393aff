"""What a tip meets: an object on its support. The same for a press, a replay, the servo and the window.

A renderer knows the object alone; beside it a tip meets the plane that it stands on (render.support). The two
forces add, so a scene steps them one after the other, and the servo's tick calls the same two kernels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from palpate.mechanics.model.model import Model
from palpate.render.base import Renderer
from palpate.render.support import (
    SupportOptions,
    SupportParameters,
    add_support_path,
    no_support,
    support_plane,
)
from palpate.render.surface.bvh import STACK, closest_triangle
from palpate.render.surface.contact import CLEAR, outside


class SceneState(NamedTuple):
    """touch: the renderer's own state. forces: (m, 3) N on the tools, of object and support.

    previous: (m, 3) m, the tips of the last step, NaN before the first; velocity: (m, 3) m/s since then.
    """

    touch: Any
    forces: np.ndarray
    previous: np.ndarray
    velocity: np.ndarray


@dataclass(frozen=True)
class TouchScene:
    """renderer: of the object. support: the plane beside it, `no_support()` where there is none."""

    renderer: Any
    support: SupportParameters

    @property
    def model(self) -> Model:
        """The object's model."""
        return self.renderer.model

    def start(self, radii_m: Sequence[float] | None = None, dt_s: float = 1e-3) -> SceneState:
        """A fresh state with one entry a tip; radii default to the model's one tip."""
        touch = self.renderer.start(radii_m, dt_s)
        shape = touch.forces.shape
        return SceneState(touch, np.zeros(shape), np.full(shape, np.nan), np.zeros(shape))

    def is_free(self, centre: np.ndarray, radius_m: float) -> bool:
        """Whether a tip whose centre is at (3,) m is off the object: only such a one is felt later."""
        surface = self.renderer.contact.arrays
        weights, stack = np.zeros(3), np.zeros(STACK, dtype=np.int64)
        triangle, distance = closest_triangle(
            surface.bvh, surface.vertices, surface.triangles, centre, np.inf, weights, stack
        )
        return bool(distance > radius_m + CLEAR and outside(surface, triangle, weights, centre))

    def step(self, state: SceneState, tips: np.ndarray) -> tuple[SceneState, np.ndarray]:
        """Advance by one tick: `Renderer.step`, and the support. Returns the state and its forces (m, 3) N.

        A tip's velocity, for the support's damping and friction, is that of its last step.
        """
        self.renderer.step(state.touch, tips)
        state.forces[:] = state.touch.forces
        self._add(state, state.touch.dt_s, tips[None], state.forces[None])
        return state, state.forces

    def follow(self, state: SceneState, path: np.ndarray, steps_s: np.ndarray) -> np.ndarray:
        """Forces (n, m, 3) N on the tools along a path (n, m, 3) m: `step` n times, steps_s (n,) s apart."""
        forces = self.renderer.follow(state.touch, path, steps_s)
        self._add(state, steps_s, path, forces)
        return forces

    def _add(self, state: SceneState, steps_s: np.ndarray, path: np.ndarray, forces: np.ndarray) -> None:
        add_support_path(
            self.support, state.touch.radii_m, state.previous, state.velocity, steps_s, path, forces
        )

    def with_renderer(self, renderer: Any) -> TouchScene:
        """Another object on the same support."""
        return replace(self, renderer=renderer)

    def no_stiffer_than(self, most_n_per_m: float) -> TouchScene:
        """The scene on a support of at most this stiffness, N/m: what a device can render."""
        stiffness = min(self.support.stiffness_n_per_m, most_n_per_m)
        return replace(self, support=self.support._replace(stiffness_n_per_m=float(stiffness)))


def scene_of(touched: Renderer | TouchScene, options: SupportOptions | None = None) -> TouchScene:
    """A renderer with its model's support around it; a scene stays as it is."""
    if isinstance(touched, TouchScene):
        return touched
    return TouchScene(touched, support_plane(touched.model, options))


def in_the_air(renderer: Any) -> TouchScene:
    """What a renderer feels alone, without a support."""
    return TouchScene(renderer, no_support())
