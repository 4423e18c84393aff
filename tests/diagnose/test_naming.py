"""When an effect is named: what one site says, or many."""

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.diagnosis.options import AttributionOptions
from palpate.diagnosis.search.attribution import _told_apart, _with_strain, _without_idle
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.gaps import lower_closure
from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.diagnosis.search.naming import WEIGHTS, Score
from palpate.diagnosis.search.rivals import Choice
from palpate.mechanics.effects.registry import effect


def score(name, per_group, foretold=9.0, values=(0.02,), share=0.02):
    gains = np.asarray(per_group, float)
    return Score(
        (effect(name),), gain=gains.sum(), size_n=0.014, share=share, foretold=foretold, per_group=gains,
        candidate=SimpleNamespace(chi=0.85, found=SimpleNamespace(of=lambda name: np.array(values))),
        border=WEIGHTS.border_of(effect(name).scope),
    )  # fmt: skip


@pytest.fixture
def search():
    search = Search.__new__(Search)
    search.options = AttributionOptions()
    return search


@pytest.mark.parametrize("name", ["tip_radius", "tool_compliance", "time_delay"])
def test_one_site_does_not_name_what_every_site_feels(search, name):
    assert not search.passes(score(name, [410.0] + [0.1] * 39))
    assert search.passes(score(name, [12.0, 8.0, 20.0, 16.0] * 10))


def test_a_loop_needs_more_than_what_acts_in_space(search):
    """Slow noise imitates it: sound cases show up to 83 nats of a delay, true ones 275 and more."""
    assert search.passes(score("tip_radius", [2.0] * 40))
    assert not search.passes(score("time_delay", [2.0] * 40)) and search.passes(
        score("time_delay", [5.0] * 40)
    )


def test_places_that_scatter_less_than_said_tell_more():
    def over(places, chi):
        return JudgedSet(None, np.zeros(places), np.zeros(places), np.full(places, 0.8), places, chi).over

    assert over(10, 2.0) == 2.0 and over(10, 1.0) == 1.0
    assert over(1000, 0.2) < over(10, 0.2) == pytest.approx(0.6)


def test_one_site_may_name_a_lump(search):
    alone = [200.0] + [0.5] * 39
    assert score("inclusion", alone).evidence == pytest.approx(219.5 - np.log(40))
    assert search.passes(score("inclusion", alone))


def test_what_is_there_is_named_unless_places_that_it_has_not_seen_grow_unlikelier(search):
    everywhere = [12.0, 8.0, 20.0, 16.0] * 10
    assert search.passes(score("strain_stiffening", everywhere, foretold=0.1))
    assert not search.passes(score("strain_stiffening", [1e3 * gain for gain in everywhere], foretold=-5.0))


@pytest.mark.parametrize(("delay_s", "named"), [(5e-4, False), (-5e-4, False), (5e-3, True)])
def test_a_clock_that_reads_half_a_sample_late_is_no_delay(search, delay_s, named):
    """However surely many touches tell it: it may be so where nothing is wrong."""
    assert search.passes(score("time_delay", [12.0, 8.0, 20.0, 16.0] * 10, values=(delay_s,))) == named


@pytest.mark.parametrize(
    ("name", "share", "named"),
    [
        ("skin_layer", 0.002, False),
        ("skin_layer", 0.02, True),
        ("inclusion", 0.002, True),
        ("viscoelasticity", 0.002, True),
    ],
)
def test_what_changes_a_few_thousandths_of_the_force_is_within_our_own_law(name, share, named):
    """Silicones without a flaw held 17 nats for a skin that changed 0.2 % of the force."""
    search = Search.__new__(Search)
    search.options = AttributionOptions()
    assert search.passes(score(name, [12.0, 8.0, 20.0, 16.0] * 10, share=share)) == named


def test_a_closed_gap_without_evidence_names_nothing(search):
    assert not search.passes(score("compliant_base", [0.1] * 40))


def test_probabilities_grow_with_evidence():
    few, many = score("time_delay", [0.5] * 40), score("time_delay", [20.0] * 40)
    assert 0 < few.probability < many.probability < 1


@pytest.mark.parametrize(
    ("adds", "lacks", "left", "instead"),
    [
        (-10.0, -10.0, 9.0, False),
        (-10.0, 9.5, -9.5, False),
        (2.0, 4.0, 8.0, False),
        (4.9, -10.7, 9.0, True),
    ],
    ids=["the same", "leaves much to the best, adds nothing", "each adds something", "says all, and more"],
)
def test_rivals_are_told_apart_by_what_each_adds_to_the_other(adds, lacks, left, instead):
    """Both gain much by themselves: odds of 10 and of 9 against nothing more."""
    nu, skin = effect("poisson_ratio"), effect("skin_layer")
    search = SimpleNamespace()
    search.judge = lambda effects, like: SimpleNamespace(found=SimpleNamespace(effects=effects))
    search.score = lambda added, new, old: SimpleNamespace(odds_of_shown=adds if skin in added else lacks)
    scores = {
        e.name: SimpleNamespace(
            added=(e,), log_odds=odds, candidate=SimpleNamespace(found=SimpleNamespace(effects=(e,)))
        )
        for e, odds in ((nu, 10.0), (skin, 9.0))
    }
    choice = Choice({(n,): s.log_odds for n, s in scores.items()}, (nu.name,))
    found, more = _told_apart(search, choice, scores, scores[nu.name])
    assert found.log_odds[(skin.name,)] == pytest.approx(left)
    assert more is (scores[skin.name] if instead else None)


def test_our_own_law_hides_a_change_but_does_not_choose_between_two_causes_of_it():
    """A skin beside a tip's radius changes the force by 0.5 %, and gains 86 nats that the radius has not."""
    skin = score("skin_layer", [25.0, 20.0, 17.0, 14.0, 10.0], values=(0.004, 0.9), share=0.005)
    assert skin.evidence < 4.0 and skin.log_odds < 0.0 < skin.odds_of_shown


def test_a_lump_that_one_place_alone_speaks_for_is_known_as_such():
    assert score("inclusion", [20.0] + [-0.1] * 39).by_one_place
    assert score("inclusion", [45.0, 2.0] + [0.0] * 38).by_one_place
    assert not score("inclusion", [20.0, 9.0] + [-0.1] * 38).by_one_place


def test_a_gap_smaller_than_what_matters_is_not_closed_by_less():
    """Ten places, all of the noise but for a little that an effect takes away."""
    counts = np.full(10, 50)
    noise = 1e-4
    before = counts * (noise + 0.02 * noise)
    after = counts * noise
    assert lower_closure(before, after, counts, noise, 0.25 * noise, doubt=0.1) == pytest.approx(0.08)
    assert lower_closure(before, after, counts, noise, 0.001 * noise, doubt=0.1) == pytest.approx(1.0)


def test_the_closure_counts_on_what_most_places_say():
    """One place that grows much worse weighs more than nine that grow better."""
    counts = np.full(10, 50)
    before = np.full(10, 2.0)
    assert lower_closure(before, np.full(10, 0.5), counts, 0.0, 1e-3, doubt=0.1) == pytest.approx(0.75)
    assert lower_closure(before, np.array([0.5] * 9 + [10.0]), counts, 0.0, 1e-3, doubt=0.1) < 0.0


@pytest.mark.parametrize(("loud", "named"), [(-300.0, True), (300.0, False)])
def test_one_loud_site_does_not_decide_on_finite_strain(search, loud, named):
    """All other sites prefer one law; the one that slipped would tip the sum the other way."""
    quiet = np.full(24, 3.0 if named else -3.0)
    quiet[7] = loud

    def judged(effects):
        gram = np.zeros((24, 1, 1))
        gram[:, 0, 0] = 500.0 - (2 * quiet if effects else 0.0)
        plain = np.full(24, 0.9 if effects else 1.0)
        return SimpleNamespace(over=1.0, plain=plain, found=SimpleNamespace(gram=gram, loss=gram.sum() / 2))

    search.judge = judged
    search.finite_strain = effect("finite_strain")
    _, gain, closes = _with_strain(search, [])
    assert closes == pytest.approx(2.4)
    assert (gain > AttributionOptions().beyond_doubt) == named


@pytest.mark.parametrize(("left", "stays"), [(0.9, True), (1.1, False)])
def test_what_the_support_showed_stays_unless_presses_are_predicted_worse_with_it(search, left, stays):
    gain = effect("force_gain")
    plain, seen = (
        SimpleNamespace(plain=np.full(24, value), found=SimpleNamespace(effects=effects))
        for value, effects in ((1.0, ()), (left, (gain,)))
    )
    search.judge = lambda effects: seen if effects else plain
    kept, chosen = _without_idle(search, [gain.name], seen, frozenset({gain.name}))
    assert chosen == [gain.name] * stays and kept is (seen if stays else plain)
