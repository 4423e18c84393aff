"""Bounds of a convex object: the hull of touched points and base (the paper's surface, section 2.2) inside,
the half-spaces behind the tangent planes at all touches outside."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import Delaunay, HalfspaceIntersection, QhullError

from palpate.mechanics.errors import SurfaceError
from palpate.mechanics.shape.nearest import distance
from palpate.reconstruction.shapes.evidence import Evidence
from palpate.reconstruction.shapes.fit import LEAN_M
from palpate.reconstruction.shapes.points import farthest_points

_SECTORS = 48


def hull_surface(evidence: Evidence, base_spacing_m: float = 0.005) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and outward triangles (m, 3) of the hull in the support frame, base on z = 0.

    Touched points below the support are lifted onto it. The hull is an inner bound of a convex object.
    Raises SurfaceError where the points are flat.
    """

    rim = evidence.to_support(evidence.outline)
    rim[:, 2] = 0.0
    rim = rim[farthest_points(rim, base_spacing_m)]
    touched = evidence.to_support(evidence.points)
    touched[:, 2] = np.maximum(touched[:, 2], 0.0)
    return delaunay_hull(np.vstack([rim, touched]))


def delaunay_hull(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward triangles of the convex hull of points (n, 3)."""
    try:
        triangles = Delaunay(points).convex_hull
    except QhullError as error:
        raise SurfaceError(
            "the touched points and the base lie in one plane: touch the object above its base"
        ) from error
    used = np.unique(triangles)
    index = np.full(len(points), -1)
    index[used] = np.arange(len(used))
    vertices, triangles = points[used], index[triangles]
    corner = vertices[triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    inward = np.einsum("ij,ij->i", normal, corner[:, 0] - vertices.mean(axis=0)) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return vertices, triangles


def tangent_surface(evidence: Evidence, slack_m: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and outward triangles (m, 3) in the support frame, base on z = 0.

    A plane stands at every touch, moved out by `slack_m`, facing as the first force says but turned as far as
    needed for no other touch to lie before it (`supporting_normals`), so that the hull lies inside. An object
    that does not lean outwards stays within its base: an upright plane stands at each of 48 sectors of the
    outline, as far out as tracing hands lean in.
    Raises SurfaceError where the planes enclose nothing.
    """
    rim = evidence.to_support(evidence.outline)[:, :2]
    touched = evidence.to_support(evidence.points)
    ground = np.column_stack([rim[::8], np.zeros(len(rim[::8]))])
    normals = supporting_normals(touched, evidence.normals @ evidence.axes.T, np.vstack([touched, ground]))
    offsets = (touched * normals).sum(axis=1) + slack_m
    angle = 2 * np.pi * np.arange(_SECTORS) / _SECTORS
    walls = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_SECTORS)])
    reach = (rim @ walls[:, :2].T).max(axis=0) + LEAN_M + slack_m
    top = touched[:, 2].max() + 0.02
    planes = np.vstack(
        [
            np.column_stack([normals, -offsets]),
            np.column_stack([walls, -reach]),
            [[0, 0, -1, 0.0], [0, 0, 1, -top]],
        ]
    )
    inside = np.array([*rim.mean(axis=0), 0.3 * touched[:, 2].max()])
    if (planes[:, :3] @ inside + planes[:, 3]).max() > -1e-4:
        raise SurfaceError("the tangent planes at the touches enclose nothing: the object is not convex")
    try:
        corners = HalfspaceIntersection(planes, inside).intersections
    except QhullError as error:
        raise SurfaceError("the tangent planes at the touches do not close: touch more places") from error
    corners[np.abs(corners[:, 2]) < 1e-9, 2] = 0.0
    return delaunay_hull(np.unique(corners.round(9), axis=0))


def supporting_normals(points: np.ndarray, normals: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The unit normals (k, 3) closest to `normals` whose planes through `points` (k, 3) have all `others`
    behind them.

    Projection onto the cone {n: n . (q - p) <= 0 for all q}, by non-negative least squares on its polar cone
    (Moreau). A point inside the others' hull has no such plane and keeps its normal.
    """
    found = normals.copy()
    for k, (point, normal) in enumerate(zip(points, normals, strict=True)):
        offset = others - point
        away = np.linalg.norm(offset, axis=1)
        # places nearer than the touches' own error say nothing about the direction
        toward = offset[away > 0.003] / away[away > 0.003, None]
        projected = normal - toward.T @ nnls(toward.T, normal)[0]
        length = np.linalg.norm(projected)
        if length > 0.5:
            found[k] = projected / length
    return found


def volume_bounds(evidence: Evidence) -> tuple[float, float]:
    """Volumes (m^3) of the hull of the touches and of the intersection of their tangent half-spaces (or
    nan)."""
    import trimesh

    low = float(trimesh.Trimesh(*hull_surface(evidence), process=False).volume)
    try:
        high = float(trimesh.Trimesh(*tangent_surface(evidence), process=False).volume)
    except SurfaceError:
        high = float("nan")
    return low, high


def gap_to_other_bound(evidence: Evidence, vertices: np.ndarray, which: str) -> np.ndarray:
    """(n,) m: half the distance to the other bound, as a standard deviation of a bound."""
    try:
        other = tangent_surface(evidence) if which == "hull" else hull_surface(evidence)
    except SurfaceError:
        return np.full(len(vertices), 0.002)
    return distance(*other, vertices) / 2
