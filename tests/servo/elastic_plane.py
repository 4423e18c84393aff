"""The plainest object with a renderer's interface: a half space above which z > 0 is free, k N/m, friction-free."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from palpate.servo.free_air import FreeAir, FreeAirState


class PlaneParameters(NamedTuple):
    stiffness: np.ndarray
    friction: np.ndarray
    series_compliance: np.ndarray


@njit
def _kernel(parameters, state, tips):
    k = parameters.stiffness[0]
    k = k / (1.0 + k * parameters.series_compliance[0])
    for t in range(tips.shape[0]):
        depth = state.radii_m[t] - tips[t, 2]
        touches = depth > 0.0
        state.forces[t, 0] = 0.0
        state.forces[t, 1] = 0.0
        state.forces[t, 2] = k * depth if touches else 0.0
        state.touching[t] = 1 if touches else 0
        state.depths[t] = depth if touches else 0.0
        state.stiffness[t] = k if touches else 0.0
        state.points[t] = tips[t]
        state.points[t, 2] = 0.0
        state.normals[t, 2] = 1.0


class ElasticPlane(FreeAir):
    kernel = staticmethod(_kernel)

    def __init__(self, stiffness_n_per_m: float = 500.0, compliance_m_per_n: float = 0.0) -> None:
        super().__init__(0.005)
        self.parameters = PlaneParameters(
            np.array([stiffness_n_per_m]), np.full(1, np.inf), np.array([compliance_m_per_n])
        )

    @property
    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        square = np.array([[-0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.1, 0.1, 0.0], [-0.1, 0.1, 0.0]])
        return square, np.array([[0, 1, 2], [0, 2, 3]])

    def step(self, state: FreeAirState, tips: np.ndarray) -> tuple[FreeAirState, np.ndarray]:
        _kernel(self.parameters, state, tips)
        return state, state.forces

    def with_modulus(self, young_modulus_pa: float) -> ElasticPlane:
        """A stiffness of 1 N/m a Pa / 100, so that a test can change it."""
        return ElasticPlane(young_modulus_pa / 100.0, float(self.parameters.series_compliance[0]))

    def with_series_compliance(self, compliance_m_per_n: float) -> ElasticPlane:
        return ElasticPlane(float(self.parameters.stiffness[0]), compliance_m_per_n)


class PlaneSource:
    """Makes the plane in a servo process."""

    name = "plane"

    def __init__(self, stiffness_n_per_m: float = 500.0) -> None:
        self.stiffness_n_per_m = stiffness_n_per_m

    def make(self, progress):
        return ElasticPlane(self.stiffness_n_per_m), None
