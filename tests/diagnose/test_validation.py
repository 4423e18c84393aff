"""What a fit says of its own parameters, and of places that it has not seen."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.descent import Descent, fit
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import covariance, parameter_intervals
from palpate.diagnosis.search.leave_one_out import JudgedSet, held_out
from palpate.diagnosis.search.naming import Score
from palpate.diagnosis.search.site_stiffness import repeat_scatter
from palpate.diagnosis.verdict.held_out import deepest, held_out_by_refit, neighbours
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.effects.time_delay import EFFECT as DELAY

MODULUS = 20e3


@pytest.fixture(scope="module")
def late(bench):
    """(search, fit without effect, fit with a delay) of presses whose force reads 10 ms late."""

    def alter(t, x, f):
        return x, np.stack([np.interp(t - 0.01, t, c) for c in f.T], axis=1)

    recording, model = bench.record(alter)
    forward = build_forward(touches_of(model.presses), model)
    search = Search(
        forward, MODULUS, nuisance=NuisanceOptions(), options=AttributionOptions(), site_sd=None,
        finite_strain=effect("finite_strain"),
    )  # fmt: skip
    deep = effect("finite_strain")
    plain = fit(forward, search.whitener, [deep], modulus=MODULUS)
    return search, plain, fit(forward, search.whitener, [deep, DELAY], modulus=MODULUS)


def test_the_interval_holds_the_truth_and_is_narrow(late):
    search, _, found = late
    rng = np.random.default_rng(0)
    low, high = parameter_intervals(found, "time_delay", search.forward, search.dof, rng)["delay_s"]
    assert low < 0.01 < high
    assert 1e-5 < high - low < 4e-3


def test_fewer_sites_tell_less(late):
    search, _, found = late
    few = found.__class__(**{**found.__dict__, "gram": found.gram[::4]})
    whole, part = (covariance(f, d)[1, 1] for f, d in ((found, search.dof), (few, search.dof / 4)))
    assert part > 2 * whole


def test_what_no_noise_tells_is_added(late):
    search, _, found = late
    rng = np.random.default_rng(0)
    low, high = parameter_intervals(found, "time_delay", search.forward, search.dof, rng)["delay_s"]
    formal = np.sqrt(covariance(found, search.dof)[1, 1])
    expected = 2 * 1.96 * np.hypot(formal, DELAY.hints.systematic[0])
    assert high - low == pytest.approx(expected, rel=0.2)


def test_what_one_place_alone_speaks_for_foretells_nothing(late):
    """The other places would not have added it, so they do not predict it: as a lump under one place."""
    search, plain, _ = late
    old = JudgedSet(
        plain, 0.5 * plain.gram[:, 0, 0], plain.raw[:, 0, 0].copy(), plain.gram[:, 0, 0], search.dof, 1.0
    )

    def better_at(sites) -> Score:
        gram, lower = plain.gram.copy(), old.plain.copy()
        gram[sites, 0, 0] *= 0.2
        lower[sites] *= 0.2
        found = dataclasses.replace(plain, gram=gram)
        return search.score(
            [DELAY], JudgedSet(found, 0.5 * gram[:, 0, 0], lower, gram[:, 0, 0], search.dof, 1.0), old
        )

    assert better_at([1]).foretold == better_at([1]).gain == 0.0
    assert better_at([1, 3, 5]).foretold > 1.0


class Twins:
    """Two parameters of which only the sum is felt, but for a square of their difference: as two branches of
    a memory at one time. Each of four groups is one row; the last place is unlike the others."""

    low, high = np.full(3, -50.0), np.full(3, 50.0)
    measured = np.array([[1.0, 0.0, 0.0], [1.1, 0.0, 0.0], [0.9, 0.0, 0.0], [1.4, 0.0, 0.0]])
    weight = np.array([1.0, 1.01, 0.99, 1.02])
    whitener = SimpleNamespace(raw_gram=lambda x: np.einsum("gci,gcj->gij", x, x))

    def predicted(self, v):
        felt = v[0] + v[1] + v[2] + self.weight * 1e-3 * (v[1] - v[2]) + 5.0 * (v[1] - v[2]) ** 2
        return np.stack([felt, 0 * felt, 0 * felt], axis=1)

    def residual(self, v, onset):
        return self.measured - self.predicted(v)

    def pulled(self, v):
        return 0.0

    def group_loss(self, residual, onset):
        return 0.5 * (residual**2).sum(axis=1) * 1e4

    def found(self):
        v = np.array([0.9, 0.1, 0.1])
        columns = np.stack(
            [(self.predicted(v + h) - self.predicted(v)) / 1e-7 for h in 1e-7 * np.eye(3)], axis=2
        )
        gram = 1e4 * self.whitener.raw_gram(
            np.concatenate([self.residual(v, None)[:, :, None], columns], axis=2)
        )
        none = np.zeros(3)
        return SimpleNamespace(
            values=v,
            residual=self.residual(v, None),
            jacobian=columns,
            gram=gram,
            prior=none,
            pull=none,
            onset=None,
            likeliest=None,
        )


def test_a_loose_parameter_is_held_out_where_the_other_places_would_have_it():
    """The linear answer for the places that are left throws it far, where they would lose most themselves."""
    twins = Twins()
    found = twins.found()
    held, plain = held_out(found, twins)
    each = np.array([mean_of_others(twins.measured[:, 0], g) for g in range(4)])
    fair = 0.5e4 * (twins.measured[:, 0] - each) ** 2
    assert held.sum() == pytest.approx(fair.sum(), rel=0.2)
    assert np.isfinite(plain).all()


def mean_of_others(values, g):
    return np.delete(values, g).mean()


def test_a_parameter_that_no_motion_shows_is_left_where_it_is(late):
    """Its column is zero, which was a singular matrix."""
    search, plain, _ = late
    slip = effect("friction_slip")
    found = fit(search.forward, search.whitener, [slip], modulus=MODULUS)
    blind = found.gram.copy()
    blind[:, 2:, :] = blind[:, :, 2:] = 0.0
    found = dataclasses.replace(found, gram=blind)
    loss, gaps = held_out(found, Descent(search.forward, search.whitener, found.effects, None))
    assert np.isfinite(loss).all() and np.isfinite(gaps).all()


def test_a_law_that_reaches_one_first_touch_only_gives_numbers_all_the_same(late):
    """A second touch may lie where the law has no number: the place is then judged as it was fitted."""
    search, _, found = late
    found = dataclasses.replace(found, likeliest=found.onset + 1e-6)

    class Half(Descent):
        def residual(self, values, onset):
            there = super().residual(values, onset)
            return np.full_like(there, np.nan) if onset is found.likeliest else there

    loss, gaps = held_out(found, Half(search.forward, search.whitener, found.effects, None))
    assert np.isfinite(loss).all() and np.isfinite(gaps).all()


def test_a_law_without_a_number_at_one_press_is_judged_by_the_others(late):
    """It never wins, and what is said of it is numbers all the same."""
    search, _, found = late
    t = search.forward.touches

    class Short(Descent):
        def residual(self, values, onset):
            return np.where((t.press == 5)[:, None], np.nan, super().residual(values, onset))

    descent = Short(search.forward, search.whitener, found.effects, None)
    short = descent.run(found.values, found.onset, 3)
    assert short.loss == np.inf and np.isfinite(short.gram).all() and np.isfinite(short.raw).all()
    assert all(np.isfinite(each).all() for each in held_out(short, descent))


@pytest.mark.parametrize(("aside_m", "back"), [(7e-5, False), (6e-4, True)])
def test_a_first_touch_is_sought_where_that_gains_more_than_chance(late, aside_m, back):
    search, _, found = late
    descent, t = Descent(search.forward, search.whitener, found.effects, None), search.forward.touches
    aside = found.onset + aside_m * (t.site == 4)
    residual = descent.residual(found.values, aside)
    rests = descent.residual(found.values, found.onset)
    gains = descent.group_loss(residual, aside) - descent.group_loss(rests, found.onset)
    assert (gains[4] > 5.0) == back
    sought, _ = descent.sought(found.values, residual, aside)
    np.testing.assert_allclose(sought, found.onset if back else aside, atol=1e-9)


def test_places_not_fitted_are_predicted_by_the_right_effect(late):
    search, plain, found = late
    t = search.forward.touches
    added = 3 * (t.noise.raw_n**2 - t.noise_n**2)
    before, after = (held_out_by_refit(search, f, None, added) for f in (plain, found))
    noise = 3 * t.noise_n**2 * search.whitener.counts()
    assert after.plain.sum() < 1.3 * noise.sum() < before.plain.sum()
    assert after.deepest_n < before.deepest_n and after.fastest_n < before.fastest_n


def test_readings_put_back_count_as_gap(late):
    search, _, found = late
    bias = np.full_like(found.residual, 0.05)
    with_bias = held_out_by_refit(search, found, bias, 0.0).plain.sum()
    assert with_bias > 2 * held_out_by_refit(search, found, None, 0.0).plain.sum()


def test_a_fit_that_has_not_seen_some_places_is_made_once_while_all_is_weighed_alike(late):
    search, _, found = late
    again = search.without(found, np.array([1, 2]))
    assert search.without(found, np.array([1, 2])) is again
    assert search.without(found, np.array([2])) is not again
    assert search.reweighed(found).without(found, np.array([1, 2])) is not again


def test_folds_hold_every_site_once_and_neighbours_together(late):
    t = late[0].forward.touches
    folds = neighbours(t)
    assert sorted(np.concatenate(folds)) == list(range(t.sites))
    place = np.array([t.point[t.site == s].mean(axis=0) for s in range(t.sites)])
    inside = [np.ptp(place[f], axis=0).max() for f in folds]
    assert np.mean(inside) < 0.6 * np.ptp(place, axis=0).max()
    assert t.deepest[np.isin(t.site, deepest(t))].max() == t.deepest.max()


def test_a_first_touch_left_aside_is_found_again_press_by_press(late):
    search, _, found = late
    descent = Descent(search.forward, search.whitener, found.effects, None)
    aside = found.likeliest.copy()
    aside[[3, 15]] += 3e-4
    residual = descent.residual(found.values, aside)
    onset, better = descent.likeliest_touches(found.values, residual, aside)
    t = search.forward.touches
    moved = np.isin(t.press, [3, 15]) & t.counted
    assert (residual[moved] ** 2).mean() > 3 * (better[moved] ** 2).mean()
    np.testing.assert_allclose(onset, found.likeliest, atol=2e-5)


def test_repeats_that_disagree_are_told(late):
    search, _, found = late
    t = search.forward.touches
    assert repeat_scatter(found.residual, t) < 0.01
    again = (t.repeat > 0)[t.press][:, None]
    assert repeat_scatter(found.residual + 0.2 * again * t.local_force, t) > 0.05
