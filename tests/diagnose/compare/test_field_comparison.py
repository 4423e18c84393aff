"""Held-out presses of tissue: the finite-element model with a field, and what it is compared with."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import palpate.show  # noqa: F401  who says results
from benchmarks._tissue import tissue
from palpate.diagnosis.compare.comparison import Along, CompareOptions, compare_presses
from palpate.diagnosis.compare.models import HOMOGENEOUS, RIVALS, as_touched
from palpate.mechanics.compliance import field_response as solved_fields
from palpate.mechanics.press_solver import solved_places
from palpate.mechanics.presses.making import PathErrors, of_paths
from palpate.reconstruction.steps.s7_modulus.modulus_field import asked_for, fit_field

UP = np.array([0.0, 0.0, 1.0])


def _presses(late_m: np.ndarray, stated_m: float):
    """Straight presses on a place that answers with 1 kN/m, read to begin late_m (p,) too late."""
    into = np.linspace(0.0, 4e-3, 50)
    p = len(late_m)
    starts = np.arange(p + 1) * len(into)
    centre = np.column_stack([np.arange(p) * 0.02, np.zeros(p), np.zeros(p)])
    position = np.concatenate([c - into[:, None] * UP for c in centre])
    force = np.tile(1e3 * into, p)[:, None] * UP
    read = centre - late_m[:, None] * UP
    return of_paths(
        starts, position, force, read, np.tile(UP, (p, 1)), tip_radius_m=0.005, sample_rate_hz=100.0,
        errors=PathErrors(stated_m),
    )  # fmt: skip


def _spring(presses):
    def force(moved: np.ndarray) -> np.ndarray:
        depth = np.maximum(presses.depth + moved[presses.press], 0.0)
        return 1e3 * depth[:, None] * UP

    return force


def test_a_held_out_first_touch_is_moved_by_what_its_error_allows():
    late = np.array([3e-4, -2e-4, 0.0])
    presses = _presses(late, 3e-4)
    force = _spring(presses)
    rows = presses.depth > 3e-4

    def error(how: str) -> float:
        return float(np.abs(as_touched(force, presses, how) - presses.force)[rows].max())

    assert error("read") == pytest.approx(0.3, rel=0.05)
    assert error("moved") < 0.06


def test_a_first_touch_that_is_sure_stays():
    presses = _presses(np.array([3e-4, -2e-4]), 0.0)
    np.testing.assert_array_equal(
        as_touched(_spring(presses), presses, "moved"), as_touched(_spring(presses), presses, "read")
    )


def test_a_simulator_beside_the_models_has_its_modulus_fitted_to_the_others_folds():
    """Half the measured force is as good as all of it, and a constant push is not."""
    slab = tissue(1, raster=3)
    presses = slab.presses
    halved = Along(presses.t, 0.5 * presses.net.force)
    constant = Along(presses.t, np.ones_like(presses.force))
    options = CompareOptions(folds=3, field="homogeneous")
    result = compare_presses(presses, slab.model, options, simulated={"mujoco": halved, "constant": constant})
    assert result.rmse_n["mujoco"] < 0.2 * result.rmse_n["fem"] < result.rmse_n["constant"]
    assert all("mujoco" in region.bias for region in result.regions)


def test_solved_places_predict_what_no_law_has(monkeypatch):
    """Every place answers more stiffly the deeper it is pressed: so does the solver, and no table."""
    stiffer = 50.0
    slab = tissue(1, log_sd=0.0, raster=3)
    deep = np.maximum(slab.presses.depth, 0.0)
    presses = dataclasses.replace(slab.presses, force=slab.presses.force * (1 + stiffer * deep)[:, None])
    really = solved_places._solved

    def made(held, touched, press, deepest_m, law):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(type(held), "normal_force", lambda self, p, n, d: np.ones(len(d)))
            one = really(held, touched, press, deepest_m, law)
        return dataclasses.replace(one, solved_n=one.law_n * (1 + stiffer * one.depth_m))

    monkeypatch.setattr(solved_places, "_solved", made)
    options = CompareOptions(folds=3, field="homogeneous")
    plain = compare_presses(presses, slab.model, options)
    exact = compare_presses(presses, slab.model, dataclasses.replace(options, exact=True))
    assert exact.rmse_n["fem"] < 0.5 * plain.rmse_n["fem"]
    assert all(exact.rmse_n[name] == pytest.approx(plain.rmse_n[name], rel=0.05) for name in RIVALS)


@pytest.fixture(scope="module")
def compared():
    """(comparison, fields solved) with factorisations that folds share, then with each fold's own."""
    slab = tissue(1, raster=5)
    solved, solve, found = [], solved_fields.solve_field, []

    def counted(*given):
        solved.append(given)
        return solve(*given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(solved_fields, "solve_field", counted)
        for apart in (solved_fields.APART, -1.0):
            patch.setattr(solved_fields, "APART", apart)
            result = compare_presses(slab.presses, slab.model, CompareOptions(folds=4))
            found.append((result, len(solved)))
            solved.clear()
    return found


@pytest.mark.slow
def test_folds_share_factorisations_and_predict_what_each_alone_would(compared):
    """To half a percent of the force; each fold's field is then solved by itself."""
    (shared, few), (alone, many) = compared
    assert all(field is not None for result, _ in compared for field in result.fields)
    assert few < 0.5 * many
    off = shared.predicted["fem"] - alone.predicted["fem"]
    assert np.sqrt((off**2).mean()) < 0.005 * np.sqrt((shared.presses.force**2).mean())
    assert np.abs(off).max() > 0  # they are not the same computation
    assert shared.rmse_n["fem"] == pytest.approx(alone.rmse_n["fem"], rel=0.02)


@pytest.mark.slow
def test_a_1d_model_that_wins_is_in_the_first_line_with_floor_and_ceiling_below(compared):
    won = compared[0][0]
    half = {**won.rmse_n, "hunt-crossley": 0.5 * won.rmse_n["fem"]}
    lost = dataclasses.replace(won, rmse_n=half)
    assert (
        lost.lines()[0]
        == "A 1D model (Hunt–Crossley spring) predicts the next touch 2.0 times better than the FEM."
    )
    assert not won.lines()[0].startswith("A 1D model")
    for result in (won, lost):
        noise, constant = 1e3 * result.noise_n, 1e3 * result.constant_n
        assert f"the sensor's noise {noise:.0f} mN, a constant force" in result.lines()[-2]
        assert result.lines()[-2].endswith(f" {constant:.0f} mN")
    assert result.noise_n < won.rmse_n["fem"] < won.constant_n


@pytest.mark.slow
def test_a_field_predicts_tissue_better_than_springs():
    """Beyond the noise by a third at least, first touches known to 0.3 mm."""
    slab = tissue(1, raster=6, touch_error_m=3e-4)
    result = compare_presses(slab.presses, slab.model, CompareOptions(first_touch="moved"))

    def beyond(name: str) -> float:
        return float(np.sqrt(max(result.rmse_n[name] ** 2 - result.noise_n**2, 0.0)))

    assert all(field is not None for field in result.fields)
    assert beyond("fem") < 2 / 3 * min(beyond(name) for name in RIVALS)
    assert beyond("fem") < 0.5 * beyond(HOMOGENEOUS)


@pytest.mark.release
def test_one_modulus_stays_one_modulus():
    slab = tissue(1, raster=6, log_sd=0.0)
    result = compare_presses(slab.presses, slab.model)
    assert all(field is None for field in result.fields)
    assert result.rmse_n["fem"] == result.rmse_n[HOMOGENEOUS]
    own = result.prepared.own["neo-hookean"]
    assert not asked_for(fit_field(own, np.arange(len(slab.presses))))
