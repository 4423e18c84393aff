"""Outer bound of a convex object: the half-spaces behind the tangent planes at all touches, and the
base's."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import HalfspaceIntersection, QhullError

from mechanics.errors import SurfaceError
from reconstruct.shapes.evidence import Evidence
from reconstruct.shapes.fit import LEAN_M
from reconstruct.shapes.hull import delaunay_hull

_SECTORS = 48


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
