"""What the finite-element renderer knows of each vertex of the contact surface, at once or on demand."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.compliance.near_field import surface_softness
from palpate.mechanics.compliance.on_demand import OnDemandCompliance
from palpate.mechanics.compliance.patch import half_space_compliance
from palpate.mechanics.compliance.sites import principal_curvatures
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance
from palpate.mechanics.contact.edges import edge_law
from palpate.mechanics.errors import MeshError
from palpate.mechanics.model.model import Model
from palpate.render.surface.contact_surface import ContactSurface


class FineSurface:
    """far: (v, 3, 3) 1/m, unit modulus, NaN where it is not solved yet, zero on the base. curvature: (v,) 1/m
    mean of the principal ones, convex positive, and what a rim close by adds (mechanics.contact.edges); only
    where far is known.

    bracing: (v,) 1/m, by which a base close below makes deep dents harder (mechanics.contact.edges).
    softness: (v,) of the material under a tip, global modulus over its own. parents: (k, 3) numbers of each
    fine triangle's mesh corners among the compliance's, -1 on the base.

    What is local is the dent's, which goes with the modulus under the tip: where that is not the global one,
    the half-space that the compliance takes off is of the wrong modulus, and the difference is given back.
    """

    def __init__(
        self, model: Model, surface: ContactSurface, compliance: SurfaceCompliance | OnDemandCompliance
    ) -> None:
        arrays, mesh, nu = surface.arrays, model.mesh, model.material.poisson_ratio
        number = np.full(int(max(surface.parents.max(), compliance.nodes.max())) + 1, -1, dtype=np.int64)
        number[compliance.nodes] = np.arange(len(compliance.nodes))
        self.parents = np.ascontiguousarray(number[surface.parents])
        self._model, self._vertices, self._normals = model, arrays.vertices, arrays.normals
        touched = np.unique(arrays.triangles[arrays.free > 0])
        points, normals = arrays.vertices[touched], arrays.normals[touched]
        v, tip = len(arrays.vertices), model.tool.tip_radius_m
        self.far, self._added = np.zeros((v, 3, 3)), np.zeros((v, 3, 3))
        self.curvature, self.bracing, self.softness = np.zeros(v), np.zeros(v), np.ones(v)
        self._rims = np.zeros(v)
        missed = edge_law(mesh, points, normals, nu)
        self._added[touched], self.bracing[touched] = missed.far, missed.bracing
        self._rims[touched] = missed.curvature
        self.softness[touched] = surface_softness(mesh, model.surface_ratio, points, tip)
        width = float(compliance.own_width_m[0])
        for k in touched[self.softness[touched] != 1]:
            self._added[k] += (1 - self.softness[k]) * half_space_compliance(arrays.normals[k], nu, width)
        if mesh.shape is None:  # all are fitted at once: each is the same only among the same
            bent = principal_curvatures(mesh, points, normals, tip).mean(axis=1)
            self.curvature[touched] = bent + missed.curvature
        self.far[touched] = np.nan
        if not isinstance(compliance, OnDemandCompliance):
            self.solve(compliance, touched)

    def solve(self, compliance: SurfaceCompliance | OnDemandCompliance, vertices: np.ndarray) -> None:
        """Write what is not known yet at some vertices (k,)."""
        new = vertices[np.isnan(self.far[vertices, 0, 0])]
        if not len(new):
            return
        points, normals = self._vertices[new], self._normals[new]
        model = self._model
        if model.mesh.shape is not None:
            bent = principal_curvatures(model.mesh, points, normals, model.tool.tip_radius_m).mean(axis=1)
            self.curvature[new] = bent + self._rims[new]
        far = compliance.far_at(points, normals) + self._added[new]
        if not np.isfinite(far).all():
            raise MeshError("the compliance is not known all over the surface: solve it anew")
        self.far[new] = far
