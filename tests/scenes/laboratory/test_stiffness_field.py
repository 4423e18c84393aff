"""Random tissue of the laboratory: as different as its strength says, layers where they are drawn."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.scenes.laboratory.contact import SphereContact
from palpate.scenes.laboratory.effects import effect
from palpate.scenes.laboratory.effects.stiffness_field import LOG_SD, field_of
from palpate.scenes.laboratory.field import log_ratio
from palpate.scenes.laboratory.specimen import Fineness, Specimen, build
from palpate.scenes.phantoms import phantom

BLOCK = phantom("block")


def _keys(seed: int, strength: float = 1.0) -> dict:
    bench = SimpleNamespace(phantom=BLOCK, rng=np.random.default_rng(seed))
    return effect("stiffness_field").parameters(strength, bench)


def test_smooth_fields_scatter_as_the_strength_says():
    points = np.random.default_rng(0).uniform(-300, 300, (2000, 3))
    spread = []
    for seed in range(8):
        keys = {**_keys(seed), "layers": []}
        spread.append(log_ratio(field_of(keys), points, np.zeros(len(points))).std() / keys["log_sd"])
    assert np.mean(spread) == pytest.approx(1.0, rel=0.1)
    assert _keys(0, 2.0)["log_sd"] == pytest.approx(2 * _keys(0)["log_sd"])
    assert max(_keys(seed)["log_sd"] for seed in range(4)) <= LOG_SD


def test_layers_follow_the_depth():
    field = ((), ((4.0, 0.5), (6.0, -0.3)), 0.5)
    depth = np.array([0.0, 2.0, 4.0, 8.0, 30.0])
    found = log_ratio(field, np.zeros((5, 3)), depth)
    np.testing.assert_allclose(found, [0.5, 0.5, 0.1, -0.3, -0.3], atol=0.01)


def test_half_of_all_cases_have_layers():
    layered = [bool(_keys(seed)["layers"]) for seed in range(40)]
    assert 10 < sum(layered) < 30


def test_a_field_has_curves_of_its_own():
    changed = effect("stiffness_field").in_solid(Specimen(), _keys(1))
    assert changed.field is not None and changed.key() != Specimen().key()
    assert effect("stiffness_field").in_solid(Specimen(), _keys(1)).key() == changed.key()


def _force(field, cache, tip: float) -> float:
    """On a tip 1 mm deep, its penalty `tip` times as stiff as in the laboratory."""

    def stiffer(*args) -> SphereContact:
        contact = SphereContact(*args)
        contact.weights *= tip
        return contact

    point, up = np.array([0.0, 0.0, 1e3 * BLOCK.height_m]), np.array([0.0, 0.0, 1.0])
    specimen = replace(Specimen(), field=field)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("palpate.scenes.laboratory.touching.SphereContact", stiffer)
        problem = build(
            BLOCK, specimen, point, travel=0.5, fineness=Fineness(finest=6.0, growth=1.0), cache=cache
        )
    state = problem.rest(point + specimen.tip_radius * up)
    for deep in (0.5, 1.0):
        state = problem.advance(state, point + (specimen.tip_radius - deep) * up)
    return float(state.force[2])


@pytest.mark.slow
def test_a_solid_twice_as_stiff_everywhere_answers_with_twice_the_force(tmp_path):
    """The tip's penalty is no part of the solid: it is made twice as stiff too. Left as it is, it takes up to
    two hundredths of the force, by the mesh that the mesher's chance gives."""
    twice = ((), ((100.0, float(np.log(2.0))),), 0.5)
    assert _force(twice, tmp_path, tip=2.0) == pytest.approx(2 * _force(None, tmp_path, tip=1.0), rel=1e-4)
