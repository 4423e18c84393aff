"""Forces of held tips: each one's local law and far field, the others through the compliance, friction by
walking."""

from __future__ import annotations

import numpy as np
from numba import njit

from mechanics.mutual import between_block, between_mixed, mix_factor
from mechanics.touch import touch_solve
from render.contact import place, turn_frame, walk

SLIPS = 12
CAUTION = 0.9


@njit(cache=True, error_model="numpy")
def settle(p, state, i):
    """At the anchor of tip i: point, normal, frame, far field in that frame (m/N), effective radius."""
    grip = state.grip
    t = grip.triangle[i]
    weights = grip.weights[i]
    place(p.surface, t, weights, state.points[i], state.normals[i])
    turn_frame(state.frames[i], state.normals[i])
    frame, local, young = state.frames[i], state.local_far[i], p.young_modulus_pa[0]
    curvature = 0.0
    turned = state.vectors
    for r in range(3):
        for c in range(3):
            local[r, c] = 0.0
    for corner in range(3):
        v, w = p.surface.triangles[t, corner], weights[corner] / young
        curvature += weights[corner] * p.curvature[v]
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


@njit(cache=True, error_model="numpy")
def couple(p, state, i, m):
    """Blocks between tip i and the tips before it, m/N; rows act on forces on the object."""
    grip, n = state.grip, state.nodes
    t = grip.triangle[i]
    state.fresh[i] = 0
    for a in range(3):
        total = 0.0
        for corner in range(3):
            total += grip.weights[i, corner] * p.parent_weights[t, corner, a]
        total /= np.sqrt(p.young_modulus_pa[0])
        if n[i, a] != p.parents[t, a] or state.node_weights[i, a] != total:
            state.fresh[i] = 1
        n[i, a] = p.parents[t, a]
        state.node_weights[i, a] = total
    if state.fresh[i] and state.mixed.shape[2]:
        mix_factor(p.factor, n[i], state.node_weights[i], state.mixed[i])
    for j in range(i):
        if grip.triangle[j] < 0 or (state.fresh[i] == 0 and state.fresh[j] == 0):
            continue  # a pair that stuck where it was keeps its block
        block = state.blocks[i, j]
        if state.mixed.shape[2]:
            between_mixed(state.mixed[i], state.mixed[j], block)
        else:
            between_block(p.blocks, n[i], state.node_weights[i], n[j], state.node_weights[j], block)
        for r in range(3):
            for c in range(3):
                state.blocks[j, i, c, r] = block[r, c]


@njit(cache=True, error_model="numpy")
def solve_one(p, state, tips, i, m):
    """One Gauss-Seidel update of tip i: its force for the others' forces held; returns the change, N."""
    grip, frame, out = state.grip, state.frames[i], state.solution[i]
    d, local, move = state.vectors[3], state.vectors[4], state.vectors[5]
    plane_strain = p.young_modulus_pa[0] / (1.0 - p.poisson_ratio[0] ** 2)
    stick = 4.0 * p.young_modulus_pa[0] / ((1.0 + p.poisson_ratio[0]) * (2.0 - p.poisson_ratio[0]))
    mu = p.friction[0]
    for slip in range(SLIPS):
        for k in range(3):
            d[k] = tips[i, k] - state.points[i, k] - state.radii_m[i] * state.normals[i, k]
            for j in range(m):
                if j != i and grip.triangle[j] >= 0:
                    for c in range(3):
                        d[k] += state.blocks[i, j, k, c] * state.elastic[j, c]
        for r in range(3):
            local[r] = frame[r, 0] * d[0] + frame[r, 1] * d[1] + frame[r, 2] * d[2]
        fu, fv, fn, dent, a, du, dv, tangent = touch_solve(
            state.memory[i], local, state.local_far[i], p.table, state.radius[i], plane_strain, stick
        )
        pull = np.sqrt(fu * fu + fv * fv)
        if not (pull > mu * fn) or fn <= 0.0:
            break
        if slip == SLIPS - 1 or pull - mu * fn <= 1e-9 + 1e-6 * mu * fn:
            fu *= mu * fn / pull
            fv *= mu * fn / pull
            break
        # the anchor follows the tip by what the excess stretches; the centre above it moves by 1 + R / rho.
        # a little less than that, so that the force comes down onto the cone and is never left inside it
        give = 1.0 / (stick * a) + 0.5 * (state.local_far[i, 0, 0] + state.local_far[i, 1, 1])
        length = CAUTION * give * (pull - mu * fn) / max(1.0 + state.radii_m[i] * state.curvature[i], 0.25)
        for k in range(3):
            move[k] = -length * (fu * frame[0, k] + fv * frame[1, k]) / pull
        grip.triangle[i] = walk(p.surface, grip.triangle[i], grip.weights[i], move)
        settle(p, state, i)
    change = 0.0
    for k in range(3):
        force = fu * frame[0, k] + fv * frame[1, k] + fn * frame[2, k]
        change = max(change, abs(force - state.elastic[i, k]))
        state.elastic[i, k] = force
    out[0], out[1], out[2], out[3] = fu, fv, fn, dent
    out[4], out[5], out[6], out[7] = a, du, dv, tangent
    return change
