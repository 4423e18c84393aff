"""How an anchor walks over the contact surface: from triangle to triangle, and to the point below a tip.

An anchor is a triangle and barycentric weights (3,) in it. Nothing is searched for, so a walk costs the same
on any surface and cannot leave the side that it is on.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.kernels import inner, kernel, shared_part

FOOT_STEPS = 24
FOOT_LEAST = 0.5  # of what is left, what a walk of that length takes away at least: it grows no faster
WALK_EDGES = 64


@shared_part
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


@inner
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


@inner
def rim_across(surface, triangle, weights, across):
    """Write the unit direction (3,), in the triangle's plane, that leads from an anchor on the rim into the
    base, where `walk` stops; zeros where the anchor is not on it."""
    for k in range(3):
        across[k] = 0.0
    for c in range(3):
        edge = (c + 1) % 3
        other = surface.neighbours[triangle, edge]
        if weights[c] > 1e-9 or not (other < 0 or surface.free[other] == 0):
            continue
        top = surface.triangles[triangle, c]
        start, end = surface.triangles[triangle, edge], surface.triangles[triangle, (edge + 1) % 3]
        along = length = 0.0
        for k in range(3):
            e = surface.vertices[end, k] - surface.vertices[start, k]
            along += (surface.vertices[top, k] - surface.vertices[start, k]) * e
            length += e * e
        size = 0.0
        for k in range(3):
            e = surface.vertices[end, k] - surface.vertices[start, k]
            across[k] = surface.vertices[start, k] + along / length * e - surface.vertices[top, k]
            size += across[k] * across[k]
        size = np.sqrt(size)
        for k in range(3):
            across[k] /= size


@kernel
def foot(surface, triangle, weights, tip, point, normal, move):
    """Walk the anchor to where the contact normal points at the tip: no tangential offset is left.

    Writes weights, point, normal; returns (triangle, height): height = n . (tip - point), m.
    """
    height, share, before = 0.0, 1.0, 0.0
    last_x = last_y = last_z = 0.0
    for step in range(FOOT_STEPS):
        place(surface, triangle, weights, point, normal)
        height = 0.0
        for k in range(3):
            height += normal[k] * (tip[k] - point[k])
        x, y, z = (
            tip[0] - point[0] - height * normal[0],
            tip[1] - point[1] - height * normal[1],
            tip[2] - point[2] - height * normal[2],
        )
        squared = x * x + y * y + z * z
        if squared < 1e-20 or step == FOOT_STEPS - 1:
            break
        if step > 0:
            # over a tight convexity a walk takes away several times its own length of what is left
            taken = before - (x * last_x + y * last_y + z * last_z)
            share = min(share * before / max(taken, FOOT_LEAST * before), 1.0)
        before, last_x, last_y, last_z = squared, x, y, z
        move[0], move[1], move[2] = share * x, share * y, share * z
        triangle = walk(surface, triangle, weights, move)
    return triangle, height
