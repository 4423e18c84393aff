"""From a recording to a model: every step of the paper in order, each with its options."""

from __future__ import annotations

import dataclasses
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.errors import ContactError, NoBaseError, OptionError
from mechanics.linear_range import linear_range
from mechanics.material import Material
from mechanics.model import Model, Support, Tool, read_model
from mechanics.options import option
from mechanics.progress import Progress, silent
from mechanics.recording import Recording, base_model_of
from mechanics.result import Result
from mechanics.sites import TouchSites, touch_sites, touch_solver
from mechanics.tetmesh import TetMesh
from reconstruct.checks.base import Finding
from reconstruct.checks.outcome import result_of
from reconstruct.checks.registry import Checkup
from reconstruct.geometry.known_base import base_of_model
from reconstruct.geometry.known_shape import GeometryOptions, Placed, nowhere, place, stated_geometry
from reconstruct.steps.s1_filter.filtered import Filtered
from reconstruct.steps.s1_filter.filtering import FilterOptions
from reconstruct.steps.s2_boundary.boundary import Boundary, BoundaryOptions
from reconstruct.steps.s3_contacts.contacts import ContactOptions, Exploration, explore
from reconstruct.steps.s3_contacts.points import explore_points, is_points
from reconstruct.steps.s3_contacts.slides import without_slides
from reconstruct.steps.s4_surface.casting import CastPoints, cast
from reconstruct.steps.s4_surface.surface import (
    Surface,
    SurfaceOptions,
    evidence_of,
    reconstruct_surface,
    shape_table,
)
from reconstruct.steps.s5_mesh.meshing import Meshing, MeshingOptions, as_meshed, fill, uncertainty_at
from reconstruct.steps.s6_one_d.one_d import OneD, columns, fit_paper, fit_robust
from reconstruct.steps.s6_one_d.uniaxial import profiles
from reconstruct.steps.s7_modulus.modulus import ModulusFit, ModulusOptions, fit_modulus
from reconstruct.steps.s7_modulus.modulus_field import FieldOptions, with_fitted_field
from reconstruct.steps.s7_modulus.modulus_paper import PaperFit, PaperOptions, fit_paper_modulus
from reconstruct.steps.s7_modulus.shape_error import compliance_covariance

DEFAULT_POISSON_RATIO = 0.49
METHODS = ("finite-tip", "paper")


@dataclass(frozen=True)
class ReconstructOptions:
    """What holds for the whole reconstruction; each step has options of its own."""

    method: str = option(
        "finite-tip", "finite-tip; paper: tau = 1 N, hull, point load on linear tetrahedra", choices=METHODS
    )
    poisson_ratio: float | None = option(
        None, "Poisson's ratio; None: the recording's, else 0.49", flag="--poisson-ratio"
    )
    geometry: GeometryOptions = field(default_factory=GeometryOptions)
    force: bool = option(False, "go on although the check-up finds something grave")
    filter: FilterOptions = field(default_factory=FilterOptions)
    boundary: BoundaryOptions = field(default_factory=BoundaryOptions)
    contact: ContactOptions = field(default_factory=ContactOptions)
    surface: SurfaceOptions = field(default_factory=SurfaceOptions)
    meshing: MeshingOptions = field(default_factory=MeshingOptions)
    modulus: ModulusOptions = field(default_factory=ModulusOptions)
    modulus_field: FieldOptions = field(default_factory=FieldOptions)
    paper: PaperOptions = field(default_factory=PaperOptions)
    seed: int = 0


@dataclass(frozen=True, eq=False, repr=False)
class Reconstruction(Result):
    """The model and every step on the way to it; goes wherever a model goes. Moduli Pa, lengths m, forces N.

    sites and fit stand for the method finite-tip, paper_fit for the method paper; the others are None.
    seconds: wall time of each step. placed: a known geometry, None where it was reconstructed.
    findings: of the check-up, grave ones first; the interval is as wide as they make it. `plot`: force over
    time with the touches that were found. `show`: the model.
    """

    model: Model
    exploration: Exploration
    surface: Surface
    meshing: Meshing
    cast: CastPoints
    one_d: tuple[OneD, ...]
    press_modulus_pa: np.ndarray
    seconds: dict[str, float]
    sites: TouchSites | None = None
    modulus: ModulusFit | None = None
    paper_fit: PaperFit | None = None
    placed: Placed | None = None
    findings: tuple[Finding, ...] = ()

    @property
    def recording(self) -> Recording:
        """What it was made from."""
        return self.exploration.recording

    @property
    def young_modulus_pa(self) -> float:
        """The global Young's modulus, Pa."""
        return self.model.material.young_modulus_pa

    @property
    def young_modulus_ci95_pa(self) -> tuple[float, float]:
        """Its 95 % interval (low, high), Pa."""
        return self.model.material.young_modulus_ci95_pa

    def report(self, path: Path | str, beside: dict[str, Model] | None = None) -> Path:
        """Write the paper's figures and table, remade, as an HTML page; beside: other models by name."""
        return self._report(path, beside=beside)


def reconstruct(
    recording: Recording, options: ReconstructOptions | None = None, progress: Progress = silent
) -> Model:
    """The model of a recording. Raises RecordingError for what the check-up finds grave, unless
    options.force; ContactError, SurfaceError or MeshError where a step cannot be done."""
    return reconstruct_fully(recording, options, progress).model


def reconstruct_fully(
    recording: Recording, options: ReconstructOptions | None = None, progress: Progress = silent
) -> Reconstruction:
    """As `reconstruct`, with the intermediate results."""
    # the mesher is a process of its own: what needs no mesh is done meanwhile
    with ThreadPoolExecutor(1) as beside:
        return _reconstructed(recording, options or ReconstructOptions(), progress, beside)


def _reconstructed(
    recording: Recording, options: ReconstructOptions, progress: Progress, beside: Executor
) -> Reconstruction:
    paper = options.method == "paper"
    nu = _poisson_ratio(recording, options)
    clock = Clock()
    progress("contacts", 0.02)
    geometry = stated_geometry(recording, options.geometry)
    _check_points(recording, geometry, paper)
    checkup = Checkup(recording, options.force, not geometry.known, options.filter.cutoff_hz)
    placed: Placed | None = None
    meshes: list[Future[TetMesh]] = []

    def begin_mesh(shape: Surface) -> None:
        meshes.append(beside.submit(fill, shape, _meshing_options(options)))

    if geometry.known:
        exploration, placed = _on_known(
            recording, options, geometry, checkup.filtered, _part(progress, 0.02, 0.3)
        )
        checkup.presses(exploration)
        surface = placed.surface
        clock.lap("contacts and registration")
    else:
        exploration = _explored(recording, options, checkup.filtered)
        checkup.presses(exploration)
        clock.lap("contacts")
        surface = reconstruct_surface(
            evidence_of(exploration), _surface_options(options), _part(progress, 0.1, 0.3), shaped=begin_mesh
        )
        clock.lap("surface")
    known_mesh = None if placed is None else placed.mesh
    if known_mesh is None and not meshes:
        begin_mesh(surface)
    progress("meshing", 0.3)
    touched = exploration.presses
    where = cast(surface.vertices, surface.triangles, touched.point, touched.contact_normal)
    presses = touched.on_surface(where.points, where.normals)
    curves = profiles(presses, options.filter.cutoff_hz)
    one_d = (fit_paper if paper else fit_robust)(curves, exploration.noise_n)
    clock.lap("1D models")
    coarse = meshes[0].result() if known_mesh is None else known_mesh
    judged = beside.submit(as_meshed, coarse, surface)
    clock.lap("mesh")
    progress("factorise", 0.5)
    mesh = coarse if paper else coarse.quadratic()
    sites, fit, paper_fit = None, None, None
    if paper:
        progress("modulus", 0.6)
        paper_fit = fit_paper_modulus(curves, mesh, nu, options.paper, seed=options.seed)
        modulus, interval, each = paper_fit.modulus_pa, paper_fit.ci95_pa, paper_fit.press_modulus_pa
    else:
        solver = touch_solver(coarse, nu)
        clock.lap("factorise")
        sites = touch_sites(
            mesh, where.points, where.normals, nu, solver=solver, progress=_part(progress, 0.5, 0.8)
        )
        clock.lap("touch sites")
        progress("modulus", 0.8)
        local = surface if placed is None else placed.by_itself
        covariance = compliance_covariance(
            solver, sites, uncertainty_at(solver.mesh, local), pose=None if placed is None else placed.pose
        )
        clock.lap("shape error")
        fit = fit_modulus(
            presses,
            sites,
            exploration.noise_n,
            options.modulus,
            compliance_covariance=covariance,
            seed=options.seed,
        )
        modulus, interval, each = fit.modulus_pa, fit.ci95_pa, fit.press.modulus_pa
    interval = checkup.interval(result_of(presses, modulus, interval, fit))
    clock.lap("modulus")
    progress("model", 0.95)
    meshing = judged.result()
    tables = {"shape": shape_table(surface)}
    if placed is not None:
        tables["geometry"] = placed.about
    if sites is not None:
        tables["linear_range"] = linear_range(sites, recording.tip_radius_m).table()
    model = Model(
        mesh=mesh,
        material=Material(modulus, nu, interval, dent_law="linear" if fit is None else fit.press.law),
        support=Support(exploration.boundary.support_point, exploration.boundary.support_normal),
        tool=Tool(recording.tip_radius_m),
        mesh_size_m=options.meshing.mesh_size_m,
        shape_uncertainty_m=meshing.shape_uncertainty_m if paper else uncertainty_at(mesh, surface),
        presses=presses.with_fits(**columns(one_d, each)),
        provenance=_provenance(exploration, options, surface, fit),
        about=tables,
    )
    if sites is not None and options.modulus_field.field != "homogeneous":
        model = with_fitted_field(model, sites, exploration.noise_n)
        clock.lap("modulus field")
    progress("done", 1.0)
    return Reconstruction(
        model=model,
        exploration=exploration,
        surface=surface,
        meshing=meshing,
        cast=where,
        one_d=tuple(one_d),
        press_modulus_pa=each,
        seconds=clock.laps,
        sites=sites,
        modulus=fit,
        paper_fit=paper_fit,
        placed=placed,
        findings=checkup.found,
    )


def _check_points(recording: Recording, geometry: GeometryOptions, paper: bool) -> None:
    """Raises ContactError where quasi-static points lack what their first touches are told by."""
    if is_points(recording) and (paper or not geometry.known):
        raise ContactError(
            f"'{recording.name}' holds quasi-static points without a time, which trace no base: say what they"
            " lie on with --slab M, --shape FILE or --half-space (method finite-tip); if its rows are in "
            "order of time, import it with --rate HZ"
        )


def _surface_options(options: ReconstructOptions) -> SurfaceOptions:
    if options.method == "paper" and options.surface.surface == "auto":
        return dataclasses.replace(options.surface, surface="hull")
    return options.surface


def _meshing_options(options: ReconstructOptions) -> MeshingOptions:
    if options.method == "paper" and options.meshing.mesh_source == "auto":
        return dataclasses.replace(options.meshing, mesh_source="voxels")
    return options.meshing


def _poisson_ratio(recording: Recording, options: ReconstructOptions) -> float:
    nu = options.poisson_ratio
    if nu is None:
        nu = recording.poisson_ratio if recording.poisson_ratio is not None else DEFAULT_POISSON_RATIO
    if not -1 < nu < 0.5:
        raise OptionError(f"--poisson-ratio is {nu}; it must lie between -1 and 0.5 (0.49 for silicone)")
    return float(nu)


def _touches(
    recording: Recording,
    options: ReconstructOptions,
    filtered: Filtered | None,
    base: Boundary | None = None,
    unbroken: bool = False,
) -> Exploration:
    if base is not None and is_points(recording):
        return explore_points(recording, base, options.contact)
    return explore(
        recording,
        method="paper" if options.method == "paper" else "noise",
        contact_options=options.contact,
        boundary_options=options.boundary,
        filter_options=options.filter,
        boundary=base,
        filtered=filtered,
        unbroken=unbroken,
    )


def _explored(recording: Recording, options: ReconstructOptions, filtered: Filtered | None) -> Exploration:
    """Where the recording traces no base, that of [object] model = PATH stands in."""
    try:
        return _touches(recording, options, filtered)
    except NoBaseError:
        if recording.base_model is None:
            raise
    base = base_of_model(read_model(base_model_of(recording)), recording.tip_radius_m)
    return _touches(recording, options, filtered, base)


def _on_known(
    recording: Recording,
    options: ReconstructOptions,
    geometry: GeometryOptions,
    filtered: Filtered | None,
    progress: Progress,
) -> tuple[Exploration, Placed]:
    """Touches told without a support place the geometry; then they are told again, over its base."""
    least = options.contact.least_palpations
    first = without_slides(_touches(recording, options, filtered, nowhere(recording), unbroken=True), least)
    progress("contacts", 0.3)
    placed = place(
        recording,
        first,
        geometry,
        mesh_size_m=options.meshing.mesh_size_m,
        spacing_m=options.surface.surface_spacing_m,
        progress=_part(progress, 0.3, 0.8),
    )
    again = _touches(recording, options, filtered, placed.base, unbroken=True)
    return without_slides(again, least), placed


def _provenance(
    exploration: Exploration, options: ReconstructOptions, surface: Surface, fit: ModulusFit | None
) -> dict[str, Any]:
    recording = exploration.recording
    about = {
        "recording": recording.name,
        "recording_sha256": recording.sha256,
        "version": version("palpate"),
        "method": options.method,
        "surface": surface.method,
        "surface_reason": surface.reason,
        "options": _plain(dataclasses.asdict(options)),
    }
    if exploration.delay_s:
        about |= {"force_delay_s": exploration.delay_s, "force_delay_sd_s": exploration.delay_error_s}
    if fit is not None:
        about["modulus_reason"] = fit.reason
    return about


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items() if v is not None}
    return value


def _part(progress: Progress, low: float, high: float) -> Progress:
    return lambda stage, fraction: progress(stage, low + (high - low) * fraction)


class Clock:
    """Wall time of steps, s: `lap` books what passed since the last to a name."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        """The step `name` ends here."""
        now = time.perf_counter()
        self.laps[name] = self.laps.get(name, 0.0) + now - self._last
        self._last = now
