"""Coarse drawings of a surface, of the same volume, for a mesher that takes minutes on a fine one.

Chords cut curved faces; `balanced` puts that back. A given surface is thinned by quadric error edge collapses
(Hoppe 1999, by VTK).
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.frames import support_axes
from palpate.mechanics.shape.flat_foot import Standing
from palpate.reconstruction.shapes.drawing import corner_normals, moved, signed_gap

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
    corners = vertices[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    wanted = _FINER * area.sum() / (_PER_TRIANGLE * edge_m**2)
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
