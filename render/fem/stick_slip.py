"""Forces of held tips: each one's local law and far field, the others through the compliance, friction by
walking."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.contact.dent import BENT
from palpate.mechanics.contact.touch import touch_solve
from palpate.mechanics.effects.friction_slip import SLIPS, slip_excess, slip_length
from palpate.mechanics.kernels import part
from palpate.render.fem.held_tips import carry, turn_frame
from palpate.render.surface.walking import place, walk

CONVERGED_N = 1e-5


@part
def settle(p, state, i):
    """At the anchor of tip i: point, normal, frame, far field in that frame (m/N), effective radius."""
    grip = state.grip
    t = grip.triangle[i]
    weights = grip.weights[i]
    place(p.surface, t, weights, state.points[i], state.normals[i])
    turn_frame(state.frames[i], state.normals[i])
    frame, local, young = state.frames[i], state.local_far[i], p.young_modulus_pa[0]
    curvature = bracing = softness = 0.0
    turned = state.vectors
    for r in range(3):
        for c in range(3):
            local[r, c] = 0.0
    for corner in range(3):
        v, w = p.surface.triangles[t, corner], weights[corner] / young
        curvature += weights[corner] * p.curvature[v]
        bracing += weights[corner] * p.bracing[v]
        softness += weights[corner] * p.softness[v]
        for r in range(3):
            for c in range(3):
                local[r, c] += w * p.far[v, r, c]
    for r in range(3):
        for c in range(3):
            total = 0.0
            for k in range(3):
                total += local[r, k] * frame[c, k]
            turned[r, c] = total
    for r in range(3):
        for c in range(3):
            total = 0.0
            for k in range(3):
                total += frame[r, k] * turned[k, c]
            local[r, c] = total
        local[r, r] += p.series_compliance[0]
    radius = state.radii_m[i] * p.effects.dent_radius[0]
    state.radius[i] = 1.0 / max(1.0 / radius + curvature, 0.25 / radius)
    state.curvature[i] = curvature
    state.bend[i] = min(max(curvature * radius, BENT[0]), BENT[1]) + bracing * radius
    state.young[i] = young / softness


@part
def solve_one(p, state, tips, i):
    """One Gauss-Seidel update: the force of tip i where the others' forces stand as they are; tells them."""
    grip, frame, out = state.grip, state.frames[i], state.solution[i]
    d, local, move = state.vectors[3], state.vectors[4], state.vectors[5]
    nu = p.poisson_ratio[0]
    plane_strain = state.young[i] / (1.0 - nu**2)
    stick = 4.0 * state.young[i] / ((1.0 + nu) * (2.0 - nu))
    mu = p.friction[0]
    fu = fv = fn = dent = a = du = dv = tangent = 0.0
    length = before = 0.0
    for slip in range(SLIPS):
        for k in range(3):
            d[k] = tips[i, k] - state.points[i, k] - state.radii_m[i] * state.normals[i, k]
            d[k] += state.carried[k, i]
        for r in range(3):
            local[r] = frame[r, 0] * d[0] + frame[r, 1] * d[1] + frame[r, 2] * d[2]
        bent, memory = state.bend[i], state.memory[i]
        fn, fu, fv, dent, a, du, dv, tangent = touch_solve(
            memory, local, state.local_far[i], p.table, state.radius[i], bent, plane_strain, stick
        )
        state.memory[i, 1] = dent  # where the next solution starts from
        pull = np.sqrt(fu * fu + fv * fv)
        excess, kept = slip_excess(slip, pull, fn, mu)
        fu *= kept
        fv *= kept
        if excess == 0.0:
            break
        # the anchor follows the tip by what the excess stretches; the centre above it moves by 1 + R / rho
        compliance = 1.0 / (stick * a) + 0.5 * (state.local_far[i, 1, 1] + state.local_far[i, 2, 2])
        lever = max(1.0 + state.radii_m[i] * state.curvature[i], 0.25)
        length = slip_length(slip, excess, before, length, compliance, lever)
        before = excess
        for k in range(3):
            move[k] = -length * (fu * frame[1, k] + fv * frame[2, k]) / pull
        grip.triangle[i] = walk(p.surface, grip.triangle[i], grip.weights[i], move)
        settle(p, state, i)
        plane_strain = state.young[i] / (1.0 - nu**2)
        stick = 4.0 * state.young[i] / ((1.0 + nu) * (2.0 - nu))
    for k in range(3):
        move[k] = fu * frame[1, k] + fv * frame[2, k] + fn * frame[0, k] - state.elastic[i, k]
        state.elastic[i, k] += move[k]
        state.carried_before[k, i] = state.carried[k, i]
    if tips.shape[0] > 1:
        carry(state.links[i], state.carried, move[0], move[1], move[2])
    out[0], out[1], out[2], out[3] = fn, fu, fv, dent
    out[4], out[5], out[6], out[7] = a, du, dv, tangent


@part
def unsettled(p, state, i):
    """Whether the others have moved the place of tip i by what changes its force by more than CONVERGED_N."""
    # E times the radius bounds the sideways stiffness, and the normal one before it touches
    least = CONVERGED_N / (state.solution[i, 7] + state.young[i] * state.radius[i])
    for k in range(3):
        if abs(state.carried[k, i] - state.carried_before[k, i]) > least:
            return True
    return False
