"""Nothing, and an elastic plane at z = 0, with a renderer's interface: for trying a device or a loop without
a model, and as the empty loop of the benchmark.

The plane is linear, without friction: force k d along z for the depth d of the tip, k behind the virtual
coupling.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from palpate.mechanics.kernels import step_kernel
from palpate.mechanics.progress import Progress
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


class PlaneParameters(NamedTuple):
    """stiffness: (1,) N/m; friction: unused; series_compliance: (1,) m/N."""

    stiffness: np.ndarray
    friction: np.ndarray
    series_compliance: np.ndarray


@step_kernel
def _plane_kernel(parameters, state, tips):
    stiffness = parameters.stiffness[0]
    stiffness = stiffness / (1.0 + stiffness * parameters.series_compliance[0])
    for t in range(tips.shape[0]):
        depth = state.radii_m[t] - tips[t, 2]
        touches = depth > 0.0
        for i in range(3):
            state.forces[t, i] = 0.0
            state.points[t, i] = tips[t, i]
            state.normals[t, i] = 0.0
        state.points[t, 2] = 0.0
        state.normals[t, 2] = 1.0
        state.forces[t, 2] = stiffness * depth if touches else 0.0
        state.touching[t] = 1 if touches else 0
        state.depths[t] = depth if touches else 0.0
        state.stiffness[t] = stiffness if touches else 0.0


class ElasticPlane(FreeAir):
    """A renderer of a plane of `stiffness_n_per_m`."""

    kernel = staticmethod(_plane_kernel)

    def __init__(self, stiffness_n_per_m: float = 500.0, compliance_m_per_n: float = 0.0) -> None:
        super().__init__()
        self.stiffness_n_per_m, self.compliance_m_per_n = float(stiffness_n_per_m), float(compliance_m_per_n)
        self.parameters = PlaneParameters(
            np.array([self.stiffness_n_per_m]), np.full(1, np.inf), np.array([self.compliance_m_per_n])
        )

    @property
    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        """A square of 20 cm."""
        square = np.array([[-0.1, -0.1, 0.0], [0.1, -0.1, 0.0], [0.1, 0.1, 0.0], [-0.1, 0.1, 0.0]])
        return square, np.array([[0, 1, 2], [0, 2, 3]])

    def step(self, state: State, tips: np.ndarray) -> tuple[State, np.ndarray]:
        """(m, 3) N on the tool."""
        _plane_kernel(self.parameters, state, tips)
        return state, state.forces

    def with_modulus(self, young_modulus_pa: float) -> ElasticPlane:
        """The stiffness of a 1 cm square, 1 cm thick: E times 1 cm."""
        return ElasticPlane(0.01 * young_modulus_pa, self.compliance_m_per_n)

    def with_series_compliance(self, compliance_m_per_n: float) -> ElasticPlane:
        """The same plane felt through a spring."""
        return ElasticPlane(self.stiffness_n_per_m, compliance_m_per_n)


@dataclass(frozen=True)
class PlaneSource:
    """Makes the plane in a servo process."""

    stiffness_n_per_m: float = 500.0
    name: str = "elastic-plane"

    def make(self, progress: Progress) -> tuple[Any, None]:
        """The plane; there is no model behind it."""
        return ElasticPlane(self.stiffness_n_per_m), None
