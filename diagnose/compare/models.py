"""The models that are compared: each is fitted to training presses and predicts others that it has not seen.

- fem: the finite-element model with what the training presses ask for: Young's modulus (least squares; the
  force of a path is proportional to it), the dent law, linear or neo-Hookean, that fits them best, and a
  smooth field of the modulus where they ask for one (reconstruct.steps.s7_modulus.modulus_field).
- fem-homogeneous: the same with one modulus whatever they ask for.
- kelvin-voigt, hunt-crossley: each training press fitted by itself, eq. (1) and (2) of Goksel et al., then
  interpolated to the held-out place by radial basis functions (mechanics.model.one_d_laws), force along the
  normal.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from palpate.mechanics.compliance.pressed_places import UNIFORM, Places, places_at
from palpate.mechanics.compliance.sites import TouchSites, touch_sites, touch_solver
from palpate.mechanics.compliance.smooth_field import SmoothField
from palpate.mechanics.contact.touch import forces_at, touched
from palpate.mechanics.law_errors import DepthLaw
from palpate.mechanics.model.model import Model
from palpate.mechanics.model.one_d_laws import LAWS as ONE_D_LAWS
from palpate.mechanics.model.one_d_laws import RIVALS as RIVALS
from palpate.mechanics.model.one_d_laws import OneDLaws, forces_of, spread_law
from palpate.mechanics.press_solver.solved_places import PlacesToSolve, solve_touched
from palpate.mechanics.presses.making import of_paths
from palpate.mechanics.presses.repeats import sites_of
from palpate.mechanics.presses.table import MARGIN_S, Presses
from palpate.mechanics.progress import Progress, silent
from palpate.reconstruction.steps.s6_one_d import columns, fit_robust, low_passed
from palpate.reconstruction.steps.s7_modulus.modulus_field import (
    FieldSites,
    PressModuli,
    asked_for,
    fit_field,
    press_moduli,
    with_field,
)
from palpate.reconstruction.steps.s7_modulus.press_fit import touched_by_law
from palpate.render.replay import rms_n
from palpate.render.surface.felt_surface import felt_surface

HOMOGENEOUS = "fem-homogeneous"
MODELS = ("fem", *RIVALS, HOMOGENEOUS)
LAWS = ("linear", "neo-hookean")
MOST_MOVED, MOVES = 2.5, 21
"""Standard errors by which a held-out first touch may be moved, and places that are tried."""
LASTING = 10
"""Rows of a press that a lasting error of a law binds together."""


@dataclass(frozen=True)
class Prepared:
    """The contact samples of the presses, net of free air, and what each model needs of them.

    unit: dent law -> (n, 3) m^2, force for unit modulus, the object of one modulus. laws: 1D name -> Law of
    each press's own fit. sites: dent law -> where the presses are; places: the same. own: dent law -> each
    press's own modulus; none: fields are not asked about.
    """

    presses: Presses
    unit: dict[str, np.ndarray]
    laws: dict[str, OneDLaws]
    sites: dict[str, TouchSites]
    places: Places
    own: dict[str, PressModuli]


def of_one_modulus(model: Model) -> Model:
    """Its geometry, base and Poisson's ratio: what varies in it is refitted."""
    return model.with_material(field=None, gradient=None, skin=None, inclusions={})


def prepare(
    table: Presses,
    model: Model,
    site_m: float | None = None,
    progress: Progress = silent,
    *,
    field: str = "auto",
    exact: bool = False,
) -> Prepared:
    """Contact samples and what each model needs; the touch sites are solved here. site_m: None keeps the
    table's sites. field, exact: as in CompareOptions. First touches that were not recorded are found by the
    touch law, for every model alike."""
    model = of_one_modulus(model)
    if site_m is not None:
        table = replace(table, site=sites_of(table.point, table.normal, site_m))
    solver = touch_solver(model.mesh, model.material.poisson_ratio)
    solved = touch_sites(
        model.mesh, table.point, table.normal, model.material.poisson_ratio, solver=solver, progress=progress
    )
    table = touched_by_law(table, solved, LAWS, DepthLaw.field.value, table.noise.raw_n)
    smooth = low_passed(table)
    presses = replace(smooth, force=table.net.force).window(MARGIN_S, MARGIN_S)
    sites = _exact_sites(model, table, solved, progress) if exact else dict.fromkeys(LAWS, solved)
    unit = {
        law: forces_at(
            sites[law],
            presses.displacement,
            presses.starts,
            young_modulus_pa=1.0,
            tip_radius_m=presses.tip_radius_m,
            law=law,
        )
        for law in LAWS
    }
    fitted = columns(fit_robust(smooth.window(0.0, 0.0), table.noise.raw_n), np.zeros(len(table)))
    places, own = places_at(model, table, solved), {}
    if field != "homogeneous":
        places.stages[UNIFORM] = solver
        own = {law: press_moduli(table, sites[law], places, law, table.noise.raw_n) for law in LAWS}
    return Prepared(
        presses,
        unit,
        {name: ONE_D_LAWS[name](fitted) for name in RIVALS},
        sites,
        places,
        own,
    )


def _exact_sites(
    model: Model, table: Presses, sites: TouchSites, progress: Progress
) -> dict[str, TouchSites]:
    """The touched places solved under each dent law."""
    felt = felt_surface(model)
    asked = PlacesToSolve(sites.points, table.site, table.deepest, touched(sites))
    solved = solve_touched(
        model.mesh, asked, LAWS, ratio=np.ones(len(model.mesh.tetrahedra)), poisson_ratio=sites.poisson_ratio,
        young_modulus_pa=1.0, tip_radius_m=table.tip_radius_m, surface=(felt.points, felt.triangles),
        progress=progress,
    )  # fmt: skip
    return {law: replace(sites, factors=solved.factors[law]) for law in LAWS}


@dataclass(frozen=True)
class Fem:
    """The finite-element model of some presses: dent law, modulus Pa, touch sites, and the field in them;
    None: of one modulus."""

    law: str
    modulus_pa: float
    sites: FieldSites
    field: SmoothField | None = None

    def forces(self, presses: Presses, moved_m: np.ndarray | None = None) -> np.ndarray:
        """(n, 3) N of every path. moved_m: (p,) by how much earlier each press meets the surface."""
        return self.modulus_pa * self.sites.unit_forces(presses, self.law, moved_m)

    def at(self, rows: np.ndarray) -> Fem:
        """At some of its sites."""
        return replace(self, sites=FieldSites(self.sites.sites.of(rows), self.sites.ratio[rows]))


def _homogeneous(prepared: Prepared, train: np.ndarray) -> Fem:
    """Of one modulus, and the dent law that fits the presses `train` best."""
    seen = prepared.presses.rows(train)
    measured = prepared.presses.force[seen]
    fits = []
    for law, unit in prepared.unit.items():
        modulus = _scale(unit[seen], measured)
        fits.append((rms_n(modulus * unit[seen] - measured), modulus, law))
    _, modulus, law = min(fits)
    return Fem(law, modulus, with_field(prepared.sites[law], prepared.places, None))


def _fem(prepared: Prepared, train: np.ndarray) -> Fem:
    """With a field where the presses `train` ask for one."""
    plain = _homogeneous(prepared, train)
    if not prepared.own:
        return plain
    law = min(prepared.own, key=lambda name: prepared.own[name].fit.cost[train].sum())
    found = fit_field(prepared.own[law], train)
    if found is None or not asked_for(found):
        return plain
    fem = Fem(law, 1.0, with_field(prepared.sites[law], prepared.places, found.field), found.field)
    presses = prepared.presses
    seen = presses.rows(train)
    # first touches of what is fitted are where that fit has them
    shift = np.zeros(len(presses))
    shift[train] = -prepared.own[law].fit.onset_shift_m[train]
    return replace(fem, modulus_pa=_scale(fem.forces(presses, shift)[seen], presses.force[seen]))


def predicted(
    prepared: Prepared, train: np.ndarray, test: np.ndarray, interpolation: str, first_touch: str
) -> tuple[dict[str, np.ndarray], Fem]:
    """Forces (rows of test, 3) of each model fitted to the presses `train`, and the FEM. interpolation,
    first_touch: as in CompareOptions."""
    whole = prepared.presses
    presses = whole.of(np.isin(np.arange(len(whole)), test))
    plain, fem = _homogeneous(prepared, train), _fem(prepared, train)
    models: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "fem": partial(fem.at(test).forces, presses),
        HOMOGENEOUS: partial(plain.at(test).forces, presses),
    }
    for name, fitted in prepared.laws.items():
        own = OneDLaws(*(column[train] for column in fitted))
        at = spread_law(whole.point[train], whole.site[train], own, whole.point[test], interpolation)
        models[name] = partial(forces_of, at, presses)
    return {name: as_touched(models[name], presses, first_touch) for name in MODELS}, fem


def as_touched(force: Callable[[np.ndarray], np.ndarray], presses: Presses, first_touch: str) -> np.ndarray:
    """(n, 3) N along the paths as read, or with each first touch where the force then meets what was measured
    best, at the price of its stated error."""
    stated = presses.onset_error_m
    found = force(np.zeros(len(presses)))
    if first_touch == "read" or not (stated > 0).any():
        return found
    variance = presses.noise.raw_n**2 + DepthLaw.field.value**2 * (presses.force**2).sum(axis=1) / 3
    least = np.full(len(presses), np.inf)
    for z in np.linspace(-MOST_MOVED, MOST_MOVED, MOVES):
        tried = force(z * stated)
        missed = ((tried - presses.force) ** 2).sum(axis=1) / variance / LASTING
        cost = np.bincount(presses.press, weights=missed, minlength=len(presses)) + z**2
        better = cost < least
        found = np.where(better[presses.press][:, None], tried, found)
        least = np.minimum(cost, least)
    return found


def _scale(unit: np.ndarray, measured: np.ndarray) -> float:
    return float((unit * measured).sum() / (unit**2).sum())


def stiffness_along(
    prepared: Prepared,
    train: np.ndarray,
    places: np.ndarray,
    normals: np.ndarray,
    model: Model,
    depth_m: float,
) -> dict[str, np.ndarray]:
    """Force (q,) N of each model at one depth, at places (q, 3) with normals (q, 3); fitted on `train`."""
    model = of_one_modulus(model)
    solved = touch_sites(model.mesh, places, normals, model.material.poisson_ratio)
    steps = np.linspace(0.0, depth_m, 60)
    path = (-steps[None, :, None] * solved.normals[:, None, :]).reshape(-1, 3)
    starts = np.arange(len(places) + 1) * len(steps)
    centres = places + model.tool.tip_radius_m * solved.normals
    pressed = of_paths(
        starts, np.repeat(centres, len(steps), axis=0) + path, np.zeros_like(path), centres, solved.normals,
        tip_radius_m=model.tool.tip_radius_m, sample_rate_hz=prepared.presses.sample_rate_hz,
    )  # fmt: skip
    result = {}
    for name, fem in (("fem", _fem(prepared, train)), (HOMOGENEOUS, _homogeneous(prepared, train))):
        there = places_at(model, pressed, solved)
        force = replace(fem, sites=with_field(solved, there, fem.field)).forces(pressed)
        deepest = force.reshape(len(places), len(steps), 3)[:, -1]
        result[name] = (deepest * solved.normals).sum(axis=1)
    presses = prepared.presses
    for name, fitted in prepared.laws.items():
        own = OneDLaws(*(c[train] for c in fitted))
        at = spread_law(presses.point[train], presses.site[train], own, places)
        result[name] = at.k * depth_m**at.r
    return result
