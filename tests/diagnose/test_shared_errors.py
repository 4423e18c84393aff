"""What all presses may have wrong alike: it is fitted beside the modulus, and named by nobody."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.search.shared import SHARED, own_onset_sd, shared_sd
from palpate.mechanics.effects.registry import effect

KNOWN = NuisanceOptions(common_onset_m=0.0, common_stick=0.0, shallow_stick=0.0)


@pytest.fixture(scope="module")
def scene(bench):
    _, model = bench.record()
    return build_forward(touches_of(model.presses), model)


def read(scene, shared, nuisance=None):
    """(search, fit) of forces that the ideal model has with the shared errors (s,), and half the noise."""
    t = scene.touches
    settings = settings_of(scene, (), np.array([np.log(20e3), *shared]))
    force = scene.predict(settings) + 0.5 * t.noise_n * np.random.default_rng(3).standard_normal(
        (len(t.t), 3)
    )
    force = np.einsum("nji,nj->ni", t.frame[t.press], force)
    own = dataclasses.replace(scene, touches=dataclasses.replace(t, force=force))
    search = Search(
        own, 20e3, nuisance=nuisance or NuisanceOptions(), options=AttributionOptions(), site_sd=None,
        finite_strain=effect("finite_strain"),
    )  # fmt: skip
    return search, search.judge([])


@pytest.mark.parametrize(("number", "value"), [(0, 1e-4), (0, -1e-4), (1, 0.05), (2, 0.3)])
def test_an_error_that_all_presses_share_is_found_and_needs_no_effect(scene, number, value):
    shared = np.zeros(len(SHARED))
    shared[number] = value
    search, base = read(scene, shared)
    # its prior draws it towards none
    assert 0.2 < base.found.shared[number] / value < 1.4
    assert np.exp(base.found.values[0]) == pytest.approx(20e3, rel=0.01)
    loss = base.found.loss
    assert loss < read(scene, shared, KNOWN)[1].found.loss + 1.0
    for name in ("skin_layer", "tip_radius", "strain_stiffening"):
        assert search.judge([effect(name)]).found.loss > loss - 3.0, name


def test_a_surface_that_the_presses_did_not_make_may_not_be_early(scene):
    assert shared_sd(scene, NuisanceOptions())[0] > 0
    other = dataclasses.replace(scene, touches=dataclasses.replace(scene.touches, recording="another"))
    early, *sideways = shared_sd(other, NuisanceOptions())
    assert early == 0 and np.all(np.array(sideways) > 0)
    assert len(shared_sd(scene, KNOWN)) == 0


def test_first_touches_are_as_sure_as_the_surface_that_was_fitted_to_them(scene):
    nuisance = NuisanceOptions()
    stated = np.full(len(scene.model.mesh.points), 0.4e-3)
    for model, expected in (
        (scene.model.replaced(shape_uncertainty_m=None), nuisance.fitted_onset_m),
        (scene.model.replaced(shape_uncertainty_m=stated), np.hypot(nuisance.fitted_onset_m, 0.24e-3)),
    ):
        own = dataclasses.replace(scene, places=dataclasses.replace(scene.places, model=model))
        assert own_onset_sd(own, nuisance) == pytest.approx(expected)
    other = dataclasses.replace(scene, touches=dataclasses.replace(scene.touches, recording="another"))
    assert own_onset_sd(other, nuisance).min() >= nuisance.onset_m
