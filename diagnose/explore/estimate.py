"""The running estimate: shape and modulus after every press, without redoing what is unchanged.

As `reconstruct.pipeline`, on tetrahedra twice as coarse: presses are found anew (a press is a matter of the
noise of all that was felt), but the shape is chosen among all families only at the first touches and now and
then, and the mesh with its factorisation is kept until the surface has moved away from it. A new place then
costs one solve.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from palpate.diagnosis.explore.felt import MESH_M, SURFACE_SPACING_M, felt
from palpate.diagnosis.explore.goals import off_support, surface_error
from palpate.mechanics.compliance.sites import LoadPatch, TouchSites, patch_width, touch_sites, touch_solver
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Clock
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.shape.nearest import distance
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.shapes.fit import LEAST_TOUCHES
from palpate.reconstruction.steps.s1_filter.noise import FilterOptions
from palpate.reconstruction.steps.s1_filter.signals import filtered_of
from palpate.reconstruction.steps.s1_filter.tool_weight import ToolWeight
from palpate.reconstruction.steps.s3_contacts.first_touch import ContactSpans
from palpate.reconstruction.steps.s4_surface import (
    Surface,
    SurfaceOptions,
    cast,
    evidence_of,
    reconstruct_surface,
)
from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions, mesh_surface, uncertainty_at
from palpate.reconstruction.steps.s6_one_d import OneD, fit_robust, profiles
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusFit, ModulusOptions, fit_modulus
from palpate.reconstruction.steps.s7_modulus.shape_error import compliance_covariance, shape_gradients

SURFACE_EDGE_M = 0.010
"""Of the running estimate's surface."""
LEAST_PRESSES = LEAST_TOUCHES
_ALL_SHAPES_EVERY = 6
_CONFIRMED_AFTER = 2
"""Presses since all families were tried, after which a goal that one family meets has them tried again."""
_MOVED_M = 0.0007
"""The mesh is made anew where the surface has left it by more than this (95 % of the vertices) ..."""
_MOVED_SHARE = 0.25
"""... and more than this share of what the surface is uncertain by."""
_BOOTSTRAPS = 200


@dataclass(frozen=True)
class SolvedMesh:
    """A mesh with its factorisation, the surface it fills, and what was solved on it by place: far fields,
    and how each answers to an error of the shape (`shape_error.shape_gradients`)."""

    surface: Surface
    mesh: TetMesh
    solver: Solver
    far: dict[bytes, tuple[TouchSites, np.ndarray]] = field(default_factory=dict)


@dataclass(frozen=True)
class ExplorationEstimate:
    """What is known after the presses so far. surface, fit: None before LEAST_PRESSES were found.

    weight: of the tool. presses_placed: the table on the surface, a row of `sites` each.
    choice_error_m: within which 95 % of the surface lay when all families were tried last.
    presses_at_choice: how many there were when the shape's family was chosen last. seconds: wall time of
    each step of this update. covariance: (p, p) 1/m^2, of the sites' compliances by the shape's uncertainty.
    doubt: why the stated shape may be another object's, or "".
    """

    exploration: Measured | None = None
    weight: ToolWeight | None = None
    surface: Surface | None = None
    solved: SolvedMesh | None = None
    presses_placed: Presses | None = None
    sites: TouchSites | None = None
    fit: ModulusFit | None = None
    presses_at_choice: int = 0
    choice_error_m: float = float("inf")
    seconds: dict[str, float] = field(default_factory=dict)
    covariance: np.ndarray | None = None
    doubt: str = ""

    @property
    def surface_error_m(self) -> float:
        """Within which 95 % of the surface lies, by its own word and by that of all families of shapes."""
        assert self.surface is not None
        return max(free_error(self.surface), self.choice_error_m)

    @cached_property
    def one_d(self) -> tuple[OneD, ...]:
        """Kelvin-Voigt and Hunt-Crossley of every press of `presses_placed`, as a reconstruction fits them
        (the paper's eq. 1 and 2); fitted where they are asked for."""
        if self.presses_placed is None or self.exploration is None:
            return ()
        curves = profiles(self.presses_placed, FilterOptions().cutoff_hz)
        return tuple(fit_robust(curves, self.exploration.noise_n))

    @property
    def presses(self) -> int:
        """How many were found and used."""
        return 0 if self.exploration is None else len(self.exploration.presses)


def updated(
    recording: Recording,
    before: ExplorationEstimate,
    poisson_ratio: float,
    seed: int = 0,
    *,
    within_m: float | None = None,
) -> ExplorationEstimate:
    """The estimate with all that `recording` holds; `before`: of a beginning of it. within_m: as sure as the
    surface is asked for; one family of shapes may only seem that sure, so all are tried before it counts.

    Raises ContactError where too few presses can be found, SurfaceError or MeshError where they do not make
    a body yet.
    """
    clock = Clock()
    filtered = filtered_of(recording, FilterOptions().cutoff_hz, near=before.weight)
    exploration, placed = felt(recording, LEAST_PRESSES, ContactSpans(filtered))
    clock.lap("presses")
    if placed is None:
        surface, chosen_at, choice_error = _surface(exploration, before, within_m)
    else:
        surface, chosen_at, choice_error = placed.surface, len(exploration.presses), 0.0
    clock.lap("surface")
    solved = _solved(surface, before, poisson_ratio, None if placed is None else placed.mesh)
    clock.lap("mesh")
    touched = exploration.presses
    where = cast(solved.surface.vertices, solved.surface.triangles, touched.point, touched.contact_normal)
    presses = touched.on_surface(where.points, where.normals)
    sites, gradient = solved_sites(solved, where.points, where.normals, poisson_ratio)
    clock.lap("touch sites")
    local, pose = (surface, None) if placed is None else (placed.by_itself, placed.pose)
    deviation = uncertainty_at(solved.solver.mesh, local)
    covariance = compliance_covariance(solved.solver, sites, deviation, pose=pose, gradient=gradient)
    fit = modulus_of(presses, sites, exploration.noise_n, covariance, seed)
    clock.lap("modulus")
    return ExplorationEstimate(
        exploration, filtered.weight, surface, solved, presses, sites, fit, chosen_at, choice_error,
        clock.laps, covariance, "" if placed is None else placed.doubt,
    )  # fmt: skip


def modulus_of(
    presses: Presses, sites: TouchSites, noise_n: float, covariance: np.ndarray, seed: int
) -> ModulusFit:
    """As a reconstruction's, of fewer resamples; see reconstruct.steps.s7_modulus.modulus.fit_modulus."""
    options = ModulusOptions(bootstraps=_BOOTSTRAPS)
    return fit_modulus(presses, sites, noise_n, options, compliance_covariance=covariance, seed=seed)


def _surface(
    exploration: Measured, before: ExplorationEstimate, within_m: float | None
) -> tuple[Surface, int, float]:
    """(surface, presses at the last choice of a family, m within which 95 % of the surface lay by that)."""
    count = len(exploration.presses)
    evidence = evidence_of(exploration)
    known = before.surface
    again = known is None or count >= before.presses_at_choice + min(_ALL_SHAPES_EVERY, count // 3 + 1)
    if known is not None and not again:
        options = SurfaceOptions(surface=known.method.removesuffix("+"), surface_spacing_m=SURFACE_SPACING_M)
        same = reconstruct_surface(evidence, options)
        seems = within_m is not None and free_error(same) <= within_m < before.choice_error_m
        if not seems or count < before.presses_at_choice + _CONFIRMED_AFTER:
            return same, before.presses_at_choice, before.choice_error_m
    chosen = reconstruct_surface(evidence, SurfaceOptions(surface_spacing_m=SURFACE_SPACING_M))
    return chosen, count, free_error(chosen)


def free_error(surface: Surface) -> float:
    """m, within which 95 % of the surface off the support lies, by its own word."""
    free, area = off_support(surface)
    return surface_error(surface.uncertainty_m[free], area)


def _solved(
    surface: Surface, before: ExplorationEstimate, poisson_ratio: float, mesh: TetMesh | None
) -> SolvedMesh:
    """mesh: of the surface, where it is known; None makes one."""
    kept = before.solved
    if kept is not None:
        off = distance(kept.surface.vertices, kept.surface.triangles, surface.vertices)
        if np.percentile(off, 95) < max(_MOVED_M, _MOVED_SHARE * free_error(surface)):
            return kept
    if mesh is None:
        mesh = mesh_surface(surface, MeshingOptions(mesh_size_m=MESH_M)).mesh
    return SolvedMesh(surface, mesh, touch_solver(mesh, poisson_ratio, surface_edge_m=SURFACE_EDGE_M))


def solved_sites(
    solved: SolvedMesh, points: np.ndarray, normals: np.ndarray, poisson_ratio: float
) -> tuple[TouchSites, np.ndarray]:
    """(sites of surface points (k, 3) with outward normals (k, 3), their shape gradients (k, m)); what was
    solved on this mesh before is read."""
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
            patch=LoadPatch(width),
        )
        gradients = shape_gradients(solved.solver, made)
        for row, i in enumerate(new):
            solved.far[keys[i]] = made.of(slice(row, row + 1)), gradients[row]
    parts = [solved.far[key] for key in keys]
    sites = TouchSites(
        points=np.concatenate([p.points for p, _ in parts]),
        normals=np.concatenate([p.normals for p, _ in parts]),
        curvature=np.concatenate([p.curvature for p, _ in parts]),
        far=np.concatenate([p.far for p, _ in parts]),
        patch_width_m=float(width),
        poisson_ratio=poisson_ratio,
        bracing=np.concatenate([p.bracing for p, _ in parts]),
    )
    return sites, np.array([gradient for _, gradient in parts])
