"""The end of a tick for one held tip: memories are written, the model's effects act, a free tip is let go."""

from __future__ import annotations

from palpate.mechanics.contact.dent import dent_load
from palpate.mechanics.contact.touch import touch_remember
from palpate.mechanics.effects.laws_along_path import sharp_laws, smooth_laws
from palpate.mechanics.kernels import part
from palpate.render.surface.contact import release
from palpate.render.surface.walking import foot


@part
def forget(state, i):
    """A new touch of tip i remembers nothing of the last one (what the material felt stays in `felt`)."""
    for k in range(4):
        state.memory[i, k] = 0.0
    state.deepest[i] = 0.0
    for law in range(state.remembered.shape[1]):
        for k in range(state.remembered.shape[2]):
            state.remembered[i, law, k] = 0.0


@part
def conclude(p, state, tips, i):
    """Write tip i's memories and its force; let go of it where nothing presses and nothing pulls."""
    grip, out, normal = state.grip, state.solution[i], state.normals[i]
    pressed = out[0] > 0.0
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
    if not pressed and depth <= -p.effects.path.reach_m[0]:
        forget(state, i)
        release(grip, i, tips[i])


@part
def _force(p, state, i, depth):
    """The force that is rendered: what the laws along the path make of the quasi-static one."""
    force, path = state.forces[i], p.effects.path
    for k in range(3):
        force[k] = state.elastic[i, k]
    load = most = 0.0
    if path.loads[0] > 0:
        load = dent_load(depth)
        most = _felt(p, state, i, load)
    memory, deepest, dt, normal = state.remembered[i], state.deepest[i], state.dt_s[0], state.normals[i]
    smooth_laws(path.numbers, memory, depth, deepest, load, most, dt, normal, force)
    sharp_laws(path.numbers, memory, depth, deepest, load, most, dt, normal, force)


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
