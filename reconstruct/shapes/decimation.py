"""A given surface drawn with fewer triangles, no more than its tetrahedra need: the mesher takes minutes on
a scan.

Quadric error edge collapses (Hoppe 1999, by VTK), then the volume is put right.
"""

from __future__ import annotations

import numpy as np

from mechanics.frames import support_axes
from mechanics.standing import Standing
from reconstruct.shapes.balance import balanced

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
