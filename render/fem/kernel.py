"""The end of a tick for one held tip: memories are written, the model's effects act, a free tip is let go.

The step of the finite-element renderer: local dents in series with the object's condensed compliance.

For each tip i that is held at the surface point p_i (render.surface.contact), with the tip's centre at c_i,

    c_i - p_i - R n_i = dent(F_i) + C_far(p_i, p_i) F_i / E + sum over j != i of C(p_i, p_j) F_j / E,

F the forces on the object. The dent and its stick are mechanics.contact.touch, the same law that
reconstruction fits. C_far is interpolated over the fine contact surface, C between contacts over the mesh's
surface nodes: a step costs the same for any number of nodes. Forces are found by Gauss-Seidel over the
contacts, where one that the others no longer move is not solved again; where the tangential force exceeds
Coulomb's mu F_n, the anchor p_i walks over the surface until it does not (stick and slip). A force that has
not settled is not rendered: the last one is held, and the tick is counted. Where a force changes by more than
the tips' motion explains, as friction lets go at a rim, the rendered one comes to it within some SNAP_S.

Forces of held tips: each one's local law and far field, the others through the compliance, friction by
walking.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.contact.dent import dent_load
from palpate.mechanics.contact.touch import touch_remember
from palpate.mechanics.effects.friction_slip import SLIPS, slip_compliance, slip_excess, slip_length
from palpate.mechanics.effects.laws_along_path import sharp_laws, smooth_laws
from palpate.mechanics.kernels import part, step_kernel
from palpate.render.fem.careful_slip import SETTLED, felt_here, keep_anchor, settle, slip_with_care
from palpate.render.fem.held_tips import carry, carry_all, leave, link, locate, new_frame, renew
from palpate.render.surface.contact import approach, lose, release, strayed
from palpate.render.surface.walking import foot, walk

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


@part
def forget(state, i):
    """A new touch of tip i remembers nothing of the last one (what the material felt stays in `felt`)."""
    for k in range(4):
        state.memory[i, k] = state.solution[i, k] = 0.0
    state.deepest[i] = 0.0
    for law in range(state.remembered.shape[1]):
        for k in range(state.remembered.shape[2]):
            state.remembered[i, law, k] = 0.0


@part
def conclude(p, state, tips, i):
    """Write tip i's memories and its force; let go of it where nothing presses and nothing pulls."""
    grip, out, normal = state.grip, state.solution[i], state.normals[i]
    pressed = out[0] > 0.0 or state.held[i] == 1
    if pressed:
        if state.held[i] == 0:
            touch_remember(state.memory[i], out[3], out[4], out[5], out[6], state.radius[i])
        depth = state.radii_m[i]
        for k in range(3):
            depth -= normal[k] * (tips[i, k] - state.points[i, k])
    else:
        # the anchor follows the tip freely until it is off the undeformed surface
        for k in range(4):
            state.memory[i, k] = 0.0
        for k in range(3):
            state.elastic[i, k] = 0.0
        grip.triangle[i], height = foot(
            p.surface, grip.triangle[i], grip.weights[i], tips[i], state.points[i], normal, state.vectors[3]
        )
        depth = state.radii_m[i] - height
    state.touching[i] = 1 if pressed else 0
    state.stiffness[i] = out[7] if pressed else 0.0
    state.depths[i] = depth if depth > 0.0 else 0.0
    state.deepest[i] = max(state.deepest[i], depth)
    _force(p, state, i, depth)
    if not pressed and depth <= -p.effects.path.reach_m[0]:
        forget(state, i)
        release(grip, i, tips[i])


@part
def _force(p, state, i, depth):
    """The force that is rendered: what the laws along the path make of the quasi-static one."""
    force, path = state.forces[i], p.effects.path
    _come(state, i)
    for k in range(3):
        force[k] = state.quasi[i, k]
    load = most = 0.0
    if path.loads[0] > 0:
        load = dent_load(depth)
        most = _felt(p, state, i, load)
    memory, deepest, dt, normal = state.remembered[i], state.deepest[i], state.dt_s[0], state.normals[i]
    smooth_laws(path.numbers, memory, depth, deepest, load, most, dt, normal, force)
    sharp_laws(path.numbers, memory, depth, deepest, load, most, dt, normal, force)


SNAP_S = 0.02
"""In which most of a snap is rendered: a body of its own inertia takes some ms, and no hand is kicked."""
_STIFFEST, _LEFT, _UNFELT_N = 4.0, 2e-3, 0.01
"""Twice a dent's as wide as the tip, over E* and radius; of the force, what slip leaves open; N, a step that
no hand feels."""


@part
def _come(state, i):
    """Bring `state.quasi` of tip i to the settled force: at once as far as the tips' motion explains it, or
    where nothing is left."""
    if state.held[i] == 1:
        return
    change = size = 0.0
    for k in range(3):
        change += (state.elastic[i, k] - state.quasi[i, k]) ** 2
        size += state.elastic[i, k] ** 2
    change = np.sqrt(change)
    stiffest, tangent = _STIFFEST / 0.75 * state.young[i] * state.radii_m[i], state.solution[i, 7]
    if tangent > 0.0:  # a base close below is felt harder than a half-space
        give = max(1.0 / tangent + state.local_far[i, 0, 0], 0.25 / tangent)
        stiffest = max(stiffest, 1.25 / give)
    explained = stiffest * state.way[0] + _LEFT * np.sqrt(size) + _UNFELT_N
    share = 1.0
    if change > explained and size > 0.0:
        share = min(explained / change + state.dt_s[0] / SNAP_S, 1.0)
    for k in range(3):
        state.quasi[i, k] = share * state.elastic[i, k] + (1.0 - share) * state.quasi[i, k]


@part
def _felt(p, state, i, load):
    """The greatest load that the place of tip i has felt, this one included."""
    t, weights = state.grip.triangle[i], state.grip.weights[i]
    most = 0.0
    for c in range(3):
        vertex = p.surface.triangles[t, c]
        state.felt[vertex] = max(state.felt[vertex], load)
        most += weights[c] * state.felt[vertex]
    return most


BENDS = 10.0
"""Times the give of a dent as wide as the tip: where a place gives so much the body bends, and moves far with
little strain. The demo's cylinder gives 0.4 in the middle and 2 at most, a tentacle 390 and 4,400."""


@part
def _has_left(p, state, tips, i):
    """Whether tip i has strayed from its anchor: of the object at rest, and on a slender body, which bends
    after a tip that it holds, also of the object as the last tick moved it there."""
    point, normal, radius, weights = state.points[i], state.normals[i], state.radii_m[i], state.vectors[0]
    if not strayed(p.surface, tips[i], point, normal, radius, weights, state.stack):
        return False
    frame, far, force, moved = state.frames[i], state.local_far[i], state.elastic[i], state.vectors[1]
    for k in range(3):
        moved[k] = tips[i, k] + state.carried[k, i]
    give = 0.0
    for r in range(3):
        away = 0.0
        for c in range(3):
            give += far[r, c] * far[r, c]
            for k in range(3):
                away += far[r, c] * frame[c, k] * force[k]
        for k in range(3):
            moved[k] += away * frame[r, k]
    if np.sqrt(give) * state.young[i] * radius <= BENDS:
        return True
    return strayed(p.surface, moved, point, normal, radius, weights, state.stack)


@part
def _go(state, tips):
    """How far the tips have gone since the last tick."""
    state.way[0] = 0.0
    for i in range(tips.shape[0]):
        squared = 0.0
        for k in range(3):
            squared += (tips[i, k] - state.last[i, k]) ** 2
            state.last[i, k] = tips[i, k]
        state.way[0] += np.sqrt(squared)


SWEEPS = 60


@step_kernel
def fem_step(p, state, tips):
    """One tick: tips (m, 3) m; writes the state's forces on the tools, N. See render.base.Renderer.step."""
    m = tips.shape[0]
    grip = state.grip
    held = 0
    renew(p, state)
    _go(state, tips)
    for i in range(m):
        if not (np.isfinite(tips[i, 0]) and np.isfinite(tips[i, 1]) and np.isfinite(tips[i, 2])):
            lose(grip, i)
        else:
            if grip.triangle[i] >= 0 and _has_left(p, state, tips, i):
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
    held_back = 0
    for i in range(m):
        if grip.triangle[i] >= 0:
            held_back = max(held_back, state.held[i])
            conclude(p, state, tips, i)
    state.unsettled[0] += held_back
