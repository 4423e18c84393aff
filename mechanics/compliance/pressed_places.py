"""The pressed places of a model, and what is expensive there: solved on demand, kept beside the model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from palpate.mechanics.compliance.local_material import given_back
from palpate.mechanics.compliance.near_field import contact_width
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.compliance.sites import LoadPatch, TouchSites, touch_sites, touch_solver
from palpate.mechanics.disk.store import content_key, load_or_build
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.shape.refine import refinement_key

VERSION = 13
UNIFORM = "uniform solver"
"""Stage: the factorisation that the places were solved by, of the object of one modulus."""
BENT_BY = ("curvature", "bracing", "braced")
"""What bends the dent's law at a place, of TouchSites."""
GRAIN_M = 0.0008
"""Presses that lie closer, with nearly one normal, share a solution."""


@dataclass(frozen=True)
class Places:
    """p presses on a model; device frame, SI units.

    point, normal: (p, 3). frame: (p, 3, 3) rows normal, tangent, tangent. far: (p, 3, 3) far field in those
    frames, unit modulus, 1/m. curvature, bracing, braced: (p,) 1/m (TouchSites). softness: (p,) of the
    material under each tip (local_material.given_back). stages: what effects asked to compute, by name.
    """

    model: Model
    point: np.ndarray
    normal: np.ndarray
    frame: np.ndarray
    far: np.ndarray
    curvature: np.ndarray
    bracing: np.ndarray
    braced: np.ndarray
    softness: np.ndarray
    stages: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def first(self) -> np.ndarray:
        """(q,) the first press of every place that is solved for."""
        return _shared(self.point, self.normal)[0]

    @cached_property
    def place(self) -> np.ndarray:
        """(p,) the place, of q, of every press."""
        return _shared(self.point, self.normal)[1]

    @cached_property
    def height(self) -> np.ndarray:
        """(n,) m, of the mesh's nodes above the support."""
        return self.model.support.height(self.model.mesh.points)

    @cached_property
    def under_tip(self) -> np.ndarray:
        """(p, t) weights of the touchable surface's t triangles in what the tip feels at each press."""
        mesh = self.model.mesh
        sampler = PatchSampler(mesh, contact_width(self.model.tool.tip_radius_m))
        weights = np.zeros((len(self.point), len(mesh.touchable_elements)))
        for row, point in zip(weights, self.point, strict=True):
            near, own = sampler.triangle_weights(point)
            row[near] = own
        return weights

    def of(self, presses: np.ndarray) -> Places:
        """Those of some presses (p,) bool; stages are computed anew where any is left out."""
        if presses.all():
            return self
        own = ("point", "normal", "frame", "far", *BENT_BY, "softness")
        return replace(self, **{name: getattr(self, name)[presses] for name in own}, stages={})

    def stored(self, name: str, build: Callable[[], Mapping[str, np.ndarray]]) -> dict[str, np.ndarray]:
        """The arrays of a stage: from the model's folder where they are there, else of `build` and kept."""
        return _stored(name, self.model, self.point, self.normal, build)

    def stage(self, name: str, build: Callable[[], Any]) -> Any:
        """What `build` gives, made once."""
        if name not in self.stages:
            self.stages[name] = build()
        return self.stages[name]


def solve_places(model: Model, point: np.ndarray, normal: np.ndarray, frame: np.ndarray) -> Places:
    """Solve the far field at every press's place: one factorisation, three solves a place.

    point, normal: (p, 3), frame: (p, 3, 3).
    """
    first, place = _shared(point, normal)
    balls = bool(model.material.inclusions)
    stages: dict[str, Any] = {}

    def solve() -> dict[str, np.ndarray]:
        ratio = model.solid_ratio if np.ptp(model.solid_ratio) > 0 else None
        mesh, nu = model.mesh.quadratic(), model.material.poisson_ratio
        solver = touch_solver(mesh, nu, ratio, stretch_m=model.stretch_m)
        uniform = ratio is None and not model.stretch_m
        if uniform:
            stages[UNIFORM] = solver
        patch = LoadPatch(tip_radius_m=model.tool.tip_radius_m, balls=True) if balls else LoadPatch()
        sites = touch_sites(mesh, point[first], normal[first], nu, solver=solver, patch=patch)
        solved = {name: getattr(sites, name) for name in ("far", *BENT_BY)}
        if uniform:
            return solved
        softness, back = given_back(model, point[first], normal[first], sites.patch_width_m)
        return {**solved, "far": sites.far + back, "softness": softness}

    sites = _stored("sites", model, point, normal, solve)
    far = np.einsum("pij,pjk,plk->pil", frame, sites["far"][place], frame)
    bent = {name: sites[name][place] for name in BENT_BY}
    softness = sites["softness"][place] if "softness" in sites else np.ones(len(place))
    return Places(
        model, point, normal, frame, np.ascontiguousarray(far), **bent, softness=softness, stages=stages
    )


def places_at(model: Model, presses: Presses, sites: TouchSites) -> Places:
    """The presses' places on a model, where they are solved as touch sites already."""
    frame = presses.frame
    far = np.ascontiguousarray(np.einsum("pij,pjk,plk->pil", frame, sites.far, frame))
    bent = {name: getattr(sites, name) for name in BENT_BY}
    even = np.ones(len(presses.point))
    return Places(model, presses.point, presses.normal, frame, far, **bent, softness=even)


def _shared(point: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    key = np.round(np.hstack([point / GRAIN_M, normal / 0.05])).astype(int)
    _, first, place = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return first, place.ravel()


def _stored(
    name: str,
    model: Model,
    point: np.ndarray,
    normal: np.ndarray,
    build: Callable[[], Mapping[str, np.ndarray]],
) -> dict[str, np.ndarray]:
    """A stage depends on shape and places alone: keyed by their content. Damaged files are built anew."""
    path = None if model.path is None else model.path / f"diagnosis-{name}.cache"
    mesh, ratio = model.mesh, model.solid_ratio
    key = content_key(
        name, VERSION, mesh.points, mesh.tetrahedra, mesh.fixed, ratio,
        "" if mesh.shape is None else mesh.shape.key,
        model.material.poisson_ratio, point, normal, *refinement_key(mesh),
        *([model.tool.tip_radius_m] if np.ptp(ratio) > 0 else []),
        *([model.stretch_m] if model.stretch_m else []),
    )  # fmt: skip
    return load_or_build(path, key, build)
