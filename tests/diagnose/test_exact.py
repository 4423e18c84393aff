"""`diagnose --exact`: forces corrected at solved places, and the law's own width shrunk to the solver's."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import Forward, build_forward, solved
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.options import DiagnoseOptions, NuisanceOptions
from palpate.diagnosis.pipeline import diagnose
from palpate.diagnosis.search.site_stiffness import site_stiffness_sd
from palpate.diagnosis.search.whiten import nuisance_columns
from palpate.mechanics.effects.finite_strain import EFFECT as STRAIN
from palpate.mechanics.law_errors import Bound, Stiffness
from palpate.mechanics.press_solver import solved_places
from palpate.mechanics.press_solver.press import LAWS
from palpate.render.force_error import SURE

STIFFER = 50.0
"""1/m, by how much of itself a solved force is above the law's as it goes deeper."""


@pytest.fixture(scope="module")
def forwards(bench):
    """(by the law, by solved places that are stiffer the deeper they are pressed)."""
    recording, model = bench.record()
    plain = build_forward(touches_of(bench.table(recording)), model)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solved_places, "_solved", _deep_places_are_stiffer(solved_places._solved))
        return plain, solved(plain)


def _deep_places_are_stiffer(really):
    def made(presses, touched, press, deepest_m, law):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(type(presses), "normal_force", lambda self, p, n, d: np.ones(len(d)))
            one = really(presses, touched, press, deepest_m, law)
        stiffer = one.law_n * (1 + STIFFER * one.depth_m)
        return solved_places.SolvedPlace(one.point, one.normal, one.depth_m, one.law_n, stiffer)

    return made


def settings(forward: Forward, strain: bool):
    made = forward.ideal(20e3)
    if strain:
        STRAIN.act(made, np.zeros(0), forward)
    return made


@pytest.mark.parametrize("strain", [False, True])
def test_forces_follow_the_solution_at_every_depth(forwards, strain):
    plain, exact = forwards
    by_law, by_solver = (f.predict(settings(f, strain)) for f in (plain, exact))
    t = plain.touches
    depth = t.travel[:, 0]
    deep = depth > 0.25 * t.deepest[t.press]
    felt = deep & (by_law[:, 0] > 0)
    np.testing.assert_allclose(by_solver[felt, 0] / by_law[felt, 0], 1 + STIFFER * depth[felt], rtol=2e-3)
    np.testing.assert_allclose(by_solver[felt, 1] * by_law[felt, 0], by_law[felt, 1] * by_solver[felt, 0])
    assert set(exact.exact.factors) == set(LAWS)


def test_what_the_law_may_be_off_by_is_what_the_solver_is(forwards):
    plain, exact = forwards
    options = NuisanceOptions()
    by_law = site_stiffness_sd(plain, options)
    assert (by_law >= options.law_bound * Bound.floor.value / SURE).all() and (by_law < 0.05).all()
    np.testing.assert_allclose(site_stiffness_sd(exact, options), Stiffness.solved.value)
    tight = NuisanceOptions(law_bound=0.1)  # what was asked for is not widened
    np.testing.assert_allclose(site_stiffness_sd(exact, tight), 0.1 * by_law / options.law_bound)
    shares = []
    for forward in forwards:
        own = settings(forward, False)
        force = forward.predict(own)
        onset_sd = np.zeros(len(forward.touches))
        _, bend = nuisance_columns(forward, own, force, options, None, onset_sd)[-1]
        felt = force[:, 0] > 0
        shares.append(bend[felt, 0] / force[felt, 0])
    np.testing.assert_allclose(shares[1], Stiffness.solved.value / options.law * shares[0])


@pytest.mark.slow
def test_a_diagnosis_says_what_was_solved(bench, monkeypatch):
    monkeypatch.setattr(solved_places, "_solved", _deep_places_are_stiffer(solved_places._solved))
    recording, model = bench.record()
    result = diagnose(recording, model, DiagnoseOptions(fast=True, bootstrap=10, exact=True))
    plain = result.as_json()["exact"]
    assert plain["unsolved_places"] == 0 and len(plain["places"]) == 12 * len(LAWS)
    assert "solved places" in result.seconds
