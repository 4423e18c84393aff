"""Coarse drawings of a surface, of the same volume, for a mesher that takes minutes on a fine one.

Chords cut curved faces; `balanced` puts that back. A given surface is thinned by quadric error edge collapses
(Hoppe 1999, by VTK).

A shape with its residual field as triangles, with the standard deviation of every vertex.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.frames import support_axes
from palpate.mechanics.shape.flat_foot import Standing
from palpate.mechanics.shape.nearest import closest, facings, triangle_areas
from palpate.reconstruction.shapes.kriging import Explained

_SAMPLES = np.array([[1 / 3, 1 / 3, 1 / 3], [0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6]])
_WEIGHTS = np.array([-27, 25, 25, 25]) / 48
"""Strang and Fix's rule of third degree for the mean over a triangle."""


def balanced(
    coarse: tuple[np.ndarray, np.ndarray], fine: tuple[np.ndarray, np.ndarray], rounds: int = 2
) -> np.ndarray:
    """The coarse surface's vertices (n, 3), moved along their normals until its triangles lie on the fine
    surface in the mean; both as (vertices, triangles) in the support frame. The base stays on z = 0."""
    vertices, triangles = coarse
    on_base = vertices[:, 2] < 1e-9
    used = ~on_base[triangles].all(axis=1)
    for _ in range(rounds):
        owner, normals = corner_normals(vertices, triangles, on_base)
        corner = vertices[triangles[used]]
        area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        size = np.linalg.norm(area, axis=1)
        samples = np.einsum("sk,tkj->tsj", _SAMPLES, corner).reshape(-1, 3)
        gap = signed_gap(*fine, samples).reshape(-1, len(_SAMPLES)) @ _WEIGHTS
        row = _rows(owner, normals, triangles[used], area / np.maximum(size, 1e-18)[:, None])
        weight = np.repeat(size, 3)
        total = np.bincount(row, weight, len(owner))
        offset = np.bincount(row, weight * np.repeat(gap, 3), len(owner)) / np.maximum(total, 1e-18)
        vertices = moved(vertices, owner, normals, -offset, on_base)
    return vertices


def _rows(owner: np.ndarray, normals: np.ndarray, triangles: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """(3 m,) which row of (owner, normals) each triangle's corners belong to: of its vertex, the likest
    normal."""
    first = np.searchsorted(owner, np.arange(owner.max() + 2))
    vertex, facing = triangles.ravel(), np.repeat(unit, 3, axis=0)
    best = first[vertex]
    likeness = np.einsum("ij,ij->i", normals[best], facing)
    for k in range(1, int(np.diff(first).max())):
        other = np.minimum(first[vertex] + k, len(owner) - 1)
        valid = first[vertex] + k < first[vertex + 1]
        alike = np.where(valid, np.einsum("ij,ij->i", normals[other], facing), -2)
        best = np.where(alike > likeness, other, best)
        likeness = np.maximum(alike, likeness)
    return best


_PER_TRIANGLE = 0.43
"""Area of an equilateral triangle over its edge squared."""
_FINER = 2.0


def decimated(stood: Standing, edge_m: float) -> tuple[np.ndarray, np.ndarray]:
    """A standing surface, in its own frame, with triangles of about `edge_m`, smaller where it bends:
    vertices (n, 3) m and triangles (m, 3); itself where it has no more than that, or where it cannot be
    thinned."""
    import pyvista
    import trimesh

    vertices, triangles = stood.vertices, stood.triangles
    wanted = _FINER * triangle_areas(vertices, triangles).sum() / (_PER_TRIANGLE * edge_m**2)
    if len(triangles) <= 1.2 * wanted:
        return vertices, triangles
    axes = support_axes(stood.support_normal)
    flat = (vertices - stood.support_point) @ axes.T
    shell = pyvista.PolyData.from_regular_faces(flat, triangles)
    thin = shell.decimate(1 - wanted / len(triangles), volume_preservation=True)
    points = np.array(thin.points, dtype=float)
    points[points[:, 2] < 1e-4 * np.ptp(flat[:, 2]), 2] = 0.0
    found = trimesh.Trimesh(points, thin.regular_faces, process=False)
    if not found.is_watertight or not found.volume > 0:
        return vertices, triangles
    faces = np.asarray(found.faces)
    return balanced((points, faces), (flat, triangles)) @ axes + stood.support_point, faces


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
    area, _ = facings(vertices, triangles)
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
    normal, _ = facings(vertices, triangles[index])
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
