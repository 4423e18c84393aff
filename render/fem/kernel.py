"""The step of the finite-element renderer: local dents in series with the object's condensed compliance.

For each tip i that is held at the surface point p_i (render.surface.contact), with the tip's centre at c_i,

    c_i - p_i - R n_i = dent(F_i) + C_far(p_i, p_i) F_i / E + sum over j != i of C(p_i, p_j) F_j / E,

F the forces on the object. The dent and its stick are mechanics.contact.touch, the same law that
reconstruction fits. C_far is interpolated over the fine contact surface, C between contacts over the mesh's
surface nodes: a step costs the same for any number of nodes. Forces are found by Gauss-Seidel over the
contacts, where one that the others no longer move is not solved again; where the tangential force exceeds
Coulomb's mu F_n, the anchor p_i walks over the surface until it does not (stick and slip).
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.kernels import step_kernel
from palpate.render.fem.end_of_tick import conclude, forget
from palpate.render.fem.frames import new_frame
from palpate.render.fem.held_tips import carry_all, leave, link, locate, renew
from palpate.render.fem.stick_slip import settle, solve_one, unsettled
from palpate.render.surface.contact import approach, lose, release, strayed

SWEEPS = 60


@step_kernel
def fem_step(p, state, tips):
    """One tick: tips (m, 3) m; writes the state's forces on the tools, N. See render.base.Renderer.step."""
    m = tips.shape[0]
    grip = state.grip
    held = 0
    renew(p, state)
    for i in range(m):
        if not (np.isfinite(tips[i, 0]) and np.isfinite(tips[i, 1]) and np.isfinite(tips[i, 2])):
            lose(grip, i)
        else:
            if grip.triangle[i] >= 0 and strayed(
                p.surface,
                tips[i],
                state.points[i],
                state.normals[i],
                state.radii_m[i],
                state.vectors[0],
                state.stack,
            ):
                forget(state, i)
                release(grip, i, tips[i])
            # a tip that has strayed from its anchor may still overlap the object elsewhere: no tick without
            if grip.triangle[i] < 0 and approach(
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
            leave(state, i)
            state.touching[i] = 0
            state.depths[i] = state.stiffness[i] = 0.0
            for k in range(3):
                state.forces[i, k] = 0.0
            continue
        held += 1
        settle(p, state, i)
        if m > 1:
            locate(p, state, i)
            link(p, state, i)
    if held == 0:
        return
    carry_all(state)
    for sweep in range(SWEEPS):
        settled = True
        for i in range(m):
            if grip.triangle[i] >= 0 and (sweep == 0 or unsettled(p, state, i)):
                solve_one(p, state, tips, i)
                settled = False
        if held == 1 or settled:
            break
    for i in range(m):
        if grip.triangle[i] >= 0:
            conclude(p, state, tips, i)
