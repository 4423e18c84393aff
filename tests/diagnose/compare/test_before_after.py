"""Two recordings of one object: what differs, with its interval, and what explains it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import palpate.show  # noqa: F401  who says and draws results
from palpate import cli
from palpate.diagnosis.compare.before_after import Side, changes
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.presses.making import of_places
from palpate.mechanics.shape.tetmesh import box_mesh

UP = np.array([0.0, 0.0, 1.0])


def side(modulus, *, share=0.03, effects=(), intervals=None, beside=None, seed=0, shift=0.0):
    """A slab pressed at nine places, its modulus known to a share."""
    rng = np.random.default_rng(seed)
    at = np.array([[x, y, 0.02] for x in (0.01, 0.03, 0.05) for y in (0.01, 0.03, 0.05)]) + [shift, 0, 0]
    own = modulus * np.exp(0.02 * rng.standard_normal(18))
    presses = of_places(np.repeat(at, 2, axis=0), np.tile(UP, (18, 1)), 0.004, fits={"e_pa": own})
    interval = (modulus * np.exp(-1.96 * share), modulus * np.exp(1.96 * share))
    model = Model(
        box_mesh((6, 6, 2), (0.06, 0.06, 0.02)), ObjectMaterial(modulus, 0.49, interval),
        Support(np.zeros(3), UP),
        Tool(0.004), 0.01, presses=presses,
    )  # fmt: skip
    entries = [
        SimpleNamespace(name=n, intervals=(intervals or {}).get(n, {}), parameters={"mu": 0.1})
        for n in effects
    ]
    diagnosis = SimpleNamespace(
        effects=effects, entries=entries, young_modulus_pa=beside or modulus, summary="told", kind="effect",
        candidates=(),
    )  # fmt: skip
    return Side(SimpleNamespace(name=f"rec {seed}", path=None), model, diagnosis)


def test_one_object_twice_shows_no_difference():
    found = changes(side(16e3), side(16.4e3, seed=1))
    assert not found.differs and found.explained_by == ()
    assert found.ratio_ci95[0] < 1 < found.ratio_ci95[1]
    assert len(found.places) == 9 and "no difference" in found.summary


def test_a_stiffer_object_is_told_with_its_interval():
    found = changes(side(16e3), side(20e3, seed=1))
    assert found.explained_by == ("young_modulus",)
    low, high = found.ratio_ci95
    assert low < 1.25 < high and high / low == pytest.approx(np.exp(2 * 1.96 * 0.03 * np.sqrt(2)), rel=1e-6)
    assert found.difference_ci95_pa[0] < 4e3 < found.difference_ci95_pa[1]
    assert np.median([p.ratio for p in found.places]) == pytest.approx(1.25, rel=0.03)


def test_a_tool_that_bends_explains_what_vanishes_beside_it():
    bent = side(13e3, effects=("tool_compliance",), beside=15.8e3, seed=1)
    found = changes(side(16e3), bent)
    assert found.differs and found.explained_by == ("tool_compliance",)
    assert any("in the second recording alone" in reason for reason in found.reasons)


def test_an_effect_of_both_is_told_where_its_parameters_lie_apart():
    one = side(16e3, effects=("friction_slip",), intervals={"friction_slip": {"mu": [0.1, 0.2]}})
    two = side(16e3, effects=("friction_slip",), intervals={"friction_slip": {"mu": [0.4, 0.6]}}, seed=1)
    assert changes(one, two).explained_by == ("friction_slip",)
    assert "friction slip" in changes(one, two).summary
    assert changes(one, one).explained_by == ()


def test_recordings_without_a_common_frame_share_no_place():
    assert changes(side(16e3), side(16e3, seed=1, shift=0.5)).places == ()


def test_it_prints_draws_and_writes_a_page(tmp_path):
    result = changes(side(16e3), side(20e3, seed=1))
    assert str(result)
    held = result.as_json()
    assert held["differs"] is True and held["explained_by"] == ["young_modulus"] and len(held["places"]) == 9
    page = result.report(tmp_path / "page.html").read_text()
    assert page.startswith("<!doctype html>") and 'class="view3d"' in page and "What to do next" in page


def test_a_model_goes_with_one_recording(tmp_path, capsys):
    words = ["compare", "silicone-1-cylinder", "silicone-1-cylinder", "--model", "demo"]
    assert cli.main(words) == 2
    assert "--model needs one recording" in capsys.readouterr().err
