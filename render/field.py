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
    where = {tuple(sorted(t)): i for i, t in enumerate(compliance.triangles.tolist())}
    far = np.zeros((len(arrays.vertices), 3, 3))
    touched = np.unique(arrays.triangles[arrays.free > 0])
    curvature = np.zeros(len(arrays.vertices))
    curvature[touched] = mean_curvature(mesh, arrays.vertices[touched], arrays.normals[touched])
    done = np.zeros(len(arrays.vertices), dtype=bool)
    for k in np.flatnonzero(arrays.free):
        for c in range(3):
            vertex = arrays.triangles[k, c]
            if done[vertex]:
                continue
            done[vertex] = True
            triangle = where[tuple(sorted(parents[k].tolist()))]
            order = [parents[k].tolist().index(n) for n in compliance.triangles[triangle].tolist()]
            weights = surface.parent_weights[k, c][order]
            far[vertex] = compliance.far(triangle, weights, arrays.normals[vertex])
    return Field(far, curvature, parents)
