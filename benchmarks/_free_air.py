"""A renderer of nothing: for trying a device without an object, and as the empty loop of the benchmark."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from palpate.mechanics.kernels import step_kernel
from palpate.render.base import State, new_state


class FreeAirParameters(NamedTuple):
    """What every renderer has; nothing of it matters in free air."""

    friction: np.ndarray
    series_compliance: np.ndarray


@step_kernel
def _kernel(parameters, state, tips):
    for t in range(state.forces.shape[0]):
        for i in range(3):
            state.forces[t, i] = 0.0


class FreeAir:
    """No object: no force anywhere."""

    kernel = staticmethod(_kernel)

    def __init__(self, tip_radius_m: float = 0.005) -> None:
        self.tip_radius_m = tip_radius_m
        self.parameters: tuple[np.ndarray, ...] = FreeAirParameters(np.full(1, np.inf), np.zeros(1))

    @property
    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        """No points, no triangles."""
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)

    def start(self, radii_m: np.ndarray | None = None, dt_s: float = 0.001) -> State:
        """One entry a tip."""
        radii = np.array([self.tip_radius_m] if radii_m is None else radii_m, dtype=float)
        return new_state(radii, dt_s)

    def step(self, state: State, tips: np.ndarray) -> tuple[State, np.ndarray]:
        """Zero force."""
        _kernel(self.parameters, state, tips)
        return state, state.forces

    def with_modulus(self, young_modulus_pa: float) -> Self:
        """Air stays air."""
        return self

    def with_friction(self, mu: float) -> Self:
        """Air stays air."""
        return self

    def with_series_compliance(self, compliance_m_per_n: float) -> Self:
        """Air stays air."""
        return self
