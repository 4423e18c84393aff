"""The local frame of a contact: rows n, u, v, carried along without spin as the normal turns.

How held tips feel one another: the compliance between their places, kept for as long as they stay.

A tip's place is interpolated between three corners of the mesh. The blocks of a pair's corners change only
when one of the two comes onto another facet, some times a second, and are gathered then; the weights change
whenever it slides. A large surface has a low-rank factor instead (mechanics.compliance.compression), mixed
at each place.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.compliance.compression import between_mixed, mix_factor
from palpate.mechanics.kernels import inner, part


@part
def turn_frame(frame, normal):
    """Parallel-transport the rows (n, u, v) of `frame` (3, 3) to a new normal: no spin about it."""
    for r in range(1, 3):
        dot = 0.0
        for k in range(3):
            dot += frame[r, k] * normal[k]
        for k in range(3):
            frame[r, k] -= dot * normal[k]
    length = np.sqrt(frame[1, 0] ** 2 + frame[1, 1] ** 2 + frame[1, 2] ** 2)
    for k in range(3):
        frame[1, k] /= length
        frame[0, k] = normal[k]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        frame[2, k] = normal[i] * frame[1, j] - normal[j] * frame[1, i]


@inner
def new_frame(frame, normal):
    """Any right-handed rows (n, u, v), chosen by the normal alone."""
    axis = 0
    if abs(normal[1]) < abs(normal[axis]):
        axis = 1
    if abs(normal[2]) < abs(normal[axis]):
        axis = 2
    for k in range(3):
        frame[1, k] = (1.0 if k == axis else 0.0) - normal[axis] * normal[k]
    turn_frame(frame, normal)


NOWHERE = -2
BLEND_S = 0.05
"""In which a touch that goes on comes from one table to the next: no hand feels it jump."""


@part
def locate(p, state, i):
    """Corners and weights of tip i (over the root of the modulus: pairs need no division), and `moved`."""
    grip = state.grip
    t = grip.triangle[i]
    state.moved[i, 0] = state.moved[i, 1] = 0
    scale = 1.0 / np.sqrt(p.young_modulus_pa[0])
    for a in range(3):
        weight = 0.0
        for corner in range(3):
            weight += grip.weights[i, corner] * p.parent_weights[t, corner, a]
        weight *= scale
        if state.nodes[i, a] != p.parents[t, a]:
            state.moved[i, 0] = state.moved[i, 1] = 1
            state.nodes[i, a] = p.parents[t, a]
        if state.node_weights[i, a] != weight:
            state.moved[i, 1] = 1
            state.node_weights[i, a] = weight
    if state.moved[i, 1] and p.factor.shape[2]:
        mix_factor(p.factor, state.nodes[i], state.node_weights[i], state.mixed[i])


@part
def leave(state, i):
    """Tip i is in the air: it moves nobody, and its next place counts as new."""
    state.nodes[i, 0] = NOWHERE
    for k in range(3):
        state.elastic[i, k] = state.quasi[i, k] = 0.0


@part
def renew(p, state):
    """Where the table was exchanged under a running state, every place counts as new, and the far field of
    before gives way to the new one within BLEND_S."""
    if state.before[0] > 0.0:
        state.before[0] = max(state.before[0] - state.dt_s[0] / BLEND_S, 0.0)
    if state.edition[0] != p.edition[0]:
        state.edition[0] = p.edition[0]
        state.before[0] = 1.0
        for i in range(state.nodes.shape[0]):
            state.nodes[i, 0] = NOWHERE


@inner
def _gather(blocks, nodes_i, nodes_j, corners):
    """The nine blocks between the corners of two places, side by side; held corners (-1) do not move."""
    for a in range(3):
        for b in range(3):
            held = nodes_i[a] < 0 or nodes_j[b] < 0
            for r in range(3):
                for c in range(3):
                    block = 0.0 if held else blocks[nodes_i[a], nodes_j[b], r, c]
                    corners[3 * a + b, 3 * r + c] = block


@part
def link(p, state, i):
    """The links between tip i and the held tips before it, as far as one of the two has moved."""
    block = state.vectors[:3]
    flat = state.flat
    for j in range(i):
        if state.grip.triangle[j] < 0 or (state.moved[i, 1] == 0 and state.moved[j, 1] == 0):
            continue
        if p.factor.shape[2]:
            between_mixed(state.mixed[i], state.mixed[j], block)
            for k in range(9):
                flat[k] = block[k // 3, k % 3]
        else:
            corners = state.corners[i, j]
            if state.moved[i, 0] or state.moved[j, 0]:
                _gather(p.blocks, state.nodes[i], state.nodes[j], corners)
            for k in range(9):
                flat[k] = 0.0
            for a in range(3):
                for b in range(3):
                    w = state.node_weights[i, a] * state.node_weights[j, b]
                    for k in range(9):
                        flat[k] += w * corners[3 * a + b, k]
        for r in range(3):
            for c in range(3):
                state.links[j, c, r, i] = flat[3 * r + c]
                state.links[i, r, c, j] = flat[3 * r + c]


@inner
def carry(links, carried, x, y, z):
    """Add to `carried` (3, m) what a force (x, y, z) N on the tool with these links (3, 3, m) takes away."""
    for k in range(3):
        for i in range(carried.shape[1]):
            carried[k, i] += links[0, k, i] * x + links[1, k, i] * y + links[2, k, i] * z


@part
def carry_all(state):
    """`carried` anew from the forces of all held tips."""
    for k in range(3):
        for i in range(state.carried.shape[1]):
            state.carried[k, i] = 0.0
    for j in range(state.carried.shape[1]):
        if state.grip.triangle[j] >= 0:
            force = state.elastic[j]
            carry(state.links[j], state.carried, force[0], force[1], force[2])
