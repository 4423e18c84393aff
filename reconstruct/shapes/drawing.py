"""A shape with its residual field as triangles, with the standard deviation of every vertex."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.shape.nearest import closest
from palpate.reconstruction.shapes.kriging import Explained

_EDGE_COSINE = np.cos(np.radians(40))
_ROUNDING_M = 0.010
"""A rim that nobody touched may be rounded up to this radius, if no touch is nearer."""


def draw(explained: Explained, spacing_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (n, 3) in the support frame, outward triangles (m, 3), and standard deviations (n,) m.

    Where a free field is used, vertices move along their normals (along all of them at an edge) until the tip
    touches at every touch; the base stays on z = 0. A shape without one keeps its exact faces.
    """
    vertices, triangles = explained.shape.mesh(spacing_m)
    on_base = vertices[:, 2] < 1e-9
    owner, normals = corner_normals(vertices, triangles, on_base)
    points = vertices[owner]
    mean, variance = explained.field(points, normals)
    drawn = moved(vertices, owner, normals, mean, on_base) if explained.free else vertices
    if explained.free:
        touches = np.vstack([explained.seen.centres, explained.seen.outline])
        target = explained.gap.copy()
        for _ in range(2):
            target = target + signed_gap(drawn, triangles, touches) - explained.seen.tip_radius_m
            target[len(explained.seen.centres) :] += explained.lean_m
            drawn = moved(vertices, owner, normals, explained.mean(points, normals, target), on_base)
    square = np.zeros(len(vertices))
    np.add.at(square, owner, variance)
    square += _rim_deviation(vertices, owner, normals, on_base, explained) ** 2
    # first touch is found a little late everywhere alike: an error as large as the touches' own may be common
    # to all
    square += np.median(explained.seen.error_m) ** 2 + explained.law.touch_m**2
    return drawn, triangles, np.sqrt(square)


def corner_normals(
    vertices: np.ndarray, triangles: np.ndarray, on_base: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Vertex numbers (k,) and normals (k, 3) of the faces that meet there, one a group of like direction.

    The base's faces count for vertices inside the base alone.
    """
    corner = vertices[triangles]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    size = np.linalg.norm(area, axis=1)
    kept = (size > 1e-14) & ~on_base[triangles].all(axis=1)
    area, size, faces = area[kept], size[kept], triangles[kept]
    unit = area / size[:, None]
    vertex = faces.ravel()
    face = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((-size[face], vertex))
    vertex, face = vertex[order], face[order]
    starts = np.flatnonzero(np.r_[True, vertex[1:] != vertex[:-1]])
    owner, normals = [], []
    for a, b in zip(starts, np.r_[starts[1:], len(vertex)], strict=True):
        rest = face[a:b]
        while len(rest):
            alike = unit[rest] @ unit[rest[0]] > _EDGE_COSINE
            total = area[rest[alike]].sum(axis=0)
            owner.append(vertex[a])
            normals.append(total / np.linalg.norm(total))
            rest = rest[~alike]
    return np.array(owner), np.array(normals)


def moved(
    vertices: np.ndarray, owner: np.ndarray, normals: np.ndarray, by_m: np.ndarray, on_base: np.ndarray
) -> np.ndarray:
    """Vertices moved so far along each of their normals; those of the base's rim within the support."""
    count = np.bincount(owner, minlength=len(vertices))
    found = vertices.copy()
    single = (count[owner] == 1) & ~on_base[owner]
    found[owner[single]] += by_m[single, None] * normals[single]
    for vertex in np.unique(owner[~single]):
        rows = np.flatnonzero(owner == vertex)
        system, right = normals[rows], by_m[rows]
        if on_base[vertex]:
            system, right = np.vstack([system, [0, 0, 1]]), np.append(right, 0.0)
        step = np.linalg.lstsq(system, right, rcond=0.2)[0]
        if on_base[vertex]:
            step[2] = 0.0
        found[vertex] += step
    return found


def signed_gap(vertices: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(k,) m: distance of points (k, 3) from the surface, negative inside."""
    foot, index, _ = closest(vertices, triangles, points)
    corner = vertices[triangles[index]]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    side = np.sign(np.einsum("ij,ij->i", points - foot, normal))
    return side * np.linalg.norm(points - foot, axis=1)


def _rim_deviation(
    vertices: np.ndarray, owner: np.ndarray, normals: np.ndarray, on_base: np.ndarray, explained: Explained
) -> np.ndarray:
    """(n,) m: an edge may be rounded as far as the nearest touch, unnoticed. Uniform radius, so 0.41 /
    3^(1/2) of it."""
    count = np.bincount(owner, minlength=len(vertices))
    edge = np.flatnonzero((count > 1) & ~on_base)
    found = np.zeros(len(vertices))
    if not len(edge):
        return found
    touched = cKDTree(explained.feet[0][: len(explained.seen.centres)])
    reach = np.minimum(touched.query(vertices[edge])[0], _ROUNDING_M)
    away, nearest = cKDTree(vertices[edge]).query(vertices)
    room = np.maximum(reach[nearest], 1e-6)
    share = np.clip(1 - away / room, 0, 1)
    return (np.sqrt(2) - 1) / np.sqrt(3) * room * share**2
