"""The two methods from touches to modulus, and the options of a whole reconstruction."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from palpate.mechanics.compliance.sites import TouchSites, touch_sites, touch_solver
from palpate.mechanics.contact.depth_factors import DepthFactors
from palpate.mechanics.contact.touch import touched
from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import option
from palpate.mechanics.press_solver.solved_places import (
    ExactPresses,
    PlacesToSolve,
    check_laws,
    deepest_of_sites,
    said_beforehand,
    solve_touched,
)
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Clock, Progress, part, unsaid
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.reconstruction.geometry.stated import GeometryOptions, Placed
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s1_filter.noise import FilterOptions
from palpate.reconstruction.steps.s2_base import BoundaryOptions
from palpate.reconstruction.steps.s3_contacts.contacts import ContactOptions
from palpate.reconstruction.steps.s4_surface import CastPoints, Surface, SurfaceOptions
from palpate.reconstruction.steps.s5_mesh.meshing import MeshingOptions, uncertainty_at
from palpate.reconstruction.steps.s6_one_d import OneD, fit_paper, fit_robust
from palpate.reconstruction.steps.s7_modulus.modulus import (
    ModulusFit,
    ModulusOptions,
    UnderOtherTip,
    fit_modulus,
)
from palpate.reconstruction.steps.s7_modulus.modulus_field import FieldOptions
from palpate.reconstruction.steps.s7_modulus.modulus_paper import PaperFit, PaperOptions, fit_paper_modulus
from palpate.reconstruction.steps.s7_modulus.shape_error import compliance_covariance
from palpate.reconstruction.steps.s7_modulus.sideways import SLIDES, along_the_normal, sideways_share

METHODS = ("finite-tip", "paper")
Say = Callable[[str], None]
"""Is told in words how long takes what takes minutes."""


@dataclass(frozen=True)
class ReconstructOptions:
    """What holds for the whole reconstruction; each step has options of its own."""

    method: str = option(
        "finite-tip", "finite-tip, or the paper's own, whose answer depends on the mesh", choices=METHODS
    )
    poisson_ratio: float | None = option(
        None, "Poisson's ratio; None: the recording's, else 0.49", flag="--poisson-ratio"
    )
    geometry: GeometryOptions = field(default_factory=GeometryOptions)
    force: bool = option(False, "continue although the check-up has a grave finding")
    filter: FilterOptions = field(default_factory=FilterOptions)
    boundary: BoundaryOptions = field(default_factory=BoundaryOptions)
    contact: ContactOptions = field(default_factory=ContactOptions)
    surface: SurfaceOptions = field(default_factory=SurfaceOptions)
    meshing: MeshingOptions = field(default_factory=MeshingOptions)
    modulus: ModulusOptions = field(default_factory=ModulusOptions)
    modulus_field: FieldOptions = field(default_factory=FieldOptions)
    paper: PaperOptions = field(default_factory=PaperOptions)
    seed: int = 0


@dataclass(frozen=True)
class BodyToFit:
    """What was measured as a body, which a modulus is fitted to.

    surface, placed: of the object, as it was found or is known. cast: the touched points of the surface.
    presses: on it; curves: these, low-passed, in contact; one_d: fitted to each. mesh: linear.
    """

    measured: Measured
    surface: Surface
    placed: Placed | None
    cast: CastPoints
    presses: Presses
    curves: Presses
    one_d: tuple[OneD, ...]
    mesh: TetMesh
    poisson_ratio: float

    @property
    def noise_n(self) -> float:
        """N, standard deviation of the raw force an axis."""
        return self.measured.noise_n


@dataclass(frozen=True)
class FittedSolution:
    """Touched places that were solved, and the modulus by the tabulated law, before."""

    presses: ExactPresses
    by_table: ModulusFit


@dataclass(frozen=True)
class ModulusOnMesh:
    """The modulus, Pa, by one of the methods, and the mesh (linear or quadratic) that it holds on.

    presses: what it was fitted to. sideways: their sideways force over that of a tip that sticks, NaN where
    few are pressed obliquely or the shape is not known (`steps.s7_modulus.sideways`). other_tips: what it
    would be under tips that the first touches leave open.
    """

    mesh: TetMesh
    presses: Presses
    modulus_pa: float
    ci95_pa: tuple[float, float]
    press_modulus_pa: np.ndarray
    sites: TouchSites | None = None
    modulus: ModulusFit | None = None
    paper_fit: PaperFit | None = None
    solved: FittedSolution | None = None
    sideways: float = float("nan")
    other_tips: tuple[UnderOtherTip, ...] = ()

    @property
    def misfit_n(self) -> np.ndarray | None:
        """(p,) N, rms of each press; None by the paper's method, which states none."""
        return None if self.modulus is None else self.modulus.press.rms_n

    @property
    def dent_law(self) -> str:
        return "linear" if self.modulus is None else self.modulus.press.law


class FiniteTip:
    """Touches by the noise, the likeliest shape, a tip of finite size on quadratic elements."""

    contacts = "noise"
    fit_one_d = staticmethod(fit_robust)

    def __init__(self, options: ReconstructOptions) -> None:
        if options.modulus.exact and options.modulus.law != "auto":
            check_laws([options.modulus.law])
        self.options = options
        self.surface_options, self.meshing_options = options.surface, options.meshing

    def fit(self, body: BodyToFit, progress: Progress, clock: Clock, say: Say = unsaid) -> ModulusOnMesh:
        mesh, nu, placed = body.mesh.quadratic(), body.poisson_ratio, body.placed
        solver = touch_solver(body.mesh, nu)
        clock.lap("factorise")
        sites = touch_sites(
            mesh, body.cast.points, body.cast.normals, nu, solver=solver, progress=part(progress, 0.5, 0.6)
        )
        clock.lap("touch sites")
        progress("modulus", 0.6)
        local = body.surface if placed is None else placed.by_itself
        covariance = compliance_covariance(
            solver, sites, uncertainty_at(solver.mesh, local), pose=None if placed is None else placed.pose
        )
        clock.lap("shape error")

        def fitted(presses: Presses, exact: Mapping[str, DepthFactors] | None = None) -> ModulusFit:
            return fit_modulus(
                presses, sites, body.noise_n, self.options.modulus,
                compliance_covariance=covariance, exact=exact, seed=self.options.seed,
            )  # fmt: skip

        presses = body.presses
        fit, solved = fitted(presses), None
        # normals of a surface through the touches are not sure enough to tell what lies aside of them
        sideways = float("nan") if placed is None else sideways_share(presses, sites, fit.press.law)
        if sideways < SLIDES:
            presses = along_the_normal(presses)
            fit = fitted(presses)
        other_tips: tuple[UnderOtherTip, ...] = ()
        if placed is not None:
            other_tips = tuple(_under(presses, factor, fit, fitted) for factor in placed.open_radii)
        if self.options.modulus.exact:
            clock.lap("modulus")
            solved = FittedSolution(
                _solve(body, presses, mesh, sites, fit, part(progress, 0.6, 0.8), say), fit
            )
            clock.lap("solved places")
            fit = fitted(presses, solved.presses.factors)
            sites = dataclasses.replace(sites, factors=solved.presses.factors[fit.press.law])
        return ModulusOnMesh(
            mesh, presses, fit.modulus_pa, fit.ci95_pa, fit.press.modulus_pa, sites, fit, solved=solved,
            sideways=sideways, other_tips=other_tips,
        )  # fmt: skip


def _under(
    presses: Presses, factor: float, fit: ModulusFit, fitted: Callable[[Presses], ModulusFit]
) -> UnderOtherTip:
    """The modulus of presses under a tip of a factor times their radius."""
    other = dataclasses.replace(presses, tip_radius_m=factor * presses.tip_radius_m)
    again = fitted(other)
    misfit = np.sqrt(np.mean(again.press.rms_n**2) / np.mean(fit.press.rms_n**2))
    return UnderOtherTip(other.tip_radius_m, again.modulus_pa, float(misfit))


def _solve(
    body: BodyToFit,
    presses: Presses,
    mesh: TetMesh,
    sites: TouchSites,
    fit: ModulusFit,
    progress: Progress,
    say: Say,
) -> ExactPresses:
    """The touched places, by the laws of the dent that a fit with tabulated ones left open."""
    laws = [law for law, (_, _, share) in fit.by_law.items() if share > 0]
    asked = PlacesToSolve(sites.points, presses.site, presses.deepest, touched(sites))
    places_to_solve = len(deepest_of_sites(asked.site, asked.deepest_m))
    say(f"--exact: {said_beforehand(places_to_solve, len(laws))}")
    return solve_touched(
        mesh, asked, laws, ratio=np.ones(len(mesh.tetrahedra)), poisson_ratio=body.poisson_ratio,
        young_modulus_pa=fit.modulus_pa, tip_radius_m=presses.tip_radius_m,
        surface=(body.surface.vertices, body.surface.triangles), progress=progress,
    )  # fmt: skip


class Paper:
    """Touches above 1 N, hull, voxels, point loads on linear elements."""

    contacts = "paper"
    fit_one_d = staticmethod(fit_paper)

    def __init__(self, options: ReconstructOptions) -> None:
        if options.modulus.exact:
            raise OptionError("--exact solves touches of a finite tip: leave out --method paper")
        self.options = options
        self.surface_options, self.meshing_options = options.surface, options.meshing
        if options.surface.surface == "auto":
            self.surface_options = dataclasses.replace(options.surface, surface="hull")
        if options.meshing.mesh_source == "auto":
            self.meshing_options = dataclasses.replace(options.meshing, mesh_source="voxels")

    def fit(self, body: BodyToFit, progress: Progress, clock: Clock, say: Say = unsaid) -> ModulusOnMesh:
        progress("modulus", 0.6)
        fit = fit_paper_modulus(
            body.curves, body.mesh, body.poisson_ratio, self.options.paper, seed=self.options.seed
        )
        return ModulusOnMesh(
            body.mesh, body.presses, fit.modulus_pa, fit.ci95_pa, fit.press_modulus_pa, paper_fit=fit
        )


Method = FiniteTip | Paper
BY_NAME: dict[str, type[FiniteTip] | type[Paper]] = {"finite-tip": FiniteTip, "paper": Paper}
