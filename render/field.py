"""The far field of every point of the contact surface, from the surface compliance of the mesh's corners."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechanics.sites import mean_curvature
from mechanics.surface_compliance import SurfaceCompliance
from mechanics.tetmesh import TetMesh
from render.surface import ContactSurface


class Field(NamedTuple):
    """far (v, 3, 3) 1/m and curvature (v,) 1/m at the fine vertices, unit modulus, zero on the base.

    parents: (k, 3) numbers of each fine triangle's mesh corners among the compliance's, -1 on the base.
    """

    far: np.ndarray
    curvature: np.ndarray
    parents: np.ndarray


def far_field(mesh: TetMesh, surface: ContactSurface, compliance: SurfaceCompliance) -> Field:
    """Evaluate the compliance at every fine vertex that may be touched."""
    arrays = surface.arrays
    number = np.full(int(max(surface.parents.max(), compliance.nodes.max())) + 1, -1, dtype=np.int64)
    number[compliance.nodes] = np.arange(len(compliance.nodes))
    parents = np.ascontiguousarray(number[surface.parents])
    touched = np.unique(arrays.triangles[arrays.free > 0])
    points, normals = arrays.vertices[touched], arrays.normals[touched]
    far = np.zeros((len(arrays.vertices), 3, 3))
    far[touched] = compliance.far_at(points, normals)
    curvature = np.zeros(len(arrays.vertices))
    curvature[touched] = mean_curvature(mesh, points, normals)
    return Field(far, curvature, parents)
