"""The end of a tick for one held tip: memories are written, the model's effects act, a free tip is let go."""

from __future__ import annotations

from mechanics.effects.adhesion import adhesive_pull
from mechanics.effects.mullins_softening import dent_energy, softening
from mechanics.effects.viscoelasticity import prony_step
from mechanics.touch import touch_remember
from render.contact import release
from render.kernels import part
from render.walking import foot


@part
def forget(state, i):
    """A new touch of tip i remembers nothing of the last one (what the material felt stays in `felt`)."""
    for k in range(4):
        state.memory[i, k] = 0.0
    state.deepest[i] = 0.0
    for k in range(3):
        state.before[i, k] = 0.0
        for branch in range(state.prony.shape[1]):
            state.prony[i, branch, k] = 0.0


@part
def conclude(p, state, tips, i):
    """Write tip i's memories and its force; let go of it where nothing presses and nothing pulls."""
    grip, out, normal = state.grip, state.solution[i], state.normals[i]
    pressed = out[2] > 0.0
    if pressed:
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
    if not pressed and depth <= -p.effects.adhesion[1]:
        forget(state, i)
        release(grip, i, tips[i])


@part
def _force(p, state, i, depth):
    """The force that is rendered: softened, with its memory, never pulling but for adhesion."""
    force, normal, e = state.forces[i], state.normals[i], p.effects
    factor = _softened(p, state, i, depth) if e.mullins[0] > 0.0 else 1.0
    push = 0.0
    for k in range(3):
        slow = factor * state.elastic[i, k]
        force[k] = slow + prony_step(
            state.prony[i], slow - state.before[i, k], state.dt_s[0], e.g, e.tau_s, k
        )
        state.before[i, k] = slow
        push += force[k] * normal[k]
    pull = 0.0
    if e.adhesion[0] > 0.0:
        pull = adhesive_pull(depth, state.deepest[i], e.adhesion[0], e.adhesion[1], e.adhesion[2])
    for k in range(3):
        force[k] = (force[k] if push > 0.0 else 0.0) - pull * normal[k]


@part
def _softened(p, state, i, depth):
    t, weights = state.grip.triangle[i], state.grip.weights[i]
    energy, greatest = dent_energy(depth), 0.0
    for c in range(3):
        vertex = p.surface.triangles[t, c]
        state.felt[vertex] = max(state.felt[vertex], energy)
        greatest += weights[c] * state.felt[vertex]
    return softening(energy, greatest, p.effects.mullins[0], p.effects.mullins[1])
