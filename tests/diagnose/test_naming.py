"""When an effect is named: what one site says, or many."""

from types import SimpleNamespace

import numpy as np
import pytest

from diagnose.attribution import _with_strain
from diagnose.judging import AttributionOptions, Score, Search
from diagnose.verdict import FINITE_STRAIN_GAIN
from mechanics.effects.registry import effect


def score(name, per_group, **changes):
    gains = np.asarray(per_group, float)
    z = gains.sum() / (gains.std() * np.sqrt(len(gains)))
    values = {"gain": gains.sum(), "z": z, "size_n": 0.014, "share": 0.7, "toward": 0.9}
    return Score(
        (effect(name),), **{**values, **changes}, per_group=gains, candidate=SimpleNamespace(chi=0.85)
    )


@pytest.fixture
def search():
    search = Search.__new__(Search)
    search.options = AttributionOptions()
    search.felt_n = 0.010
    return search


@pytest.mark.parametrize("name", ["tip_radius", "tool_compliance", "strain_stiffening"])
def test_one_site_does_not_name_what_every_site_feels(search, name):
    alone = [110.0] + [0.5] * 39
    shared = [3.0, 2.0, 5.0, 4.0] * 10
    assert not search.passes(score(name, alone))
    assert search.passes(score(name, shared))


@pytest.mark.parametrize("name", ["friction_slip", "compliant_base", "time_delay"])
def test_what_one_place_gains_is_no_evidence_but_for_a_lump(search, name):
    alone = score(name, [400.0] + [1.5] * 39, z=5.0, share=0.3)
    assert alone.evidence < 60 < alone.gain
    assert not search.passes(alone)
    assert score("inclusion", [400.0] + [1.5] * 39).evidence == pytest.approx(458.5)


@pytest.mark.parametrize(("loud", "named"), [(-300.0, True), (300.0, False)])
def test_one_loud_site_does_not_decide_on_finite_strain(search, loud, named):
    """All other sites prefer one law; the one that slipped would tip the sum the other way."""
    quiet = np.full(24, 3.0 if named else -3.0)
    quiet[7] = loud

    def judged(effects):
        gram = np.zeros((24, 1, 1))
        gram[:, 0, 0] = 500.0 - (2 * quiet if effects else 0.0)
        return SimpleNamespace(chi=1.0, found=SimpleNamespace(gram=gram, loss=gram.sum() / 2))

    search.judge = judged
    search.finite_strain = effect("finite_strain")
    search.forward = SimpleNamespace(touches=SimpleNamespace(noise=SimpleNamespace(variance_inflation=1.0)))
    _, gain = _with_strain(search, [])
    assert (gain > FINITE_STRAIN_GAIN) == named


def test_what_bends_every_press_by_less_than_the_noise_needs_plenty_of_evidence(search):
    search.felt_n = 0.0145
    assert not search.passes(score("strain_stiffening", [3.0, 2.0, 2.5] * 13))
    assert search.passes(score("strain_stiffening", [3.0, 2.0, 2.5] * 13, size_n=0.02))
    assert search.passes(score("strain_stiffening", [6.0, 4.0, 5.0] * 13))


def test_one_site_may_name_a_lump(search):
    assert search.passes(score("inclusion", [130.0] + [0.5] * 39))


def test_weak_evidence_is_not_enough_where_repeats_disagree_by_more(search):
    weak = [1.0, 2.0, 1.5, 1.0] * 10
    assert search.passes(score("tip_radius", weak))
    assert not search.passes(score("tip_radius", weak, scatter_n=0.03))
    # what acts in time shows within a press, whatever its repeats do
    assert search.passes(score("time_delay", weak, scatter_n=0.03))
