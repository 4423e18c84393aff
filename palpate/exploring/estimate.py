"""The running estimate: shape and modulus after every press, without redoing what is unchanged.

As `reconstruct.pipeline`, on tetrahedra twice as coarse: presses are found anew (a press is a matter of the
noise of all that was felt), but the shape is chosen among all families only at the first touches and now and
then, and the mesh with its factorisation is kept until the surface has moved away from it. A new place then
costs one solve.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mechanics.nearest import distance
from mechanics.recording import Recording
from mechanics.sites import TouchSites, patch_width, touch_sites, touch_solver
from mechanics.solver import Solver
from mechanics.tetmesh import TetMesh
from reconstruct.casting import cast
from reconstruct.contacts import ContactOptions, Exploration, explore
from reconstruct.meshing import MeshingOptions, mesh_surface, uncertainty_at
from reconstruct.modulus import ModulusFit, ModulusOptions, fit_modulus
from reconstruct.pipeline import Clock
from reconstruct.shape_error import compliance_covariance
from reconstruct.surface import Surface, SurfaceOptions, evidence_of, reconstruct_surface

MESH_M, SURFACE_EDGE_M = 0.016, 0.010
"""Tetrahedra of the running estimate, and of its surface."""
LEAST_PRESSES = 4
_ALL_SHAPES_EVERY = 6
_MOVED_M = 0.0007
"""The mesh is made anew where the surface has left it by more than this (95 % of the vertices)."""
_BOOTSTRAPS = 200


@dataclass(frozen=True)
class Solved:
    """A mesh with its factorisation, the surface it fills, and the far fields solved on it by place."""

    surface: Surface
    mesh: TetMesh
    solver: Solver
    far: dict[bytes, TouchSites] = field(default_factory=dict)


@dataclass(frozen=True)
class Estimate:
    """What is known after the presses so far. surface, fit: None before LEAST_PRESSES were found.

    presses_at_choice: how many there were when the shape's family was chosen last. seconds: wall time of
    each step of this update.
    """

    exploration: Exploration | None = None
    surface: Surface | None = None
    solved: Solved | None = None
    sites: TouchSites | None = None
    fit: ModulusFit | None = None
    presses_at_choice: int = 0
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def presses(self) -> int:
        """How many were found and used."""
        return 0 if self.exploration is None else len(self.exploration.presses)


def updated(recording: Recording, before: Estimate, poisson_ratio: float, seed: int = 0) -> Estimate:
    """The estimate with all that `recording` holds; `before`: of a beginning of it.

    Raises ContactError where too few presses can be found, SurfaceError or MeshError where they do not make
    a body yet.
    """
    clock = Clock()
    exploration = explore(recording, contact_options=ContactOptions(least_palpations=LEAST_PRESSES))
    clock.lap("presses")
    surface, chosen_at = _surface(exploration, before)
    clock.lap("surface")
    solved = _solved(surface, before, poisson_ratio)
    clock.lap("mesh")
    touched = exploration.presses
    where = cast(solved.surface.vertices, solved.surface.triangles, touched.point, touched.contact_normal)
    presses = touched.on_surface(where.points, where.normals)
    sites = _sites(solved, where.points, where.normals, poisson_ratio)
    clock.lap("touch sites")
    covariance = compliance_covariance(solved.solver, sites, uncertainty_at(solved.solver.mesh, surface))
    fit = fit_modulus(
        presses,
        sites,
        exploration.noise_n,
        ModulusOptions(bootstraps=_BOOTSTRAPS),
        compliance_covariance=covariance,
        seed=seed,
    )
    clock.lap("modulus")
    return Estimate(exploration, surface, solved, sites, fit, chosen_at, clock.laps)


def _surface(exploration: Exploration, before: Estimate) -> tuple[Surface, int]:
    count = len(exploration.presses)
    evidence = evidence_of(exploration)
    known = before.surface
    again = known is None or count >= before.presses_at_choice + min(_ALL_SHAPES_EVERY, count // 3 + 1)
    if known is not None and not again and known.method != "implicit":
        same = SurfaceOptions(surface=known.method.removesuffix("+"), surface_spacing_m=0.004)
        return reconstruct_surface(evidence, same), before.presses_at_choice
    return reconstruct_surface(evidence, SurfaceOptions(surface_spacing_m=0.004)), count


def _solved(surface: Surface, before: Estimate, poisson_ratio: float) -> Solved:
    kept = before.solved
    if kept is not None:
        off = distance(kept.surface.vertices, kept.surface.triangles, surface.vertices)
        if np.percentile(off, 95) < _MOVED_M:
            return kept
    mesh = mesh_surface(surface, MeshingOptions(mesh_size_m=MESH_M)).mesh
    return Solved(surface, mesh, touch_solver(mesh, poisson_ratio, surface_edge_m=SURFACE_EDGE_M))


def _sites(solved: Solved, points: np.ndarray, normals: np.ndarray, poisson_ratio: float) -> TouchSites:
    """The sites of all presses; those whose place was solved on this mesh before are read."""
    keys = [np.round(np.concatenate(pair), 9).tobytes() for pair in zip(points, normals, strict=True)]
    new = [i for i, key in enumerate(keys) if key not in solved.far]
    width = patch_width(solved.solver.mesh)
    if new:
        made = touch_sites(
            solved.mesh,
            points[new],
            normals[new],
            poisson_ratio,
            solver=solved.solver,
            patch_width_m=width,
        )
        for row, i in enumerate(new):
            solved.far[keys[i]] = _rows(made, slice(row, row + 1))
    parts = [solved.far[key] for key in keys]
    return TouchSites(
        points=np.concatenate([p.points for p in parts]),
        normals=np.concatenate([p.normals for p in parts]),
        curvature=np.concatenate([p.curvature for p in parts]),
        far=np.concatenate([p.far for p in parts]),
        patch_width_m=float(width),
        poisson_ratio=poisson_ratio,
    )


def _rows(sites: TouchSites, rows: slice) -> TouchSites:
    return TouchSites(
        sites.points[rows], sites.normals[rows], sites.curvature[rows], sites.far[rows],
        sites.patch_width_m, sites.poisson_ratio,
    )  # fmt: skip
