"""The support as a rigid plane that a tip meets beside the object: a stiff, damped penalty with friction.

f_n = max(0, k d - b d'), d = R - n . (tip - p);    |f_t| <= mu f_n, against the motion
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from palpate.mechanics.kernels import inner, kernel
from palpate.mechanics.options import Ranged, option

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model

CREEP_M_PER_S = 0.005
"""Below this speed friction falls off linearly, so that it does not chatter at rest."""


@dataclass(frozen=True)
class SupportOptions(Ranged):
    """What the plane beside the object feels like, in every command that renders a model."""

    support: bool = option(True, "the support is felt as a rigid plane around the object")
    support_stiffness_n_per_m: float = option(
        1500.0, "the support's stiffness, or the device's", unit="N/m", high=1e5, looser="higher"
    )
    support_damping_n_s_per_m: float = option(
        2.0, "the support's damping", unit="N s/m", high=100.0, looser="higher"
    )
    support_friction: float = option(0.2, "friction on the support", high=10.0)


class SupportParameters(NamedTuple):
    """point, normal: (3,), the unit normal points into the object. N/m, N s/m; stiffness 0: no support."""

    point: np.ndarray
    normal: np.ndarray
    stiffness_n_per_m: float
    damping_n_s_per_m: float
    friction: float


def no_support() -> SupportParameters:
    """A support plane that is not there."""
    return SupportParameters(np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.0, 0.0, 0.0)


def support_plane(model: Model, options: SupportOptions | None = None) -> SupportParameters:
    """The model's support as the options want it felt."""
    options = options or SupportOptions()
    if not options.support:
        return no_support()
    # copies: the compiled loop knows only arrays that may be written to
    return SupportParameters(
        np.array(model.support.point),
        np.array(model.support.normal),
        float(options.support_stiffness_n_per_m),
        float(options.support_damping_n_s_per_m),
        float(options.support_friction),
    )


@inner
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


@kernel
def add_support_path(parameters, radii_m, previous, velocity, steps_s, path, forces):
    """`add_support_force` along a path (n, m, 3) m of m tips, steps_s (n,) apart, to forces (n, m, 3) N.

    A tip's velocity is that of its last step; previous: (m, 3) m, where it was before, NaN where that is not
    known (then it is at rest). previous and velocity (m, 3) m/s are left as the path ends.
    """
    for i in range(path.shape[0]):
        for t in range(path.shape[1]):
            known = steps_s[i] > 0.0
            for k in range(3):
                known = known and math.isfinite(previous[t, k])
            for k in range(3):
                velocity[t, k] = (path[i, t, k] - previous[t, k]) / steps_s[i] if known else 0.0
                previous[t, k] = path[i, t, k]
            add_support_force(parameters, path[i, t], velocity[t], radii_m[t], forces[i, t])
