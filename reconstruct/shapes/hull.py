"""The paper's surface: convex hull of the touched points and the base, by Delaunay (section 2.2)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay, QhullError

from mechanics.errors import SurfaceError
from reconstruct.shapes.evidence import Evidence
from reconstruct.shapes.points import farthest_points


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
