"""When an effect is named: what one site says, or many."""

from types import SimpleNamespace

import numpy as np
import pytest

from diagnose.judging import AttributionOptions, Score, Search


def score(name, per_group, **changes):
    gains = np.asarray(per_group, float)
    z = gains.sum() / (gains.std() * np.sqrt(len(gains)))
    values = {"gain": gains.sum(), "z": z, "size_n": 0.014, "closes": 1e-4, "share": 0.7, "toward": 0.9}
    return Score(name, **{**values, **changes}, per_group=gains, candidate=SimpleNamespace(chi=0.85))


@pytest.fixture
def search():
    search = Search.__new__(Search)
    search.options = AttributionOptions()
    return search


@pytest.mark.parametrize("name", ["tip_radius", "tool_compliance", "strain_stiffening"])
def test_one_site_does_not_name_what_every_site_feels(search, name):
    alone = [110.0] + [0.5] * 39
    shared = [3.0, 2.0, 5.0, 4.0] * 10
    assert not search.passes(score(name, alone))
    assert search.passes(score(name, shared))


def test_one_site_may_name_a_lump(search):
    assert search.passes(score("inclusion", [130.0] + [0.5] * 39))


def test_weak_evidence_is_not_enough_where_repeats_disagree_by_more(search):
    weak = [1.0, 2.0, 1.5, 1.0] * 10
    assert search.passes(score("tip_radius", weak))
    assert not search.passes(score("tip_radius", weak, scatter_n=0.03))
    # what acts in time shows within a press, whatever its repeats do
    assert search.passes(score("time_delay", weak, scatter_n=0.03))
