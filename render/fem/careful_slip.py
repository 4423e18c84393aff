"""Slip where a walk by the mean compliance does not settle: slender, soft, sharply bent places.

The anchor walks by the compliance along the slip, learnt anew from every walk, and never farther than where
less is too much. Where there is no such way the tip slips off: the anchor is followed along the pull, in
short walks, to where it holds again or lets go.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.contact.dent import BENT
from palpate.mechanics.contact.touch import touch_solve
from palpate.mechanics.effects.friction_slip import slip_excess, slip_onto_cone
from palpate.mechanics.kernels import inner, part
from palpate.render.fem.held_tips import turn_frame
from palpate.render.surface.walking import place, rim_across, walk

SETTLED, _INSIDE = 1e-4, 1e-3
"""Of the normal force, what may be too much; of Coulomb's, what may be missing once the tip has slipped."""
SLIP_U, SLIP_V, RIM_U, RIM_V = 9, 10, 11, 12
"""Cells of `state.trial` after those of `felt_here`: the tangential force without what the rim of the base
takes up, and the direction into it where it takes up some."""
_ROUNDS, _CARE_WALKS, _FOLLOW_WALKS, _TURNS = 3, 8, 20, 6
_CAUTION, _BETTER, _SHORTER, _SHORTENED = 0.98, 0.9, 0.5, 8
_PROBE, _FIRST, _LONGEST = 2e-4, 0.01, 0.25  # walks, in tip radii


@part
def settle(p, state, i):
    """At the anchor of tip i: point, normal, frame, far field in that frame (m/N), effective radius; and in
    `state.unsolved` whether the far field is not solved there."""
    grip = state.grip
    t = grip.triangle[i]
    weights = grip.weights[i]
    place(p.surface, t, weights, state.points[i], state.normals[i])
    turn_frame(state.frames[i], state.normals[i])
    frame, local, young = state.frames[i], state.local_far[i], p.young_modulus_pa[0]
    curvature = bracing = softness = 0.0
    turned, before = state.vectors, state.before[0]
    for r in range(3):
        for c in range(3):
            local[r, c] = 0.0
    for corner in range(3):
        v, w = p.surface.triangles[t, corner], weights[corner] / young
        curvature += weights[corner] * p.curvature[v]
        bracing += weights[corner] * p.bracing[v]
        softness += weights[corner] * p.softness[v]
        if np.isnan(p.far[v, 0, 0]):
            state.unsolved[v] = 1
            continue
        for r in range(3):
            for c in range(3):
                local[r, c] += w * p.far[v, r, c]
        if before > 0.0:
            for r in range(3):
                for c in range(3):
                    local[r, c] += w * before * (p.far_before[v, r, c] - p.far[v, r, c])
    series = p.series_compliance[0]
    if before > 0.0:
        series += before * (p.series_before[0] - series)
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
        local[r, r] += series
    radius = state.radii_m[i] * p.effects.dent_radius[0]
    state.radius[i] = 1.0 / max(1.0 / radius + curvature, 0.25 / radius)
    state.curvature[i] = curvature
    state.bend[i] = min(max(curvature * radius, BENT[0]), BENT[1]) + bracing * radius
    state.young[i] = young / softness


@part
def felt_here(p, state, tips, i):
    """Write `state.trial`: what `touch_solve` finds for tip i where its anchor is."""
    d, local, frame = state.vectors[3], state.vectors[4], state.frames[i]
    trial, memory = state.trial, state.memory[i]
    nu = p.poisson_ratio[0]
    plane_strain = state.young[i] / (1.0 - nu**2)
    stick = 4.0 * state.young[i] / ((1.0 + nu) * (2.0 - nu))
    for k in range(3):
        d[k] = tips[i, k] - state.points[i, k] - state.radii_m[i] * state.normals[i, k]
        d[k] += state.carried[k, i]
    for r in range(3):
        local[r] = frame[r, 0] * d[0] + frame[r, 1] * d[1] + frame[r, 2] * d[2]
    fn, fu, fv, dent, a, du, dv, tangent, held = touch_solve(
        memory, local, state.local_far[i], p.table, state.radius[i], state.bend[i], plane_strain, stick
    )
    if dent > 0.0:
        memory[1] = dent  # where the next solution starts from
    trial[0], trial[1], trial[2], trial[3] = fn, fu, fv, dent
    trial[4], trial[5], trial[6], trial[7], trial[8] = a, du, dv, tangent, held


@part
def keep_anchor(state, i):
    """Remember where the anchor of tip i is."""
    state.base_triangle[0] = state.grip.triangle[i]
    for k in range(3):
        state.base[3, k] = state.grip.weights[i, k]
        for r in range(3):
            state.base[r, k] = state.frames[i, r, k]


@inner
def _go_back(state, i):
    """The anchor of tip i to where it was kept."""
    state.grip.triangle[i] = state.base_triangle[0]
    for k in range(3):
        state.grip.weights[i, k] = state.base[3, k]
        for r in range(3):
            state.frames[i, r, k] = state.base[r, k]


@inner
def _try(p, state, tips, i, yu, yv):
    """The anchor of tip i (yu, yv) m against the pull from where it was kept, and what is felt there: (N too
    much, N of tangential force); what the rim of the base takes up does not make the tip slip."""
    frame, move, grip, trial = state.frames[i], state.vectors[5], state.grip, state.trial
    _go_back(state, i)
    for k in range(3):
        move[k] = -yu * frame[1, k] - yv * frame[2, k]
    grip.triangle[i] = walk(p.surface, grip.triangle[i], grip.weights[i], move)
    settle(p, state, i)
    felt_here(p, state, tips, i)
    rim_across(p.surface, grip.triangle[i], grip.weights[i], move)
    bu = frame[1, 0] * move[0] + frame[1, 1] * move[1] + frame[1, 2] * move[2]
    bv = frame[2, 0] * move[0] + frame[2, 1] * move[1] + frame[2, 2] * move[2]
    into = min(trial[1] * bu + trial[2] * bv, 0.0)
    trial[SLIP_U], trial[SLIP_V] = trial[1] - into * bu, trial[2] - into * bv
    trial[RIM_U], trial[RIM_V] = (bu, bv) if into < 0.0 else (0.0, 0.0)
    pull = np.sqrt(trial[SLIP_U] ** 2 + trial[SLIP_V] ** 2)
    excess = slip_excess(pull, trial[0], p.friction[0])[0]
    return 0.0 if excess <= SETTLED * trial[0] else excess, pull


@inner
def _rate(p, state, tips, i, eu, ev, rate):
    """Write rate (3,), N/m: by what the force (n, u, v) falls in a slip along (eu, ev)."""
    trial, step = state.trial, _PROBE * state.radii_m[i]
    fn, fu, fv = state.base_force[0], state.base_force[1], state.base_force[2]
    _try(p, state, tips, i, step * eu, step * ev)
    if not trial[0] > 0.0:
        step = -step
        _try(p, state, tips, i, step * eu, step * ev)
    rate[0], rate[1], rate[2] = (
        (fn - trial[0]) / step,
        (fu - trial[SLIP_U]) / step,
        (fv - trial[SLIP_V]) / step,
    )


@inner
def _aim(p, state, tips, i, bu, bv):
    """(yu, yv) m, the slip from the kept anchor that the rates there want; zeros where none lessens the pull.
    (bu, bv): into the base, where its rim is in the way, or zeros."""
    mu, fall = p.friction[0], state.fall
    fn, fu, fv = state.base_force[0], state.base_force[1], state.base_force[2]
    if bu != 0.0 or bv != 0.0:
        tu, tv = -bv, bu
        _rate(p, state, tips, i, tu, tv, fall[0])
        along = fall[0, 1] * tu + fall[0, 2] * tv
        if not along > 0.0:
            return 0.0, 0.0
        give, g = 1.0 / along, -fall[0, 0] / along
        return slip_onto_cone(fu, fv, fn, mu, g * tu, g * tv, give, 0.0, 0.0, give)
    _rate(p, state, tips, i, 1.0, 0.0, fall[0])
    _rate(p, state, tips, i, 0.0, 1.0, fall[1])
    juu, jvu, juv, jvv = fall[0, 1], fall[0, 2], fall[1, 1], fall[1, 2]
    det = juu * jvv - juv * jvu
    if not (juu + jvv > 0.0 and det > 0.0):
        return 0.0, 0.0
    suu, suv, svu, svv = jvv / det, -juv / det, -jvu / det, juu / det
    gu, gv = -(suu * fall[0, 0] + svu * fall[1, 0]), -(suv * fall[0, 0] + svv * fall[1, 0])
    return slip_onto_cone(fu, fv, fn, mu, gu, gv, suu, suv, svu, svv)


@inner
def slip_with_care(p, state, tips, i):
    """Walk tip i's anchor on from where it was kept; whether the force in `state.trial` has settled."""
    for _ in range(_ROUNDS):
        if _walk_to_cone(p, state, tips, i) or _slip_off(p, state, tips, i):
            return True
    _try(p, state, tips, i, 0.0, 0.0)
    return False


@inner
def _walk_to_cone(p, state, tips, i):
    """Walk to where the rates say that the force is on the cone, as long as that brings it nearer."""
    mu, radius, trial = p.friction[0], state.radii_m[i], state.trial
    excess, pull = _try(p, state, tips, i, 0.0, 0.0)
    for _ in range(_CARE_WALKS):
        if excess == 0.0:
            return True
        keep_anchor(state, i)
        before, bu, bv = excess, trial[RIM_U], trial[RIM_V]
        fu, fv = trial[SLIP_U], trial[SLIP_V]
        state.base_force[0], state.base_force[1], state.base_force[2] = trial[0], fu, fv
        yu, yv = _aim(p, state, tips, i, bu, bv)
        size = np.sqrt(yu * yu + yv * yv)
        if not size > 0.0:
            break
        share = min(_CAUTION if mu > 0.0 else 1.0, radius / size)
        better = False
        for _shorter in range(_SHORTENED):
            excess, pull = _try(p, state, tips, i, share * yu, share * yv)
            if trial[0] > 0.0:
                if excess == 0.0 and mu * trial[0] - pull <= _INSIDE * mu * trial[0]:
                    return True
                better = 0.0 < excess <= _BETTER * before
                if better:
                    break
            share *= _SHORTER
        if not better:
            break
    return False


@inner
def _slip_off(p, state, tips, i):
    """Follow the anchor of tip i along the pull to about where that turns; whether it holds or lets go."""
    mu, radius, trial = p.friction[0], state.radii_m[i], state.trial
    excess, pull = _try(p, state, tips, i, 0.0, 0.0)
    stride = _FIRST * radius
    fu, fv = trial[SLIP_U] / pull, trial[SLIP_V] / pull
    turned = 0
    for _ in range(_FOLLOW_WALKS):
        excess, pull = _try(p, state, tips, i, stride * fu, stride * fv)
        push = trial[0]
        if not push > 0.0 or (excess == 0.0 and mu * push - pull <= _INSIDE * mu * push):
            return True
        if excess > 0.0 and trial[SLIP_U] * fu + trial[SLIP_V] * fv > 0.0:
            fu, fv = trial[SLIP_U] / pull, trial[SLIP_V] / pull
            keep_anchor(state, i)
            if turned == 0:
                stride = min(1.5 * stride, _LONGEST * radius)
        else:
            turned += 1
            stride *= _SHORTER
        if turned == _TURNS:
            break
    return False
