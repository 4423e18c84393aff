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

from typing import NamedTuple

import numpy as np
from numba import njit

from mechanics.touch import STATE_SIZE
from render.base import Grip, new_grip
from render.bvh import STACK
from render.contact import approach, foot, lose, new_frame, place, release, turn_frame, walk
from render.local import touch_remember, touch_solve
from render.surface import SurfaceArrays

SWEEPS = 60
SLIPS = 12
CONVERGED_N = 1e-5


class FemParameters(NamedTuple):
    """Read-only arrays of the kernel; v fine vertices, k fine triangles, n compliance nodes, unit modulus.

    far: (v, 3, 3) 1/m. curvature: (v,) 1/m. parents: (k, 3) compliance nodes that interpolate over a
    triangle, -1 where fixed; parent_weights (k, 3, 3). blocks: (n, n, 3, 3) 1/m. table: dent law.
    young_modulus_pa, poisson_ratio, friction, series_compliance (m/N): (1,) each.
    """

    surface: SurfaceArrays
    far: np.ndarray
    curvature: np.ndarray
    parents: np.ndarray
    parent_weights: np.ndarray
    blocks: np.ndarray
    table: np.ndarray
    young_modulus_pa: np.ndarray
    poisson_ratio: np.ndarray
    friction: np.ndarray
    series_compliance: np.ndarray


class FemState(NamedTuple):
    """render.base.State, and: grip; frames (m, 3, 3) rows u, v, n; memory (m, STATE_SIZE) of the sticks;
    blocks (m, m, 3, 3) m/N between contacts; local (m, 8) forces, dents and ring of the last solve;
    scratch."""

    forces: np.ndarray
    touching: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    depths: np.ndarray
    stiffness: np.ndarray
    radii_m: np.ndarray
    dt_s: np.ndarray
    grip: Grip
    frames: np.ndarray
    memory: np.ndarray
    blocks: np.ndarray
    solution: np.ndarray
    nodes: np.ndarray
    node_weights: np.ndarray
    fresh: np.ndarray
    local_far: np.ndarray
    radius: np.ndarray
    vectors: np.ndarray
    stack: np.ndarray


def new_fem_state(radii: np.ndarray, dt_s: float) -> FemState:
    """A state of len(radii) tips in air."""
    m = len(radii)
    return FemState(
        forces=np.zeros((m, 3)),
        touching=np.zeros(m, dtype=np.int64),
        points=np.zeros((m, 3)),
        normals=np.zeros((m, 3)),
        depths=np.zeros(m),
        stiffness=np.zeros(m),
        radii_m=radii.copy(),
        dt_s=np.array([dt_s]),
        grip=new_grip(m),
        frames=np.zeros((m, 3, 3)),
        memory=np.zeros((m, STATE_SIZE)),
        blocks=np.zeros((m, m, 3, 3)),
        solution=np.zeros((m, 8)),
        nodes=np.zeros((m, 3), dtype=np.int64),
        node_weights=np.zeros((m, 3)),
        fresh=np.ones(m, dtype=np.int64),
        local_far=np.zeros((m, 3, 3)),
        radius=np.zeros(m),
        vectors=np.zeros((6, 3)),
        stack=np.zeros(STACK, dtype=np.int64),
    )


@njit(cache=True, error_model="numpy")
def _settle(p, state, i):
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
    state.radius[i] = 1.0 / max(1.0 / state.radii_m[i] + curvature, 0.25 / state.radii_m[i])
    return curvature


@njit(cache=True, error_model="numpy")
def _couple(p, state, i, m):
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
    for j in range(i):
        if grip.triangle[j] < 0 or (state.fresh[i] == 0 and state.fresh[j] == 0):
            continue  # a pair that stuck where it was keeps its block
        block = state.blocks[i, j]
        for r in range(3):
            for c in range(3):
                block[r, c] = 0.0
        for a in range(3):
            if n[i, a] < 0:
                continue
            for b in range(3):
                if n[j, b] < 0:
                    continue
                w = state.node_weights[i, a] * state.node_weights[j, b]
                for r in range(3):
                    for c in range(3):
                        block[r, c] += w * p.blocks[n[i, a], n[j, b], r, c]
        for r in range(3):
            for c in range(3):
                state.blocks[j, i, c, r] = block[r, c]


@njit(cache=True, error_model="numpy")
def _solve_one(p, state, tips, i, m, curvature):
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
                        d[k] += state.blocks[i, j, k, c] * state.forces[j, c]
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
        # the anchor follows the tip by what the excess stretches; the centre above it moves by 1 + R / rho
        give = 1.0 / (stick * a) + 0.5 * (state.local_far[i, 0, 0] + state.local_far[i, 1, 1])
        length = give * (pull - mu * fn) / max(1.0 + state.radii_m[i] * curvature, 0.25)
        for k in range(3):
            move[k] = -length * (fu * frame[0, k] + fv * frame[1, k]) / pull
        grip.triangle[i] = walk(p.surface, grip.triangle[i], grip.weights[i], move)
        curvature = _settle(p, state, i)
    change = 0.0
    for k in range(3):
        force = fu * frame[0, k] + fv * frame[1, k] + fn * frame[2, k]
        change = max(change, abs(force - state.forces[i, k]))
        state.forces[i, k] = force
    out[0], out[1], out[2], out[3] = fu, fv, fn, dent
    out[4], out[5], out[6], out[7] = a, du, dv, tangent
    return change


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
            for k in range(4):
                state.memory[i, k] = 0.0
        if grip.triangle[i] < 0:
            state.fresh[i] = 1
            state.nodes[i, 0] = -2  # so that the next hold is fresh
            state.touching[i] = 0
            state.depths[i] = state.stiffness[i] = 0.0
            for k in range(3):
                state.forces[i, k] = 0.0
            continue
        held += 1
        state.solution[i, 0] = _settle(p, state, i)
        _couple(p, state, i, m)
    if held == 0:
        return
    for _ in range(SWEEPS):
        change = 0.0
        for i in range(m):
            if grip.triangle[i] >= 0:
                change = max(change, _solve_one(p, state, tips, i, m, _curvature(p, state, i)))
        if held == 1 or change < CONVERGED_N:
            break
    for i in range(m):
        if grip.triangle[i] >= 0:
            _conclude(p, state, tips, i)


@njit(cache=True, error_model="numpy")
def _curvature(p, state, i):
    total = 0.0
    for corner in range(3):
        total += (
            state.grip.weights[i, corner] * p.curvature[p.surface.triangles[state.grip.triangle[i], corner]]
        )
    return total


@njit(cache=True, error_model="numpy")
def _conclude(p, state, tips, i):
    """Write the stick's memory and what is reported; let go of a tip that is pushed no more."""
    grip, out = state.grip, state.solution[i]
    if out[2] > 0.0:
        touch_remember(state.memory[i], out[4], out[3], out[5], out[6], state.radius[i] / 64.0)
        state.touching[i] = 1
        state.stiffness[i] = out[7]
        depth = state.radii_m[i]
        for k in range(3):
            depth -= state.normals[i, k] * (tips[i, k] - state.points[i, k])
        state.depths[i] = depth
        return
    # nothing presses here: the anchor follows the tip freely until it is off the undeformed surface
    for k in range(4):
        state.memory[i, k] = 0.0
    for k in range(3):
        state.forces[i, k] = 0.0
    state.touching[i] = 0
    state.stiffness[i] = 0.0
    grip.triangle[i], height = foot(
        p.surface,
        grip.triangle[i],
        grip.weights[i],
        tips[i],
        state.points[i],
        state.normals[i],
        state.vectors[3],
    )
    state.depths[i] = max(state.radii_m[i] - height, 0.0)
    if height >= state.radii_m[i]:
        release(grip, i, tips[i])
