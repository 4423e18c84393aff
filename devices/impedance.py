"""A hand that holds a tool, as an impedance: mass, damper and spring to where the person means to be.

    m x'' = k (r - x) + b (r' - x') + F

x: the tip, r: the intended place, F: the force on the tool. The usual second-order model of a grasp (Hogan
1985; Speich, Shao, Goldfarb 2005), the same in every direction. Integrated exactly for a force that is held
over the step and an intended place that moves evenly, so that any step is stable by itself: what becomes
unstable in a test is the loop, not the hand.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from scipy.linalg import expm


@njit(cache=True, nogil=True)
def follow(transition, position, velocity, intended, following, first, last, number, step_s, force):
    """Steps `first` to `last` of the `number` in which the hand means to go evenly between two places.

    transition: (2, 3), HandImpedance's over step_s. position, velocity: (3,) m, m/s, in place. force: (3,) N
    on the tool, held meanwhile. Returns its work on the hand, J.
    """
    work = 0.0
    for k in range(first, last):
        for i in range(3):
            whole = following[i] - intended[i]
            here, there = intended[i] + whole * k / number, intended[i] + whole * (k + 1) / number
            meant = whole / (number * step_s)
            offset, speed = position[i] - here, velocity[i] - meant
            moved = there + transition[0, 0] * offset + transition[0, 1] * speed + transition[0, 2] * force[i]
            work += force[i] * (moved - position[i])
            position[i] = moved
            velocity[i] = (
                meant + transition[1, 0] * offset + transition[1, 1] * speed + transition[1, 2] * force[i]
            )
    return work


@dataclass(frozen=True)
class HandImpedance:
    """mass_kg, damping_n_s_per_m, stiffness_n_per_m of hand and tool together; step_s: the fixed time step.

    stiffness and damping 0: a free mass, the worst case for a loop's stability.
    """

    mass_kg: float = 0.15
    damping_n_s_per_m: float = 12.0
    stiffness_n_per_m: float = 600.0
    step_s: float = 0.001

    @cached_property
    def transition(self) -> np.ndarray:
        """(2, 3): [x - r, x' - r'] after a step from [x - r, x' - r', F], along any axis."""
        m, b, k = self.mass_kg, self.damping_n_s_per_m, self.stiffness_n_per_m
        rate = np.array([[0.0, 1.0, 0.0], [-k / m, -b / m, 1.0 / m], [0.0, 0.0, 0.0]])
        return expm(rate * self.step_s)[:2]

    def step(
        self,
        position_m: np.ndarray,
        velocity_m_per_s: np.ndarray,
        intended_m: np.ndarray,
        intended_next_m: np.ndarray,
        force_on_tool_n: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity (3,) after one step; the intended place moves evenly."""
        intended_velocity = (intended_next_m - intended_m) / self.step_s
        offset = position_m - intended_m
        speed = velocity_m_per_s - intended_velocity
        (a, b, c), (d, e, f) = self.transition
        new_offset = a * offset + b * speed + c * force_on_tool_n
        new_speed = d * offset + e * speed + f * force_on_tool_n
        return intended_next_m + new_offset, intended_velocity + new_speed
