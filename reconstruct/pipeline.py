"""From a recording to a model: every step of the paper in order, each with its options."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mechanics.errors import ContactError, OptionError
from mechanics.model import Model, read_model
from mechanics.options import option
from mechanics.palpation import Palpation
from mechanics.progress import Progress, silent
from mechanics.recording import Recording
from mechanics.sites import TouchSites, touch_sites
from mechanics.solver import Solver
from mechanics.tetmesh import TetMesh
from reconstruct.boundary import Boundary, BoundaryOptions
from reconstruct.contacts import ContactOptions, Exploration, explore
from reconstruct.filtering import FilterOptions
from reconstruct.modulus import ModulusFit, ModulusOptions, fit_modulus
from reconstruct.one_d import OneD, fit_paper, fit_robust, press_of

DEFAULT_POISSON_RATIO = 0.49
METHODS = ("finite-tip", "paper")


@dataclass(frozen=True)
class ReconstructOptions:
    """What holds for the whole reconstruction; each step has options of its own."""

    method: str = option(
        "finite-tip", "finite-tip, or paper: point load on linear tetrahedra", choices=METHODS
    )
    poisson_ratio: float | None = option(
        None, "Poisson's ratio (default: the recording's, else 0.49)", flag="--poisson-ratio"
    )
    mesh_size_m: float = option(0.010, "edge length l of the tetrahedra", unit="m", flag="--mesh-size")
    filter: FilterOptions = field(default_factory=FilterOptions)
    boundary: BoundaryOptions = field(default_factory=BoundaryOptions)
    contact: ContactOptions = field(default_factory=ContactOptions)
    modulus: ModulusOptions = field(default_factory=ModulusOptions)
    seed: int = 0


@dataclass(frozen=True)
class Reconstruction:
    """The model and everything on the way to it (for reports, comparison and diagnosis)."""

    model: Model
    exploration: Exploration
    sites: TouchSites
    modulus: ModulusFit
    one_d: tuple[OneD, ...]
    seconds: dict[str, float]


def reconstruct(
    recording: Recording, options: ReconstructOptions | None = None, progress: Progress = silent
) -> Model:
    """The model of a recording. Raises ContactError, SurfaceError or MeshError where a step cannot be done."""
    return reconstruct_fully(recording, options, progress).model


def reconstruct_fully(
    recording: Recording, options: ReconstructOptions | None = None, progress: Progress = silent
) -> Reconstruction:
    """As `reconstruct`, with the intermediate results."""
    options = options or ReconstructOptions()
    clock = _Clock()
    nu = _poisson_ratio(recording, options)
    progress("contacts", 0.02)
    exploration = explore(
        recording,
        method="noise",
        contact_options=options.contact,
        boundary_options=options.boundary,
        filter_options=options.filter,
        boundary=_known_base(recording),
    )
    clock.lap("contacts")
    progress("surface", 0.15)
    mesh, points, normals, curvature, uncertainty = _shape(exploration, options, progress)
    clock.lap("surface and mesh")
    progress("touch sites", 0.4)
    quadratic = mesh.quadratic()
    solver = Solver(quadratic, nu)
    sites = touch_sites(
        quadratic, points, normals, nu, solver=solver, curvature=curvature,
        progress=lambda s, f: progress(s, 0.4 + 0.4 * f),
    )  # fmt: skip
    clock.lap("touch sites")
    progress("modulus", 0.85)
    fit = fit_modulus(exploration, sites, options.modulus, seed=options.seed)
    clock.lap("modulus")
    progress("1D models", 0.95)
    one_d = uniaxial(exploration, sites.normals, robust=True)
    clock.lap("1D models")
    boundary = exploration.boundary
    model = Model(
        mesh=quadratic,
        young_modulus_pa=fit.modulus_pa,
        young_modulus_ci95_pa=fit.ci95_pa,
        poisson_ratio=nu,
        tip_radius_m=recording.tip_radius_m,
        mesh_size_m=options.mesh_size_m,
        support_point=boundary.support_point,
        support_normal=boundary.support_normal,
        shape_uncertainty_m=uncertainty,
        palpations=palpations(exploration, sites.points, sites.normals, one_d, fit.press.modulus_pa),
        provenance=_provenance(recording, options, fit),
    )
    progress("done", 1.0)
    return Reconstruction(model, exploration, sites, fit, tuple(one_d), clock.laps)


def uniaxial(exploration: Exploration, normals: np.ndarray, *, robust: bool) -> list[OneD]:
    """1D fits of every press: depth along -n since first touch, force on the object along -n, filtered."""
    presses = []
    for contact, n in zip(exploration.contacts, normals, strict=True):
        rows = slice(contact.start, contact.end)
        depth = -(exploration.position[rows] - contact.centre) @ n
        push = exploration.force[rows] @ n
        presses.append(
            press_of(exploration.recording.t[rows], depth, push, least_force_n=exploration.noise_n)
        )
    return fit_robust(presses) if robust else fit_paper(presses)


def palpations(
    exploration: Exploration,
    points: np.ndarray,
    normals: np.ndarray,
    one_d: list[OneD] | tuple[OneD, ...],
    moduli: np.ndarray,
) -> tuple[Palpation, ...]:
    """Rows of palpations.csv; point and normal are those of the reconstructed surface."""
    rows = []
    for c, p, n, d, e in zip(exploration.contacts, points, normals, one_d, moduli, strict=True):
        depth = float((-(exploration.position[c.start : c.end] - c.centre) @ n).max())
        rows.append(
            Palpation(
                c.t_onset, c.t_peak, *map(float, p), *map(float, n), depth,
                d.k_kv, d.b_kv, d.k_hc, d.b_hc, d.r_hc, d.k_v, d.k_c, d.r_c, d.k_h, float(e),
            )
        )  # fmt: skip
    return tuple(rows)


def _poisson_ratio(recording: Recording, options: ReconstructOptions) -> float:
    nu = options.poisson_ratio
    if nu is None:
        nu = recording.poisson_ratio if recording.poisson_ratio is not None else DEFAULT_POISSON_RATIO
    if not -1 < nu < 0.5:
        raise OptionError(f"--poisson-ratio is {nu}; it must lie between -1 and 0.5 (0.49 for silicone)")
    return float(nu)


def _known_base(recording: Recording) -> Boundary | None:
    """The base of [object] model = PATH, for recordings without phase I."""
    if recording.base_model is None or recording.boundary_phase is not None:
        return None
    model = read_model(recording.base_model)
    base = model.mesh.points[model.mesh.fixed]
    middle = base.mean(axis=0)
    n = model.support_normal
    offset = base - middle
    helper = np.eye(3)[np.argmin(np.abs(n))]
    u = np.cross(n, helper) / np.linalg.norm(np.cross(n, helper))
    angle = np.arctan2(offset @ np.cross(n, u), offset @ u)
    radius = np.linalg.norm(offset, axis=1)
    rim = [i for k in range(72) if (i := _furthest(radius, angle, k)) is not None]
    if len(rim) < 8:
        raise ContactError(f"the base of '{recording.base_model}' has too few nodes to stand in for phase I")
    outward = offset[rim] / radius[rim, None]
    return Boundary(
        support_point=model.support_point,
        support_normal=n,
        outline=base[rim],
        outward=outward,
        centres=base[rim] + recording.tip_radius_m * (outward + n),
        points=base[rim],
        interval=(0, 0),
        flatness_m=0.0,
    )


def _furthest(radius: np.ndarray, angle: np.ndarray, sector: int) -> int | None:
    low = -np.pi + sector * np.pi / 36
    inside = np.flatnonzero((angle >= low) & (angle < low + np.pi / 36))
    return int(inside[np.argmax(radius[inside])]) if len(inside) else None


def _provenance(recording: Recording, options: ReconstructOptions, fit: ModulusFit) -> dict[str, Any]:
    from importlib.metadata import version

    return {
        "recording": recording.name,
        "recording_sha256": recording.sha256,
        "version": version("palpate"),
        "method": options.method,
        "options": _plain(dataclasses.asdict(options)),
        "dent_law": fit.press.law,
        "reason": fit.reason,
    }


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items() if v is not None}
    return value


def _shape(exploration, options, progress):
    import pytetwild
    import trimesh

    b = exploration.boundary
    hull = trimesh.convex.convex_hull(np.vstack([b.points, exploration.points]))
    points, tets = pytetwild.tetrahedralize(
        np.array(hull.vertices),
        np.array(hull.faces, dtype=np.int32),
        edge_length_abs=options.mesh_size_m,
        epsilon=2e-3,
    )
    points, tets = np.array(points), np.array(tets)
    p = points[tets]
    volume = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0])
    tets[volume < 0] = tets[volume < 0][:, [0, 2, 1, 3]]
    tets = tets[np.abs(volume) > 1e-15]
    fixed = np.abs(b.height(points)) < 5e-4
    surface = np.unique(TetMesh(points, tets, fixed, ~fixed).surface)
    touch = np.zeros(len(points), bool)
    touch[surface] = True
    mesh = TetMesh(points, tets, fixed, touch & ~fixed)
    from reconstruct.casting import cast

    c = cast(points, mesh.touchable_surface, exploration.points, exploration.normals)
    return mesh, c.points, c.normals, None, None


class _Clock:
    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.laps[name] = self.laps.get(name, 0.0) + now - self._last
        self._last = now
