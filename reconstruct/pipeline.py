"""From a recording to a model: every step of the paper in order, each with its options."""

from __future__ import annotations

import dataclasses
import warnings
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.linear_range import linear_range
from palpate.mechanics.disk.toml_text import plain
from palpate.mechanics.errors import ContactError, FewPressesError, OptionError, PalpateWarning
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.one_thread import one_thread
from palpate.mechanics.plausible import POISSON_RATIO, USUAL_POISSON_RATIO
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Clock, Progress, part, silent, unsaid
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.result import Result
from palpate.reconstruction.checks.finding import Finding, outcome_of
from palpate.reconstruction.checks.flat import flat
from palpate.reconstruction.checks.registry import (
    checked_presses,
    checked_results,
    checked_samples,
    refuse_grave,
    widened,
    with_findings,
)
from palpate.reconstruction.geometry.known_shape import place
from palpate.reconstruction.geometry.stated import (
    GeometryOptions,
    Placed,
    nowhere,
    over_its_base,
    stated_geometry,
)
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.methods import BY_NAME, BodyToFit, FittedSolution, Method, ModulusOnMesh, Say
from palpate.reconstruction.methods import ReconstructOptions as ReconstructOptions
from palpate.reconstruction.steps.s2_base import Boundary
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.reconstruction.steps.s3_contacts.left_out import on_base, on_surface, within_slab, without_slides
from palpate.reconstruction.steps.s3_contacts.quasi_static import explore_points, is_points
from palpate.reconstruction.steps.s3_contacts.sliding_presses import FLAT, laid
from palpate.reconstruction.steps.s4_surface import (
    CastPoints,
    Surface,
    cast,
    evidence_of,
    reconstruct_surface,
    shape_table,
)
from palpate.reconstruction.steps.s5_mesh.meshing import BackgroundMesher, Meshing, uncertainty_at
from palpate.reconstruction.steps.s6_one_d import OneD, columns, profiles
from palpate.reconstruction.steps.s7_modulus.held_out import HeldOutErrors, held_out, modulus_by_others
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusFit, UnderOtherTip
from palpate.reconstruction.steps.s7_modulus.modulus_field import with_fitted_field
from palpate.reconstruction.steps.s7_modulus.modulus_paper import PaperFit
from palpate.reconstruction.steps.s7_modulus.sideways import SLIDES


@dataclass(frozen=True, eq=False, repr=False)
class Reconstruction(Result):
    """The model and every step on the way to it; goes wherever a model goes. Moduli Pa, lengths m, forces N.

    sites and fit stand for the method finite-tip, paper_fit for the method paper; the others are None.
    seconds: wall time of each step. placed: a known geometry, None where it was reconstructed.
    held_out: how the model predicts places that were held out; None by the method paper, or of one place.
    exact: touched places that were solved. fitted_presses: what the modulus was fitted to; sideways: their
    sideways force over that of a tip that sticks (`steps.s7_modulus.sideways`). other_tips: the modulus by
    tips that the first touches on a known shape leave open. `plot`: force over time
    with the touches that were found. `show`: the model.
    """

    model: Model
    exploration: Measured
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
    held_out: HeldOutErrors | None = None
    exact: FittedSolution | None = None
    fitted_presses: Presses | None = None
    sideways: float = float("nan")
    other_tips: tuple[UnderOtherTip, ...] = ()

    @property
    def slides(self) -> bool:
        """Whether the tip slid, so that the modulus is by the force along the normal alone."""
        return self.sideways < SLIDES

    @property
    def doubt(self) -> str:
        """Why the answer is not reliable, in one line: the known shape is another object's, or places
        that were held out are not predicted. '' where nothing speaks against it."""
        by_shape = "" if self.placed is None else self.placed.doubt
        by_force = "" if self.held_out is None else self.held_out.doubt
        return "; ".join(filter(None, (by_shape, by_force)))

    @property
    def predicts(self) -> bool:
        """Whether nothing speaks against it: `doubt` is empty."""
        return not self.doubt

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Of the check-up, grave ones first; the interval is as wide as they make it."""
        return self.exploration.findings

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


@one_thread
def reconstruct_fully(
    recording: Recording,
    options: ReconstructOptions | None = None,
    progress: Progress = silent,
    say: Say = unsaid,
) -> Reconstruction:
    """As `reconstruct`, with the intermediate results: section 2 of the paper in order; what the two methods
    do differently is theirs. say: is told how long takes what takes minutes."""
    options = options or ReconstructOptions()
    if options.method not in BY_NAME:
        raise OptionError(f"method {options.method!r} is unknown; allowed are {', '.join(BY_NAME)}")
    method, clock = BY_NAME[options.method](options), Clock()
    with BackgroundMesher(method.meshing_options) as mesher:
        poisson_ratio = _poisson_ratio(recording, options)
        progress("contacts", 0.02)
        geometry = stated_geometry(recording, options.geometry)
        measured = measure(recording, geometry, method)
        if geometry.known:
            shaped = _placed(measured, geometry, options, mesher, part(progress, 0.02, 0.3))
            clock.lap("contacts and registration")
        else:
            clock.lap("contacts")
            shaped = _surfaced(measured, method, mesher, part(progress, 0.1, 0.3))
            clock.lap("surface")
        progress("meshing", 0.3)
        body = _meshed(shaped, geometry.kind, poisson_ratio, method, mesher, clock)
        progress("factorise", 0.35)
        fitted = method.fit(body, progress, clock, say)
        return _concluded(body, fitted, options, mesher, progress, clock)


def measure(recording: Recording, geometry: GeometryOptions, method: Method) -> Measured:
    """Signals, base and presses, with what the check-up finds in the samples.

    Of a known geometry the touches alone, found without a support: they place it, and its base then shows
    which of them lie on the support. Raises RecordingError for a grave finding, unless options.force.
    """
    options = method.options
    _check_points(recording, geometry, options)
    samples = checked_samples(recording, not geometry.known, options.filter.cutoff_hz)
    refuse_grave(samples.found, options.force)

    def found(base: Boundary | None) -> Measured:
        if base is not None and is_points(recording):
            return explore_points(recording, base, options.contact)
        return explore(
            recording,
            method=method.contacts,
            contact_options=options.contact,
            boundary_options=options.boundary,
            filter_options=options.filter,
            boundary=base,
            spans=samples.spans,
            unbroken=geometry.known,
            flat=geometry.kind in FLAT,
        )

    if geometry.known:
        try:
            pressed = without_slides(found(nowhere(recording)), options.contact.least_palpations)
        except FewPressesError as error:
            if not error.usable:
                raise
            fewer = f"of a known object fewer tell a modulus, less surely: --least-palpations {error.usable}"
            raise FewPressesError(f"{error}; {fewer}", error.usable) from error
        measured = within_slab(pressed, geometry.slab_m)
    else:
        measured = over_its_base(recording, found)
    measured = dataclasses.replace(measured, findings=samples.found)
    # what the first touches tell is said before minutes are spent on it
    return with_findings(measured, flat(measured, geometry), options.force)


@dataclass(frozen=True)
class _Shaped:
    """What was measured on its base, and the object's surface; placed: a known geometry."""

    measured: Measured
    surface: Surface
    placed: Placed | None = None


def _surfaced(measured: Measured, method: Method, mesher: BackgroundMesher, progress: Progress) -> _Shaped:
    """The surface through the touches."""
    measured = with_findings(measured, checked_presses(measured), method.options.force)
    evidence = evidence_of(measured)
    return _Shaped(
        measured, reconstruct_surface(evidence, method.surface_options, progress, shaped=mesher.begin)
    )


def _placed(
    measured: Measured,
    geometry: GeometryOptions,
    options: ReconstructOptions,
    mesher: BackgroundMesher,
    progress: Progress,
) -> _Shaped:
    """The known geometry where the touches place it, without those that it shows to lie on the support."""
    progress("contacts", 0.3)

    def put(by: Measured) -> Placed:
        return place(
            by,
            geometry,
            mesh_size_m=options.meshing.mesh_size_m,
            spacing_m=options.surface.surface_spacing_m,
            progress=part(progress, 0.3, 0.8),
        )

    least = options.contact.least_palpations
    placed = put(measured)
    over = on_base(measured, placed.base, least)
    if len(over.presses) < len(measured.presses):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PalpateWarning)  # the file's, which were given above
            placed = put(over)
        over = on_base(measured, placed.base, least)
    measured = with_findings(over, checked_presses(over), options.force)
    if placed.mesh is not None:
        mesher.known(placed.mesh)
    mesher.begin(placed.surface)
    return _Shaped(measured, placed.surface, placed)


def _meshed(
    shaped: _Shaped, kind: str, poisson_ratio: float, method: Method, mesher: BackgroundMesher, clock: Clock
) -> BodyToFit:
    """Presses on the surface, 1D models of each, tetrahedra. kind: of the geometry."""
    surface, options = shaped.surface, method.options
    found = shaped.measured.presses
    where = cast(surface.vertices, surface.triangles, found.point, found.contact_normal).on(surface.shape)
    measured, kept = on_surface(
        shaped.measured, where.points, where.normals, options.contact.least_palpations
    )
    where = where.of(kept)
    presses = laid(measured.presses, where.points, where.normals, kind)
    curves = profiles(presses, options.filter.cutoff_hz)
    one_d = tuple(method.fit_one_d(curves, measured.noise_n))
    clock.lap("1D models")
    mesh = mesher.mesh(surface)
    clock.lap("mesh")
    return BodyToFit(measured, surface, shaped.placed, where, presses, curves, one_d, mesh, poisson_ratio)


def _concluded(
    body: BodyToFit,
    fitted: ModulusOnMesh,
    options: ReconstructOptions,
    mesher: BackgroundMesher,
    progress: Progress,
    clock: Clock,
) -> Reconstruction:
    """The model, its interval as wide as the findings make it, and how it predicts places held out."""
    measured, surface = body.measured, body.surface
    shape = "" if body.placed is None else body.placed.about.get("file", "")
    outcome = outcome_of(body.presses, fitted.modulus_pa, fitted.ci95_pa, fitted.misfit_n, shape)
    measured = with_findings(measured, checked_results(outcome), options.force)
    interval = widened(fitted.modulus_pa, fitted.ci95_pa, measured.findings)
    clock.lap("modulus")
    progress("model", 0.8)
    meshing = mesher.judged()
    tip_radius_m = measured.recording.tip_radius_m
    model = Model(
        mesh=fitted.mesh,
        material=ObjectMaterial(fitted.modulus_pa, body.poisson_ratio, interval, dent_law=fitted.dent_law),
        support=Support(measured.boundary.support_point, measured.boundary.support_normal),
        tool=Tool(tip_radius_m),
        mesh_size_m=options.meshing.mesh_size_m,
        shape_uncertainty_m=uncertainty_at(fitted.mesh, surface),
        presses=body.presses.with_fits(**columns(body.one_d, fitted.press_modulus_pa)),
        provenance=_provenance(measured, options, surface, fitted.modulus),
        about=_tables(surface, body.placed, fitted.sites, tip_radius_m),
    )
    model, predicted = _judged(model, fitted, options.modulus_field.field, measured.noise_n, clock, progress)
    progress("done", 1.0)
    return Reconstruction(
        model=model,
        exploration=measured,
        surface=surface,
        meshing=meshing,
        cast=body.cast,
        one_d=body.one_d,
        press_modulus_pa=fitted.press_modulus_pa,
        seconds=clock.laps,
        sites=fitted.sites,
        modulus=fitted.modulus,
        paper_fit=fitted.paper_fit,
        placed=body.placed,
        held_out=predicted,
        exact=fitted.solved,
        fitted_presses=fitted.presses,
        sideways=fitted.sideways,
        other_tips=fitted.other_tips,
    )


def _judged(
    model: Model, fitted: ModulusOnMesh, field: str, noise_n: float, clock: Clock, progress: Progress
) -> tuple[Model, HeldOutErrors | None]:
    """The model, with a field where that is wanted, its presses ask for one, and it predicts places that were
    held out better; and how they are predicted."""
    sites, modulus = fitted.sites, fitted.modulus
    if sites is None or modulus is None:
        return model, None
    presses, by_others = fitted.presses, modulus_by_others(modulus)
    predicted = held_out(presses, sites, modulus, by_others)
    clock.lap("held-out places")
    if field == "auto" or (field == "where-beaten" and predicted is not None and predicted.doubt):
        progress("modulus from place to place", 0.82)
        there, of_field = with_fitted_field(model, presses, sites, noise_n)
        clock.lap("modulus field")
        by_field = None if of_field is None else held_out(presses, sites, modulus, of_field)
        clock.lap("held-out places")
        if by_field is not None and (predicted is None or by_field.model_n < predicted.model_n):
            model, predicted = there, by_field
    return model, predicted


def _check_points(recording: Recording, geometry: GeometryOptions, options: ReconstructOptions) -> None:
    """Raises ContactError where quasi-static points lack what their first touches are found by."""
    if is_points(recording) and (options.method == "paper" or not geometry.known):
        raise ContactError(
            f"'{recording.name}' holds quasi-static points without a time, which trace no base: say what they"
            " lie on with --slab M, --shape FILE or --half-space (method finite-tip); if its rows are in "
            "order of time, import it with --rate HZ"
        )


def _poisson_ratio(recording: Recording, options: ReconstructOptions) -> float:
    nu = options.poisson_ratio
    if nu is None:
        nu = recording.poisson_ratio if recording.poisson_ratio is not None else USUAL_POISSON_RATIO
    if not POISSON_RATIO.takes(float(nu)):
        raise OptionError(f"--poisson-ratio is {nu}; it must be {POISSON_RATIO.words} (0.49 for silicone)")
    return float(nu)


def _tables(
    surface: Surface, placed: Placed | None, sites: TouchSites | None, tip_radius_m: float
) -> dict[str, Any]:
    """What else model.toml keeps."""
    tables: dict[str, Any] = {"shape": shape_table(surface)}
    if placed is not None:
        tables["geometry"] = placed.about
    if sites is not None:
        tables["linear_range"] = linear_range(sites, tip_radius_m)
    return tables


def _provenance(
    measured: Measured, options: ReconstructOptions, surface: Surface, fit: ModulusFit | None
) -> dict[str, Any]:
    recording = measured.recording
    about: dict[str, Any] = {
        "recording": recording.name,
        "recording_sha256": recording.sha256,
        "version": version("palpate"),
        "method": options.method,
        "surface": surface.method,
        "surface_reason": surface.reason,
        "options": plain(dataclasses.asdict(options)),
    }
    if measured.delay_s:
        about |= {"force_delay_s": measured.delay_s, "force_delay_sd_s": measured.delay_error_s}
    if fit is not None:
        about["modulus_reason"] = fit.reason
    return about
