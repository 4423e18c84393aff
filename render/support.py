"""The support as a rigid plane that a tip meets beside the object: a stiff, damped penalty with friction.

f_n = max(0, k d - b d'), d = R - n . (tip - p);    |f_t| <= mu f_n, against the motion
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

CREEP_M_PER_S = 0.005
"""Below this speed friction falls off linearly, so that it does not chatter at rest."""


class SupportParameters(NamedTuple):
    """point, normal: (3,), the normal points into the object. N/m, N s/m; stiffness 0: no support."""

    point: np.ndarray
    normal: np.ndarray
    stiffness_n_per_m: float
    damping_n_s_per_m: float
    friction: float


@njit(cache=True, nogil=True)
def add_support_force(parameters, tip, velocity, radius_m, force):
    """Add the plane's force on the tool (N, (3,), in place); returns whether the tip touches it.

    tip: (3,) m, the centre; velocity: (3,) m/s; one frame for all.
    """
    if parameters.stiffness_n_per_m <= 0.0:
        return False
    height, rate = 0.0, 0.0
    for i in range(3):
        height += (tip[i] - parameters.point[i]) * parameters.normal[i]
        rate += velocity[i] * parameters.normal[i]
    depth = radius_m - height
    if not depth > 0.0:
        return False
    normal_force = max(0.0, parameters.stiffness_n_per_m * depth - parameters.damping_n_s_per_m * rate)
    slide2 = 0.0
    for i in range(3):
        slide2 += (velocity[i] - rate * parameters.normal[i]) ** 2
    drag = parameters.friction * normal_force / max(math.sqrt(slide2), CREEP_M_PER_S)
    for i in range(3):
        force[i] += normal_force * parameters.normal[i]
        force[i] -= drag * (velocity[i] - rate * parameters.normal[i])
    return True
