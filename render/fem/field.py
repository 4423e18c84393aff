"""The far field of every point of the contact surface, from the surface compliance of the mesh's corners."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mechanics.compliance.near_field import surface_softness
from mechanics.compliance.patch import half_space_compliance
from mechanics.compliance.sites import principal_curvatures
from mechanics.compliance.surface_compliance import SurfaceCompliance
from mechanics.contact.edges import edge_law
from mechanics.model.model import Model
from render.surface.contact_surface import ContactSurface


class Field(NamedTuple):
    """far (v, 3, 3) 1/m and curvature (v,) 1/m at the fine vertices, unit modulus, zero on the base.

    curvatures: (v, 2) 1/m the principal ones whose mean that is, convex positive, the greatest first.

    bracing: (v,) 1/m, by which a base close below makes deep dents harder (mechanics.contact.edges).
    softness: (v,) of the material under a tip, global modulus over its own.
    parents: (k, 3) numbers of each fine triangle's mesh corners among the compliance's, -1 on the base.
    """

    far: np.ndarray
    curvature: np.ndarray
    curvatures: np.ndarray
    bracing: np.ndarray
    softness: np.ndarray
    parents: np.ndarray


def far_field(model: Model, surface: ContactSurface, compliance: SurfaceCompliance) -> Field:
    """Evaluate the compliance at every fine vertex that may be touched.

    What is local is the dent's, which goes with the modulus under the tip: where that is not the global one,
    the half-space that the compliance takes off is of the wrong modulus, and the difference is given back.
    """
    arrays, mesh = surface.arrays, model.mesh
    number = np.full(int(max(surface.parents.max(), compliance.nodes.max())) + 1, -1, dtype=np.int64)
    number[compliance.nodes] = np.arange(len(compliance.nodes))
    parents = np.ascontiguousarray(number[surface.parents])
    touched = np.unique(arrays.triangles[arrays.free > 0])
    points, normals = arrays.vertices[touched], arrays.normals[touched]
    far, bracing = np.zeros((len(arrays.vertices), 3, 3)), np.zeros(len(arrays.vertices))
    missed = edge_law(mesh, points, normals)
    far[touched], bracing[touched] = compliance.far_at(points, normals) + missed.far, missed.bracing
    softness = np.ones(len(arrays.vertices))
    softness[touched] = surface_softness(mesh, model.surface_ratio, points, model.tool.tip_radius_m)
    width = float(compliance.own_width_m[0])
    for v in touched[softness[touched] != 1]:
        far[v] += (1 - softness[v]) * half_space_compliance(
            arrays.normals[v], model.material.poisson_ratio, width
        )
    curvatures = np.zeros((len(arrays.vertices), 2))
    curvatures[touched] = principal_curvatures(mesh, points, normals, model.tool.tip_radius_m)
    return Field(far, curvatures.mean(axis=1), curvatures, bracing, softness, parents)
