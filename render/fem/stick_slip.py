"""Forces of held tips: each one's local law and far field, the others through the compliance, friction by
walking."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.effects.friction_slip import SLIPS, slip_compliance, slip_excess, slip_length
from palpate.mechanics.kernels import part
from palpate.render.fem.careful_slip import SETTLED, felt_here, keep_anchor, settle, slip_with_care
from palpate.render.fem.held_tips import carry
from palpate.render.surface.walking import walk

CONVERGED_N = 1e-5
OVERSHOOT = 1.8
"""Of the way that leaves no tangential force: a walk that is longer would not settle."""


@part
def solve_one(p, state, tips, i):
    """One Gauss-Seidel update: the force of tip i where the others' forces stand as they are; tells them.

    Where it does not settle the anchor stays where it came to, the last force is held, and `state.held` says
    so.
    """
    grip, frame, out, trial = state.grip, state.frames[i], state.solution[i], state.trial
    move, far, mu = state.vectors[5], state.local_far[i], p.friction[0]
    length = before = 0.0
    settled = False
    for slip in range(SLIPS):
        felt_here(p, state, tips, i)
        fn, fu, fv, tangent, held = trial[0], trial[1], trial[2], trial[7], trial[8]
        pull = np.sqrt(fu * fu + fv * fv)
        excess = slip_excess(pull, fn, mu)[0]
        if slip > 0 and (fn <= 0.0 or excess > max(before, SETTLED * fn)):
            break
        keep_anchor(state, i)
        if excess == 0.0 or (slip == SLIPS - 1 and excess <= SETTLED * fn):
            settled = True
            break
        if slip == SLIPS - 1:
            break
        # the anchor follows the tip by what the excess stretches; the centre above it moves by 1 + R / rho
        compliance = 1.0 / held + 0.5 * (far[1, 1] + far[2, 2])
        lever = max(1.0 + state.radii_m[i] * state.curvature[i], 0.25)
        length = slip_length(slip, excess, before, length, compliance, lever)
        suu, suv, svv = slip_compliance(tangent, held, far[1, 0], far[2, 0], far[1, 1], far[1, 2], far[2, 2])
        along = (suu * fu * fu + 2.0 * suv * fu * fv + svv * fv * fv) / pull
        if length * lever > OVERSHOOT * along:
            break
        before = excess
        for k in range(3):
            move[k] = -length * (fu * frame[1, k] + fv * frame[2, k]) / pull
        grip.triangle[i] = walk(p.surface, grip.triangle[i], grip.weights[i], move)
        settle(p, state, i)
    if not settled:
        settled = slip_with_care(p, state, tips, i)
    state.held[i] = 0 if settled else 1
    for k in range(3):
        state.carried_before[k, i] = state.carried[k, i]
    if not settled:
        return
    fn, fu, fv = trial[0], trial[1], trial[2]
    pull = np.sqrt(fu * fu + fv * fv)
    if pull > mu * fn:
        fu *= mu * fn / pull
        fv *= mu * fn / pull
    for k in range(3):
        move[k] = fu * frame[1, k] + fv * frame[2, k] + fn * frame[0, k] - state.elastic[i, k]
        state.elastic[i, k] += move[k]
    if tips.shape[0] > 1:
        carry(state.links[i], state.carried, move[0], move[1], move[2])
    out[0], out[1], out[2] = fn, fu, fv
    for k in range(3, 8):
        out[k] = trial[k]


@part
def unsettled(p, state, i):
    """Whether the others have moved the place of tip i by what changes its force by more than CONVERGED_N."""
    # E times the radius bounds the sideways stiffness, and the normal one before it touches
    least = CONVERGED_N / (state.solution[i, 7] + state.young[i] * state.radius[i])
    for k in range(3):
        if abs(state.carried[k, i] - state.carried_before[k, i]) > least:
            return True
    return False
