"""The step of the finite-element renderer: local dents in series with the condensed give of the whole object.

For each tip i that is held at the surface point p_i (render.contact), with the tip's centre at c_i,

    c_i - p_i - R n_i = dent(F_i) + C_far(p_i, p_i) F_i / E + sum over j != i of C(p_i, p_j) F_j / E,

F the forces on the object. The dent and its stick are mechanics.touch, the same law that reconstruction fits.
C_far is interpolated over the fine contact surface, C between contacts over the mesh's surface nodes: a step
costs the same for any number of nodes. Forces are found by Gauss-Seidel over the contacts; where the
tangential force exceeds Coulomb's mu F_n, the anchor p_i walks over the surface until it does not (stick and
slip).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from render.contact import approach, lose, new_frame
from render.fem_conclude import conclude, forget
from render.fem_solve import couple, settle, solve_one

SWEEPS = 60
CONVERGED_N = 1e-5


@njit(cache=True, error_model="numpy")
def fem_step(p, state, tips):
    """One tick: tips (m, 3) m; writes the state's forces on the tools, N. See render.base.Renderer.step."""
    m = tips.shape[0]
    grip = state.grip
    held = 0
    for i in range(m):
        if not (np.isfinite(tips[i, 0]) and np.isfinite(tips[i, 1]) and np.isfinite(tips[i, 2])):
            lose(grip, i)
        elif grip.triangle[i] < 0 and approach(
            p.surface,
            grip,
            tips[i],
            i,
            state.radii_m[i],
            state.points[i],
            state.normals[i],
            state.vectors,
            state.stack,
        ):
            new_frame(state.frames[i], state.normals[i])
            forget(state, i)
        if grip.triangle[i] < 0:
            state.fresh[i] = 1
            state.nodes[i, 0] = -2  # so that the next hold is fresh
            state.touching[i] = 0
            state.depths[i] = state.stiffness[i] = 0.0
            for k in range(3):
                state.forces[i, k] = state.elastic[i, k] = 0.0
            continue
        held += 1
        settle(p, state, i)
        couple(p, state, i, m)
    if held == 0:
        return
    for _ in range(SWEEPS):
        change = 0.0
        for i in range(m):
            if grip.triangle[i] >= 0:
                change = max(change, solve_one(p, state, tips, i, m))
        if held == 1 or change < CONVERGED_N:
            break
    for i in range(m):
        if grip.triangle[i] >= 0:
            conclude(p, state, tips, i)


@njit(cache=True, error_model="numpy")
def fem_path(p, state, steps_s, path, forces):
    """`fem_step` along the path (n, m, 3) m, steps_s (n,) apart; writes the forces (n, m, 3) N."""
    for i in range(path.shape[0]):
        state.dt_s[0] = steps_s[i]
        fem_step(p, state, path[i])
        forces[i] = state.forces
