"""From which size on an effect is named."""

from __future__ import annotations

import copy
import dataclasses

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.search.limits import (
    DRAWS,
    Patterns,
    Products,
    detectable,
    without_first_touches,
)
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.model.model import Model


def search_of(model, presses) -> Search:
    return Search(
        build_forward(touches_of(presses), model), 20e3, nuisance=NuisanceOptions(),
        options=AttributionOptions(), site_sd=None, finite_strain=effect("finite_strain"),
    )  # fmt: skip


@pytest.fixture(scope="module")
def judged(bench):
    """(search, the plain fit) of presses with nothing in them."""
    _, model = bench.record()
    search = search_of(model, model.presses)
    return search, search.judge([effect("finite_strain")])


def test_an_effect_of_its_limit_is_named_and_one_of_a_third_is_not(judged):
    tried = [effect("time_delay"), effect("viscoelasticity"), effect("tip_radius")]
    limits = detectable(*judged, tried)
    patterns = Patterns(*judged, tried, True, seed=5)
    for number, own in enumerate(tried):
        form = np.flatnonzero(patterns.own == number)[np.zeros(DRAWS, dtype=int)]
        shares = [
            patterns.named(number, form, np.full(DRAWS, times * limits[own.name])).mean()
            for times in (2, 1 / 3)
        ]
        assert shares[0] > 0.9 > 0.5 > shares[1]


def test_what_inner_products_score_is_what_the_search_scores_of_the_same_residual(judged):
    """A delay, whose force is nearly linear in it."""
    search, base = judged
    delay = effect("time_delay")
    patterns = Patterns(search, base, [delay], True, seed=5)
    found, forward = base.found, search.forward
    force = forward.predict(settings_of(forward, found.effects, found.values, found.onset))
    size_n = 1.5 * detectable(search, base, [delay])["time_delay"]
    force += size_n / patterns.size[0] * patterns.columns[:, :, 1]
    force += search.whitener.drawn(DRAWS, np.random.default_rng(5))[:, :, 0]
    own = search_on_force(search, force)
    old, new = own.judge([search.finite_strain]), own.judge([search.finite_strain, delay])
    score = own.score([delay], new, old)
    column, factor = np.ones(DRAWS, dtype=int), np.full(DRAWS, size_n / patterns.size[0])
    white = patterns.white.with_column(column, factor)
    linear = patterns.scored(0, white, white.gains())
    # noise is drawn as loud at each sample as it adds up to along a press, which the search sees as misfit
    assert linear.gain[0] == pytest.approx(score.gain * max(1.0, new.chi), rel=0.2)


def search_on_force(search: Search, force: np.ndarray) -> Search:
    """The same search on other forces (n, 3) N, local frame."""
    forward = copy.copy(search.forward)
    t = forward.touches
    forward.touches = dataclasses.replace(t, force=np.einsum("nji,nj->ni", t.frame[t.press], force))
    return Search(
        forward, 20e3, nuisance=NuisanceOptions(), options=AttributionOptions(), site_sd=None,
        finite_strain=effect("finite_strain"),
    )  # fmt: skip


def test_a_spring_in_the_tool_hides_behind_modulus_and_first_touch_as_a_delay_does_not(judged):
    """A delay by a clock that is known, for what hides; by one that is not, its limit is the clock's."""
    delay = effect("time_delay")
    known = dataclasses.replace(delay, hints=dataclasses.replace(delay.hints, untold=()))
    search, base = judged
    base = dataclasses.replace(base, place_chi=1.0)  # places that scatter as is said of them
    limits = detectable(search, base, [known, effect("tip_radius"), effect("tool_compliance")])
    assert limits["time_delay"] < 0.7 * min(limits["tip_radius"], limits["tool_compliance"])
    assert detectable(*judged, [delay])["time_delay"] > 1.2 * limits["time_delay"]


def test_places_that_scatter_less_than_is_said_show_what_is_smaller(judged):
    """As the rule of naming counts by their scatter; what acts in time is told by noise."""
    search, base = judged
    tried = [effect("compliant_base"), effect("time_delay")]
    wide, narrow = (
        detectable(search, dataclasses.replace(base, place_chi=places), tried) for places in (1.0, 0.1)
    )
    assert narrow["compliant_base"] < 0.8 * wide["compliant_base"] < np.inf
    assert narrow["time_delay"] == wide["time_delay"]


def test_an_effect_that_starts_from_nothing_has_a_limit_as_well(judged):
    limits = detectable(*judged, [effect("force_gain"), effect("modulus_gradient")])
    assert all(1e-4 < limit < 1.0 for limit in limits.values())


def test_a_move_shows_by_first_touches_only_where_the_surface_stayed(judged, monkeypatch):
    """Fitted to the same presses, the surface moves along with them."""
    search, base = judged
    move = effect("surface_offset")
    assert detectable(search, base, [move]) == {"surface_offset": np.inf}
    monkeypatch.setattr(Model, "fitted_to", lambda self, presses: False)
    assert detectable(search, base, [move])["surface_offset"] < 1.0


def test_places_miss_by_about_what_is_said_of_them_and_a_slipped_touch_does_not_count(judged):
    search, _ = judged
    whitener, t = search.whitener, search.forward.touches
    drawn = whitener.drawn(40, np.random.default_rng(2))
    each = [whitener.place_chi(r) for r in np.moveaxis(drawn, 2, 0)]
    assert 0.6 < np.mean(each) < 1.1  # without the place that misses most
    assert whitener.place_chi(2 * drawn[:, :, 0]) == pytest.approx(4 * each[0])
    slipped = drawn[:, :, 0].copy()
    slipped[t.site[t.press] == 1] *= 30
    assert whitener.place_chi(slipped) < 2 * each[0] + 1


def test_slow_noise_does_not_hide_what_is_far_above_the_noise(judged):
    """Noise that adds up along a press is loud beside soft presses, not beside our own errors of the law."""
    search, base = judged
    pushed = base.found.jacobian[:, :, :1] * 0.3  # a third more stiffness: some standard deviations
    slow = copy.copy(search)
    slow.forward = copy.copy(search.forward)
    t = slow.forward.touches
    slow.forward.touches = dataclasses.replace(t, noise=dataclasses.replace(t.noise, variance_inflation=9.0))
    slow.renew(base.found)
    quick, late = (float(s.whitener.gram(pushed).sum()) for s in (search, slow))
    assert late > 3 / 9 * quick  # as if all of it were divided by nine, a ninth


def test_first_touches_that_are_free_make_no_effect_plainer_and_take_a_shift_of_them_whole(judged):
    search, base = judged
    patterns = Patterns(search, base, [effect("tip_radius"), effect("time_delay")], False, seed=5)
    t, column = search.forward.touches, search.whitener.onset_column
    shifts = np.random.default_rng(2).normal(size=len(t))[t.press][:, None] * column
    shifts[~t.counted] = 0.0
    changes = np.concatenate([patterns.columns[:, :, 1:], shifts[:, :, None]], axis=2)
    left = without_first_touches(search, changes)

    def squares(x):
        return np.diag(search.whitener.gram(x).sum(axis=0))

    share = squares(left) / squares(changes)
    assert (share[:-1] < 1).all()
    assert share[-1] < 1e-6 < 0.05 < share[:-1].min()


def test_a_column_of_one_place_alone_says_nothing_of_the_places_without_it():
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(4, 30, 3))  # groups, samples, (modulus, a column, a draw)
    rows[1:, :, 1] = 0.0
    gram = np.einsum("gsi,gsj->gij", rows, rows)
    found = Products.of(gram, 2).fitted(np.array([1]))
    level = np.array([gram[k, 0, 2] for k in range(4)])
    without_first = level[1:].sum() / gram[1:, 0, 0].sum()
    alone = gram[0, 2, 2] - 2 * without_first * gram[0, 0, 2] + without_first**2 * gram[0, 0, 0]
    assert found.held[0, 0] == pytest.approx(alone, rel=1e-6)
