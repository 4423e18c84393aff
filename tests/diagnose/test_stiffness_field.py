"""A field of stiffness: what it does to presses, and what presses tell of it."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.mechanics.compliance.far_field import _unit_loads, energy_fields, load_sampler
from palpate.mechanics.compliance.field_response import far_of, shares_in_elements
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.elastic.solver import Solver

FIELD = effect("stiffness_field")
MODULUS = 20e3


@pytest.fixture(scope="module")
def forward(bench):
    recording, model = bench.record()
    return build_forward(touches_of(model.presses), model)


def _predicted(forward, ratio: np.ndarray) -> np.ndarray:
    """(n, 3) N with a modulus ratio (m,) of each element."""
    places = forward.places
    softness = places.under_tip @ (1 / ratio[places.model.mesh.touchable_elements])
    settings = forward.ideal(MODULUS)
    settings.far, settings.dent_ratio = far_of(places, energy_fields(places), ratio, softness)
    return forward.predict(settings)


def _own_log(forward, force: np.ndarray) -> np.ndarray:
    """(p,) ln of each press's modulus, as if the object were of one, over the object's."""
    plain = forward.predict(forward.ideal(MODULUS))
    keep = forward.touches.counted[:, None]

    def sums(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.bincount(forward.press, weights=(keep * a * b).sum(axis=1))

    return np.log(sums(force, plain) / sums(plain, plain))


def test_the_same_everywhere_is_another_modulus(forward):
    ratio = np.full(len(energy_fields(forward.places).centroid), 1.7)
    plain = forward.predict(forward.ideal(MODULUS))
    np.testing.assert_allclose(_predicted(forward, ratio), 1.7 * plain, rtol=1e-3, atol=1e-4)


def test_presses_tell_of_elements_by_their_shares(forward):
    """The shares are the derivatives of each press's own ln E by the elements'."""
    places = forward.places
    settings = forward.ideal(MODULUS)
    before = _own_log(forward, forward.predict(settings))
    settings.far = settings.far.copy()
    settings.far[:, 0, 0] += 1.0
    answer = before - _own_log(forward, forward.predict(settings))
    shares = shares_in_elements(places, answer)
    np.testing.assert_allclose(shares.weight.sum(axis=1), 1.0)
    rng = np.random.default_rng(2)
    direction = rng.normal(size=3) / 0.02
    log = 0.03 * np.sin(energy_fields(places).centroid @ direction)
    own = _own_log(forward, _predicted(forward, np.exp(log)))
    expected = shares.weight @ log
    assert np.corrcoef(own, expected)[0, 1] > 0.98
    np.testing.assert_allclose(own, expected, atol=0.15 * np.abs(expected).max())


def test_first_order_is_near_a_new_factorisation(forward):
    places = forward.places
    fields = energy_fields(places)
    ratio = np.exp(0.25 * np.sin(fields.centroid @ np.array([60.0, 45.0, 30.0])))
    mesh = places.model.mesh
    loads = _unit_loads(places, mesh, load_sampler(mesh), slice(None)).reshape(3 * len(mesh.points), -1, 3)

    def own(ratio: np.ndarray | None) -> np.ndarray:
        solver = Solver(mesh, places.model.material.poisson_ratio, ratio)
        return solver.quadratic_forms(loads[solver.free])[places.place] - places.far

    exact, base = own(ratio), own(None)
    first = far_of(places, fields, ratio, np.ones(len(places.point)))[0] - places.far
    change, told = (exact - base)[:, 0, 0], first[:, 0, 0]
    assert np.abs(change).max() > 1.0
    np.testing.assert_allclose(told, change, atol=0.2 * np.abs(change).max())


def test_what_is_applied_is_what_was_fitted(forward):
    """The elements of the model with the effect are those whose far field the fit had."""
    values = np.zeros(len(FIELD.parameters))
    values[:2] = 1.0, -0.7
    keys = FIELD.report(values, forward, MODULUS)
    model = FIELD.applied(forward.model, keys)
    ratio = model.element_ratio
    assert np.ptp(np.log(ratio)) > 0.05
    settings = forward.ideal(MODULUS)
    FIELD.act(settings, values, forward)
    softness = forward.places.under_tip @ (1 / ratio[model.mesh.touchable_elements])
    far, dent = far_of(forward.places, energy_fields(forward.places), ratio, softness)
    np.testing.assert_allclose(settings.far, far, atol=1e-2)
    np.testing.assert_allclose(settings.dent_ratio, dent, rtol=1e-4)


def test_written_and_read_back_the_field_is_there(forward, tmp_path):
    import pyvista

    from palpate.mechanics.model.files import read_model, write_model

    values = np.zeros(len(FIELD.parameters))
    values[0] = 1.0
    model = FIELD.applied(forward.model, FIELD.report(values, forward, MODULUS))
    again = read_model(write_model(tmp_path / "model", model))
    np.testing.assert_allclose(again.element_ratio, model.element_ratio)
    drawn = pyvista.read(tmp_path / "model" / "mesh.vtu").cell_data["young_modulus_pa"]
    np.testing.assert_allclose(drawn, model.material.young_modulus_pa * model.element_ratio)
    assert FIELD.name in again.effects
