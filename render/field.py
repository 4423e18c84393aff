"""The far field and the coupling of contacts, from the condensed compliance onto the contact surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from mechanics.compliance import Compliance

from mechanics.model import Model
from mechanics.progress import Progress, silent
from mechanics.sites import mean_curvature
from render.surface import ContactSurface


class Field(NamedTuple):
    """far (v, 3, 3) 1/m and curvature (v,) 1/m at the fine vertices; parents (k, 3) numbers among the
    compliance's nodes, -1 where fixed."""

    far: np.ndarray
    curvature: np.ndarray
    parents: np.ndarray


def far_field(
    model: Model, surface: ContactSurface, compliance: Compliance, progress: Progress = silent
) -> Field:
    """Evaluate the far field of every touchable fine vertex; unit modulus."""
    arrays = surface.arrays
    touched = np.unique(arrays.triangles[arrays.free > 0])
    points, normals = arrays.vertices[touched], arrays.normals[touched]
    count = len(arrays.vertices)
    far = np.zeros((count, 3, 3))
    far[touched] = compliance.far(points, normals, progress=progress)
    curvature = np.zeros(count)
    curvature[touched] = mean_curvature(model.mesh, points, normals)
    number = np.full(len(model.mesh.points), -1, dtype=np.int64)
    number[compliance.nodes] = np.arange(len(compliance.nodes))
    return Field(far, curvature, np.ascontiguousarray(number[surface.parents]))
