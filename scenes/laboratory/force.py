"""From a motion and solved touches to the force on the tool: still elastic, still without an instrument. N,
mm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numba
import numpy as np

from palpate.scenes.laboratory.motion import Motion
from palpate.scenes.laboratory.paths import TouchForce


def elastic_force(motion: Motion, touches: Sequence[TouchForce], modulus_pa: float) -> np.ndarray:
    """(n, 3) N on the tool, object frame: the solved force along each path, and what straying adds.

    Straying pulls through the contact's own stiffness as the solid has it at that depth: increments add up
    while the tip stays, and are let go in proportion as the contact shrinks (the no-slip contact of
    Mindlin & Deresiewicz).
    """
    force = np.zeros_like(motion.position)
    for number, touch in enumerate(touches):
        rows = np.flatnonzero(motion.touch == number)
        if not len(rows):
            continue
        solved, stiffness = touch(motion.leg[rows], motion.s[rows])
        pressed = np.linalg.norm(solved, axis=1) > 0
        extra = _strayed(stiffness, motion.stray[rows], pressed)
        force[rows] = 1e-6 * modulus_pa * (solved + extra)
    return force


@numba.njit(cache=True)
def _strayed(stiffness, stray, pressed):
    out = np.zeros_like(stray)
    q = np.zeros(3)
    size = 0.0
    for k in range(1, len(stray)):
        now = abs(stiffness[k, 0, 0] + stiffness[k, 1, 1] + stiffness[k, 2, 2])
        if not pressed[k]:
            q[:] = 0.0
        else:
            if now < size:
                q *= now / size
            for i in range(3):
                for j in range(3):
                    q[i] += stiffness[k, i, j] * (stray[k, j] - stray[k - 1, j])
        size = now
        out[k] = q
    return out
