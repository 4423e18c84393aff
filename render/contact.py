"""Where a spherical tip touches the contact surface, and how its anchor walks there; kernels on plain arrays.

The anchor is the material point of the undeformed surface that holds the tip: the god-object (Zilles &
Salisbury 1995) in the object's material frame. It is found once, from outside, and then only walks from
triangle to triangle, so a tip cannot pop through a thin object nor change sides while it presses.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from render.bvh import closest_triangle

FOOT_STEPS = 12
WALK_EDGES = 64
SWEEP_STEPS = 24
FAR = 0.02  # m beyond the tip's radius that a search looks; clearances above it are as good as that


@njit(cache=True, error_model="numpy")
def place(surface, triangle, weights, point, normal):
    """Write the point (3,) m and unit contact normal (3,) at barycentric weights (3,) of a triangle."""
    length = 0.0
    for k in range(3):
        p = n = 0.0
        for c in range(3):
            v = surface.triangles[triangle, c]
            p += weights[c] * surface.vertices[v, k]
            n += weights[c] * surface.normals[v, k]
        point[k] = p
        normal[k] = n
        length += n * n
    length = np.sqrt(length)
    for k in range(3):
        normal[k] /= length


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def walk(surface, triangle, weights, move):
    """Carry the anchor along the surface by `move` (3,) m, unfolding it over edges; returns its triangle.

    The base cannot be entered: at its rim the rest of the way goes along the edge. `weights` and `move`
    change.
    """
    for _ in range(WALK_EDGES):
        v0 = surface.triangles[triangle, 0]
        v1 = surface.triangles[triangle, 1]
        v2 = surface.triangles[triangle, 2]
        # rates of the barycentric weights along the move's part in the plane
        aa = ab = bb = ma = mb = 0.0
        for k in range(3):
            a = surface.vertices[v1, k] - surface.vertices[v0, k]
            b = surface.vertices[v2, k] - surface.vertices[v0, k]
            aa += a * a
            ab += a * b
            bb += b * b
            ma += move[k] * a
            mb += move[k] * b
        det = aa * bb - ab * ab
        r1 = (bb * ma - ab * mb) / det
        r2 = (aa * mb - ab * ma) / det
        r0 = -r1 - r2
        part, leaving = 1.0, -1
        if r0 < 0.0 and -weights[0] > r0 * part:
            part, leaving = -weights[0] / r0, 0
        if r1 < 0.0 and -weights[1] > r1 * part:
            part, leaving = -weights[1] / r1, 1
        if r2 < 0.0 and -weights[2] > r2 * part:
            part, leaving = -weights[2] / r2, 2
        weights[0] = max(weights[0] + part * r0, 0.0)
        weights[1] = max(weights[1] + part * r1, 0.0)
        weights[2] = max(weights[2] + part * r2, 0.0)
        total = weights[0] + weights[1] + weights[2]
        weights[0] /= total
        weights[1] /= total
        weights[2] /= total
        if leaving < 0:
            return triangle
        edge = (leaving + 1) % 3  # the edge opposite to the weight that vanished
        start, end = surface.triangles[triangle, edge], surface.triangles[triangle, (edge + 1) % 3]
        other = surface.neighbours[triangle, edge]
        along = length = 0.0
        for k in range(3):
            e = surface.vertices[end, k] - surface.vertices[start, k]
            along += move[k] * e
            length += e * e
        rest = 1.0 - part
        blocked = other < 0 or surface.free[other] == 0
        if blocked:
            for k in range(3):
                e = surface.vertices[end, k] - surface.vertices[start, k]
                move[k] = rest * along / length * e
            if rest * abs(along) <= 1e-12 * length:
                return triangle
            continue
        # the rest turns with the surface: what crosses the edge continues inwards in the neighbour's plane
        across = 0.0
        for k in range(3):
            a = surface.vertices[v1, k] - surface.vertices[v0, k]
            b = surface.vertices[v2, k] - surface.vertices[v0, k]
            in_plane = (r1 * a + r2 * b) * rest
            e = surface.vertices[end, k] - surface.vertices[start, k]
            perpendicular = in_plane - rest * along / length * e
            across += perpendicular * perpendicular
        across = np.sqrt(across)
        third = 0
        for c in range(3):
            v = surface.triangles[other, c]
            if v != start and v != end:
                third = c
        t = surface.triangles[other, third]
        foot = 0.0
        for k in range(3):
            e = surface.vertices[end, k] - surface.vertices[start, k]
            foot += (surface.vertices[t, k] - surface.vertices[start, k]) * e
        foot /= length
        inward = 0.0
        for k in range(3):
            e = surface.vertices[end, k] - surface.vertices[start, k]
            h = surface.vertices[t, k] - surface.vertices[start, k] - foot * e
            inward += h * h
        inward = np.sqrt(inward)
        for k in range(3):
            e = surface.vertices[end, k] - surface.vertices[start, k]
            h = surface.vertices[t, k] - surface.vertices[start, k] - foot * e
            move[k] = rest * along / length * e + across * h / inward
        w_start, w_end = weights[edge], weights[(edge + 1) % 3]
        for c in range(3):
            v = surface.triangles[other, c]
            weights[c] = w_start if v == start else (w_end if v == end else 0.0)
        triangle = other
    return triangle


@njit(cache=True, error_model="numpy")
def foot(surface, triangle, weights, tip, point, normal, move):
    """Walk the anchor to where the contact normal points at the tip: no tangential offset is left.

    Writes weights, point, normal; returns (triangle, height): height = n . (tip - point), m.
    """
    height = 0.0
    for step in range(FOOT_STEPS):
        place(surface, triangle, weights, point, normal)
        height = 0.0
        for k in range(3):
            height += normal[k] * (tip[k] - point[k])
        squared = 0.0
        for k in range(3):
            move[k] = tip[k] - point[k] - height * normal[k]
            squared += move[k] * move[k]
        if squared < 1e-20 or step == FOOT_STEPS - 1:
            break
        if step > 3:  # on tight convexities full steps overshoot: damp them
            for k in range(3):
                move[k] *= 0.5
        triangle = walk(surface, triangle, weights, move)
    return triangle, height


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def _arm(surface, grip, tip, i, radius, weights, stack):
    """A tip that starts inside gets no support: it has to come out before it is touched."""
    triangle, distance = closest_triangle(
        surface.bvh, surface.vertices, surface.triangles, tip, np.inf, weights, stack
    )
    if distance > radius and outside(surface, triangle, weights, tip):
        grip.armed[i] = 1
        grip.clearance[i] = distance - radius
    for k in range(3):
        grip.previous[i, k] = tip[k]


@njit(cache=True, error_model="numpy")
def release(grip, i, tip):
    """Let go of tip i; it is outside, where it is now."""
    grip.triangle[i] = -1
    grip.clearance[i] = 0.0
    for k in range(3):
        grip.previous[i, k] = tip[k]


@njit(cache=True, error_model="numpy")
def lose(grip, i):
    """Forget tip i: its next reading counts as its first."""
    grip.triangle[i] = -1
    grip.armed[i] = 0


@njit(cache=True, error_model="numpy")
def turn_frame(frame, normal):
    """Parallel-transport the rows (u, v, n) of `frame` (3, 3) to a new normal: no spin about it."""
    for r in range(2):
        dot = 0.0
        for k in range(3):
            dot += frame[r, k] * normal[k]
        for k in range(3):
            frame[r, k] -= dot * normal[k]
    length = np.sqrt(frame[0, 0] ** 2 + frame[0, 1] ** 2 + frame[0, 2] ** 2)
    for k in range(3):
        frame[0, k] /= length
        frame[2, k] = normal[k]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        frame[1, k] = normal[i] * frame[0, j] - normal[j] * frame[0, i]


@njit(cache=True, error_model="numpy")
def new_frame(frame, normal):
    """Any right-handed rows (u, v, n), chosen by the normal alone."""
    axis = 0
    if abs(normal[1]) < abs(normal[axis]):
        axis = 1
    if abs(normal[2]) < abs(normal[axis]):
        axis = 2
    for k in range(3):
        frame[0, k] = (1.0 if k == axis else 0.0) - normal[axis] * normal[k]
    turn_frame(frame, normal)
