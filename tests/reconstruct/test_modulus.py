"""The modulus with a finite tip: recovered, steady against bad presses, honest about its interval."""

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import LoadPatch, TouchSites, touch_sites
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.presses.making import PathErrors, of_paths
from palpate.mechanics.presses.repeats import sites_of
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.reconstruction.steps.s7_modulus.modulus import (
    ModulusOptions,
    between_sites,
    combine,
    fit_modulus,
)
from palpate.reconstruction.steps.s7_modulus.press_fit import fit_law, press_data
from palpate.reconstruction.steps.s7_modulus.shape_error import compliance_covariance

from .boxes import box

E, NU, TIP = 20e3, 0.45, 0.005
NOISE = 0.012
PLACES = [(x, y) for x in (-0.025, 0.0, 0.025) for y in (-0.025, 0.0, 0.025)]
FAST = ModulusOptions(bootstraps=200)


@pytest.fixture(scope="module")
def block() -> tuple[Solver, TouchSites]:
    mesh = box((0.08, 0.08, 0.04), (8, 8, 4)).quadratic()
    solver = Solver(mesh, NU)
    points = np.array([[x, y, 0.04] for x, y in PLACES])
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return solver, touch_sites(mesh, points, normals, NU, solver=solver, curvature=0.0)


def pressed(
    sites: TouchSites, *, law="neo-hookean", deep=0.006, noise=0.012, onset=5e-5, scale=None, seed=0
) -> Presses:
    """Presses simulated by the touch law; each onset is wrong by about `onset`; scale: a factor a press."""
    random = np.random.default_rng(seed)
    travel = np.concatenate([np.linspace(-0.3, 1, 400), np.ones(100), np.linspace(1, -0.3, 300)]) * deep
    slide = 0.1 * np.maximum(travel, 0)[:, None] * np.array([1.0, 0, 0])
    paths, centres = [], []
    for p, n in zip(sites.points, sites.normals, strict=True):
        paths.append(-travel[:, None] * n + slide)
        centres.append(p + (TIP + onset * random.standard_normal()) * n)
    starts = np.arange(len(sites) + 1) * len(travel)
    force = forces_at(sites, np.vstack(paths), starts, young_modulus_pa=E, tip_radius_m=TIP, law=law)
    each = np.repeat(np.ones(len(sites)) if scale is None else scale, len(travel))
    force = force * each[:, None] + noise * random.standard_normal(force.shape)
    position = np.vstack(
        [path + p + TIP * n for path, p, n in zip(paths, sites.points, sites.normals, strict=True)]
    )
    return of_paths(
        starts, position, force, np.array(centres), sites.normals, tip_radius_m=TIP, sample_rate_hz=1000.0,
        errors=PathErrors(onset, noise),
    )  # fmt: skip


def test_modulus_law_and_onset_are_recovered(block):
    _, sites = block
    for law in ("linear", "neo-hookean"):
        fit = fit_modulus(pressed(sites, law=law), sites, NOISE, FAST)
        assert fit.modulus_pa == pytest.approx(E, rel=0.01)
        assert fit.press.law == law
        assert fit.ci95_pa[0] < E < fit.ci95_pa[1]
        assert fit.ci95_pa[1] / fit.ci95_pa[0] < 1.09  # 1.082 is the common error alone


def test_a_press_that_does_not_follow_the_law_says_how_unsure_it_is(block):
    """As where a busy program leaps over the first touch: nobody saw it."""
    _, sites = block
    presses = pressed(sites, onset=1e-6)
    onset_m = np.where(np.arange(len(sites)) == 3, 3e-3, 0.0)
    leapt = dataclasses.replace(
        presses, centre=presses.centre + onset_m[:, None] * presses.normal,
        onset_error_m=presses.onset_error_m + onset_m,
    )  # fmt: skip
    fit = fit_law(press_data(leapt), sites, TIP, "neo-hookean", 0.02, 0.03, NOISE)
    off, error = abs(np.log(fit.modulus_pa / E)), fit.relative_error
    assert off[3] > 0.2 and off[3] < 3 * error[3]
    assert (np.delete(error, 3) < 0.02).all()


def test_a_wrong_first_touch_costs_little_because_it_is_fitted(block):
    _, sites = block
    good = fit_modulus(pressed(sites, onset=1e-6), sites, NOISE)
    shifted = pressed(sites, onset=1.5e-4, seed=2)
    fit = fit_modulus(shifted, sites, NOISE)
    assert fit.modulus_pa == pytest.approx(good.modulus_pa, rel=0.01)
    true_shift = sites.points[:, 2] + TIP - shifted.centre[:, 2]
    assert -fit.press.onset_shift_m == pytest.approx(true_shift, abs=6e-5)


def test_bad_presses_are_left_out(block):
    _, sites = block
    scale = np.ones(len(sites))
    scale[[2, 5]] = 2.5, 0.3
    fit = fit_modulus(pressed(sites, scale=scale), sites, NOISE)
    assert fit.modulus_pa == pytest.approx(E, rel=0.02)
    assert fit.weights[[2, 5]].max() < 1e-6
    plain = np.exp(np.mean(np.log(fit.press.modulus_pa)))
    assert abs(np.log(fit.modulus_pa / E)) < abs(np.log(plain / E))


def test_depths_at_which_the_law_fails_are_left_out(block):
    _, sites = block
    plain = pressed(sites, deep=0.008)
    depth = -(plain.position - (sites.points[0] + [0, 0, TIP]))[:, 2]
    factor = 1 + 0.5 * np.clip((depth - 0.004) / 0.004, 0, None)
    stiffening = dataclasses.replace(plain, force=plain.force * factor[:, None])
    options = ModulusOptions(law="neo-hookean")
    fit = fit_modulus(stiffening, sites, NOISE, options)
    assert fit.press.depth_m <= 0.005
    assert fit.modulus_pa == pytest.approx(E, rel=0.015)
    assert not fit.by_depth[-1][2]
    whole = fit_modulus(stiffening, sites, NOISE, ModulusOptions(law="neo-hookean", greatest_depth_m=0.01))
    assert abs(whole.modulus_pa - E) > 2 * abs(fit.modulus_pa - E)


def test_depths_that_agree_are_all_used(block):
    _, sites = block
    for seed in range(3):
        fit = fit_modulus(pressed(sites, deep=0.008, seed=seed), sites, NOISE, FAST)
        assert fit.press.depth_m > 0.008
        assert all(agrees for _, _, agrees in fit.by_depth)


def test_the_interval_covers_when_sites_scatter(block):
    _, sites = block
    random = np.random.default_rng(7)
    covered = 0
    runs = 24
    for seed in range(runs):
        scale = np.exp(0.05 * random.standard_normal(len(sites)))
        fit = fit_modulus(
            pressed(sites, scale=scale, seed=seed),
            sites,
            NOISE,
            ModulusOptions(law="neo-hookean", greatest_depth_m=0.01, bootstraps=200),
        )
        covered += fit.ci95_pa[0] < E < fit.ci95_pa[1]
    assert covered >= 0.8 * runs


@pytest.mark.parametrize(("sites", "repeats", "scatter"), [(4, 1, 0.05), (5, 3, 0.05), (14, 2, 0.02)])
def test_an_interval_of_few_places_covers_as_often_as_one_of_many(sites, repeats, scatter):
    random = np.random.default_rng(sites)
    site, runs, covered = np.repeat(np.arange(sites), repeats), 300, 0
    error = np.full(len(site), 0.01)
    for _ in range(runs):
        value = scatter * random.standard_normal(sites)[site] + error * random.standard_normal(len(site))
        modulus, weights, _ = combine(np.exp(value), error, site)
        errors, probability = between_sites(np.exp(value), error, site, weights)
        drawn = random.choice(errors, 2000, p=probability) * random.standard_normal(2000)
        covered += abs(np.log(modulus)) < np.quantile(np.abs(drawn), 0.95)
    assert 0.91 < covered / runs < 0.985


def test_a_press_that_tells_no_modulus_has_no_weight(block):
    """Its force is noise about zero: nothing overflows, and the others tell the modulus."""
    _, sites = block
    scale = np.ones(len(sites))
    scale[3] = 0.0
    presses = pressed(sites, scale=scale, noise=1e-9)
    with np.errstate(over="raise", invalid="raise"):
        alone = fit_law(press_data(presses), sites, TIP, "linear", 0.01, 0.03, NOISE)
        fit = fit_modulus(presses, sites, NOISE, FAST)
    assert not alone.relative_error[3] < 100
    assert fit.weights[3] < 1e-9
    assert fit.modulus_pa == pytest.approx(E, rel=0.01)


def test_repeats_at_one_site_do_not_outvote_the_others():
    moduli = np.array([10e3, 10e3, 10e3, 12e3] + [12e3] * 20)
    places = np.array([[0, 0, 0], [0.03, 0, 0], [0.06, 0, 0]] + [[0.09, 0, 0]] * 21)
    site = sites_of(places, np.tile([0, 0, 1.0], (24, 1)))
    assert site.max() == 3
    modulus, weights, _ = combine(moduli, np.full(24, 1e-4), site)
    assert weights[3:].sum() < 0.5
    assert modulus < 11e3


def test_shape_covariance_matches_a_changed_shape(block):
    solver, sites = block
    middle = TouchSites(
        sites.points[[4]], sites.normals[[4]], sites.curvature[[4]], sites.far[[4]], sites.patch_width_m, NU
    )
    mesh = solver.mesh
    side = mesh.touchable & np.isclose(np.abs(mesh.points[:, 0]), 0.04)
    sd = np.where(side, 1e-3, 0.0)
    predicted = np.sqrt(compliance_covariance(solver, middle, sd, correlation_m=10.0)[0, 0])
    changes = []
    for outward in (-5e-4, 5e-4):
        points = mesh.points + np.where(side[:, None], np.sign(mesh.points[:, :1]) * [outward, 0, 0], 0.0)
        corners = TetMesh(points, mesh.tetrahedra, mesh.fixed, mesh.touchable).linear()
        far = touch_sites(
            corners, middle.points, middle.normals, NU, solver=Solver(corners.quadratic(), NU), curvature=0.0,
            patch=LoadPatch(middle.patch_width_m),
        ).far  # fmt: skip
        changes.append(far[0, 2, 2])
    # triangles of the top beside the moved rim count for part of it as well
    assert predicted == pytest.approx(abs(changes[1] - changes[0]), rel=0.1)
