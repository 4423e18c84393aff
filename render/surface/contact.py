"""When a spherical tip comes to touch the contact surface, and when it lets go; kernels on plain arrays.

The anchor is the material point of the undeformed surface that holds the tip: the god-object (Zilles &
Salisbury 1995) in the object's material frame. It is found once, from outside, and then only walks from
triangle to triangle, so a tip cannot pop through a thin object nor change sides while it presses.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.kernels import inner, kernel
from palpate.render.surface.bvh import closest_triangle
from palpate.render.surface.walking import foot

SWEEP_STEPS = 24
CLEAR = 1e-6  # m off the surface that counts as outside, whatever rounding says
OVERLAP = 0.5  # of the depth below the anchor's plane: a tip that overlaps the object by less has left
FAR = 0.02  # m beyond the tip's radius that a search looks; clearances above it are as good as that


@kernel
def outside(surface, triangle, weights, tip):
    """Whether `tip` (3,) lies outside, told by the pseudonormal at its closest point (Baerentzen & Aanaes
    2005)."""
    zero = 0
    for c in range(3):
        if weights[c] <= 1e-12:
            zero += 1
    dot = 0.0
    for k in range(3):
        p = 0.0
        for c in range(3):
            p += weights[c] * surface.vertices[surface.triangles[triangle, c], k]
        if zero == 2:
            n = 0.0
            for c in range(3):
                if weights[c] > 1e-12:
                    n = surface.vertex_pseudo[surface.triangles[triangle, c], k]
        elif zero == 1:
            n = 0.0
            for c in range(3):  # edge c runs from corner c to c + 1: its opposite weight is zero
                if weights[(c + 2) % 3] <= 1e-12:
                    n = surface.edge_pseudo[triangle, c, k]
        else:
            a, b, d = (
                surface.triangles[triangle, 0],
                surface.triangles[triangle, 1],
                surface.triangles[triangle, 2],
            )
            i, j = (k + 1) % 3, (k + 2) % 3
            n = (surface.vertices[b, i] - surface.vertices[a, i]) * (
                surface.vertices[d, j] - surface.vertices[a, j]
            ) - (surface.vertices[b, j] - surface.vertices[a, j]) * (
                surface.vertices[d, i] - surface.vertices[a, i]
            )
        dot += (tip[k] - p) * n
    return dot > 0.0


@inner
def approach(surface, grip, tip, i, radius, point, normal, work, stack):
    """Sweep tip i from where it was last seen to `tip` (3,); take hold at the first touch from outside.

    Conservative advancement: the sphere moves by its distance to the surface, so it cannot jump a wall.
    Writes the grip; returns 1 where it now holds, with its point and normal. work: (3, 3) scratch.
    """
    move, at, weights = work[0], work[1], work[2]
    if grip.armed[i] == 0:
        _arm(surface, grip, tip, i, radius, weights, stack)
        return 0
    total = 0.0
    for k in range(3):
        move[k] = tip[k] - grip.previous[i, k]
        total += move[k] * move[k]
    total = np.sqrt(total)
    travelled = min(total, grip.clearance[i])
    grip.clearance[i] -= travelled
    for _ in range(SWEEP_STEPS):
        share = travelled / total if total > 0.0 else 1.0
        for k in range(3):
            at[k] = tip[k] if share >= 1.0 else grip.previous[i, k] + share * move[k]
        if grip.clearance[i] > 0.0:
            break
        limit = radius + FAR
        triangle, distance = closest_triangle(
            surface.bvh, surface.vertices, surface.triangles, at, limit, weights, stack
        )
        if triangle >= 0 and distance <= radius:
            if surface.free[triangle] == 0:
                grip.armed[i] = 0  # it came through the base: nothing is rendered there
                break
            for c in range(3):
                grip.weights[i, c] = weights[c]
            held, height = foot(surface, triangle, grip.weights[i], at, point, normal, weights)
            if height <= radius:
                grip.triangle[i] = held
                return 1
            # the rounded normal puts first touch a little deeper than the facets do: go on by a hair
            distance = height
        grip.clearance[i] = max(distance - radius, 1e-7)
        if share >= 1.0:
            break
        onward = min(total - travelled, max(grip.clearance[i], 1e-6))
        travelled += onward
        grip.clearance[i] -= onward
    for k in range(3):
        grip.previous[i, k] = at[k]
    return 0


@inner
def _arm(surface, grip, tip, i, radius, weights, stack):
    """A tip that starts inside or at the surface feels nothing until it has been off it by CLEAR."""
    triangle, distance = closest_triangle(
        surface.bvh, surface.vertices, surface.triangles, tip, np.inf, weights, stack
    )
    if distance > radius + CLEAR and outside(surface, triangle, weights, tip):
        grip.armed[i] = 1
        grip.clearance[i] = distance - radius
    for k in range(3):
        grip.previous[i, k] = tip[k]


@inner
def strayed(surface, tip, point, normal, radius, weights, stack):
    """Whether a tip that was carried away from its anchor is off the object, or nearly so.

    An anchor that sticks near a rim takes a tip that passes by for one that goes in: by its plane the tip is
    deep, while it overlaps the object by little. Only asked where the tip is more than its radius aside.
    """
    along = squared = 0.0
    for k in range(3):
        d = tip[k] - point[k]
        along += d * normal[k]
        squared += d * d
    if not squared - along * along > radius * radius:
        return False
    triangle, distance = closest_triangle(
        surface.bvh, surface.vertices, surface.triangles, tip, np.inf, weights, stack
    )
    if triangle < 0 or not outside(surface, triangle, weights, tip):
        return False
    return radius - distance < OVERLAP * (radius - along)


@inner
def release(grip, i, tip):
    """Let go of tip i; it is outside, where it is now."""
    grip.triangle[i] = -1
    grip.clearance[i] = 0.0
    for k in range(3):
        grip.previous[i, k] = tip[k]


@inner
def lose(grip, i):
    """Forget tip i: its next reading counts as its first."""
    grip.triangle[i] = -1
    grip.armed[i] = 0
