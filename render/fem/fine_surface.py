"""What the finite-element renderer knows of each vertex of the contact surface, at once or on demand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from palpate.mechanics.compliance.coarse_table import CoarseCompliance
from palpate.mechanics.compliance.fine_corners import quadratic_at
from palpate.mechanics.compliance.local_material import given_back
from palpate.mechanics.compliance.on_demand import OnDemandCompliance
from palpate.mechanics.compliance.patch import half_space_compliance, usual_width
from palpate.mechanics.compliance.sites import contact_curvature
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance
from palpate.mechanics.contact.dent import DentLaw
from palpate.mechanics.contact.edges import edge_law, peaks
from palpate.mechanics.disk.store import content_key, load_or_build
from palpate.mechanics.errors import MeshError
from palpate.mechanics.model.model import Model
from palpate.render.options import RenderOptions
from palpate.render.surface.contact_surface import ContactSurface
from palpate.render.surface.snapping import touched_surface

Compliance = SurfaceCompliance | OnDemandCompliance | CoarseCompliance
_UP = np.array([0.0, 0.0, 1.0])


class _Peaks(NamedTuple):
    """Of rims, 1/m: narrower than a compliance's corners (c, 3) m lie apart, they are taken off those
    (c, 3, 3) and given back where they are (v, 3, 3)."""

    corners: np.ndarray
    own: np.ndarray
    there: np.ndarray


class FineSurface:
    """far: (v, 3, 3) 1/m, unit modulus, NaN where it is not solved yet, zero on the base. curvature: (v,) 1/m
    of contact_curvature, convex positive, and what a rim close by adds (mechanics.contact.edges); only
    where far is known.

    bracing: (v,) 1/m, by which rims, the base (mechanics.contact.edges) and balls
    (mechanics.compliance.near_field) bend the dent's law.
    softness: (v,) of the material under a tip (mechanics.compliance.local_material). parents: (k, 3) numbers
    of each fine triangle's mesh corners among the compliance's, -1 on the base. law: of the dent.
    """

    def __init__(self, model: Model, surface: ContactSurface, compliance: Compliance, law: DentLaw) -> None:
        arrays, mesh = surface.arrays, model.mesh
        number = np.full(int(max(surface.parents.max(), compliance.nodes.max())) + 1, -1, dtype=np.int64)
        number[compliance.nodes] = np.arange(len(compliance.nodes))
        self.parents = np.ascontiguousarray(number[surface.parents])
        self._model, self._vertices, self._normals = model, arrays.vertices, arrays.normals
        self._touched = touched = np.unique(arrays.triangles[arrays.free > 0])
        points, normals = arrays.vertices[touched], arrays.normals[touched]
        v = len(arrays.vertices)
        self.far, self._added = np.zeros((v, 3, 3)), np.zeros((v, 3, 3))
        self.curvature, self.bracing, self.softness = np.zeros(v), np.zeros(v), np.ones(v)
        self._rims = np.zeros(v)
        missed = edge_law(mesh, points, normals)
        self._added[touched] = missed.far
        self.bracing[touched] = missed.bracing + law.braced * missed.braced
        self._without_balls = np.array(self.bracing)
        self._rims[touched] = missed.curvature
        self.softness[touched], back = given_back(model, points, normals, float(compliance.own_width_m[0]))
        self._added[touched] += back
        self._peaks = self._peaks_of(compliance)
        if mesh.shape is None:  # all are fitted at once: each is the same only among the same
            bent = _curvature(model, points, normals)
            self.curvature[touched] = bent + missed.curvature
        self.far[touched] = np.nan
        if not isinstance(compliance, OnDemandCompliance):
            self.solve(compliance, touched)

    def solve(self, compliance: Compliance, vertices: np.ndarray) -> None:
        """Write what is not known yet at some vertices (k,)."""
        new = vertices[np.isnan(self.far[vertices, 0, 0])]
        if not len(new):
            return
        points, normals = self._vertices[new], self._normals[new]
        model = self._model
        if model.mesh.shape is not None:
            whole = len(new) == len(self._touched)
            bent = kept_curvature(model, points, normals) if whole else _curvature(model, points, normals)
            self.curvature[new] = bent + self._rims[new]
        far = self._far_at(compliance, new)
        if not np.isfinite(far).all():
            raise MeshError("the compliance is not known all over the surface: solve it anew")
        self.far[new] = far
        self.bracing[new] += compliance.bracing_at(points)

    def field_of(self, compliance: Compliance) -> tuple[np.ndarray, np.ndarray]:
        """(far (v, 3, 3), bracing (v,)), 1/m, by another compliance of the same object."""
        far, bracing, at = np.zeros_like(self.far), np.array(self._without_balls), self._touched
        far[at] = self._far_at(compliance, at)
        bracing[at] += compliance.bracing_at(self._vertices[at])
        return far, bracing

    def _far_at(self, compliance: Compliance, vertices: np.ndarray) -> np.ndarray:
        """(k, 3, 3) 1/m at vertices (k,)."""
        points = self._vertices[vertices]
        if self._peaks.corners is not compliance.own_points:
            self._peaks = self._peaks_of(compliance)
        own, there = self._peaks.own, self._peaks.there
        far = compliance.far_at(points, self._normals[vertices]) + (self._added[vertices] + there[vertices])
        if own.any():
            far -= quadratic_at(points, compliance.own_points, compliance.own_triangles, own)
        return far

    def _peaks_of(self, compliance: Compliance) -> _Peaks:
        mesh, corners = self._model.mesh, compliance.own_points
        width = max(float(compliance.own_width_m[0]), usual_width(mesh))
        give = half_space_compliance(_UP, float(compliance.poisson_ratio[0]), width)[2, 2]
        there = np.zeros_like(self._added)
        there[self._touched] = give * peaks(mesh, self._vertices[self._touched], width)
        return _Peaks(corners, give * peaks(mesh, corners, width), there)


def keep_surface(model: Model, options: RenderOptions) -> None:
    """Make what a renderer needs beside the compliance, so that it lies in the model's folder."""
    surface = touched_surface(model, options)
    if model.mesh.shape is not None:
        arrays = surface.arrays
        touched = np.unique(arrays.triangles[arrays.free > 0])
        kept_curvature(model, arrays.vertices[touched], arrays.normals[touched])


def kept_curvature(model: Model, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(k,) 1/m, curvature (contact_curvature) of a known shape at all of a surface's places (k, 3), from
    the model's folder where it is kept."""
    shape = model.mesh.shape
    if model.path is None or shape is None:
        return _curvature(model, points, normals)
    key = content_key("curvature 3", shape.key, points, normals, float(model.tool.tip_radius_m))
    path = model.path / f"curvature-{key[:16]}.bin"
    return load_or_build(path, key, lambda: {"felt": _curvature(model, points, normals)})["felt"]


def _curvature(model: Model, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    return contact_curvature(model.mesh, points, normals, model.tool.tip_radius_m)
