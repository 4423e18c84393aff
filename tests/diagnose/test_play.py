"""A play of the device beside a hand that trembles: one name, and a second where there is a second."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.instrument.instrument_effects import seen_play
from palpate.diagnosis.instrument.support_readings import Rigid
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.attribution import Attribution, attribute, drop_redundant
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.search.whiten import Whitener
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.recording.side_of_play import leads, play, sides

WIDTH = 0.4e-3
TRIED = ("viscoelasticity", "time_delay", "mullins_softening", "backlash")


def followed(tip: np.ndarray) -> np.ndarray:
    """What a reading shows that the tip drags along once the play is taken up, in steps of 30 um."""
    read = tip.copy()
    for i in range(1, len(tip)):
        read[i] = np.clip(read[i - 1], tip[i] - WIDTH / 2, tip[i] + WIDTH / 2)
    return np.round(read / 3e-5) * 3e-5


def relaxed(t: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Force with a memory of 0.3 s, as large as the force at rest."""
    out, memory = force.copy(), np.zeros(3)
    for i in range(1, len(t)):
        decay = np.exp(-(t[i] - t[i - 1]) / 0.3)
        memory = decay * memory + 0.5 * (1 + decay) * (force[i] - force[i - 1])
        out[i] = force[i] + memory
    return out


def search_on(bench, alter) -> Search:
    recording, model = bench.record(alter, tremor_m=25e-6)
    forward = build_forward(touches_of(bench.table(recording)), model)
    return Search(
        forward, 20e3, nuisance=NuisanceOptions(), options=AttributionOptions(), site_sd=None,
        finite_strain=effect("finite_strain"),
    )  # fmt: skip


def answer(bench, alter, known: Effect | None = None) -> Attribution:
    tried = [known if known is not None and n == known.name else effect(n) for n in TRIED]
    seen = frozenset() if known is None else frozenset({known.name})
    return attribute(search_on(bench, alter), tried, seen=seen)


def test_a_play_beside_tremor_is_one_name(bench):
    found = answer(bench, lambda t, x, f: (followed(x), f))
    assert found.chosen == ("backlash",)
    assert found.final.found.of("backlash")[0] == pytest.approx(-WIDTH, rel=0.15)


@pytest.mark.slow
def test_a_memory_beside_a_play_that_the_support_showed_is_one_name_more(bench):
    rigid = Rigid(0.0, 1e-6, 1e-6, 10.0, play=-WIDTH, play_error=1e-6)
    known = seen_play(rigid, set())
    found = answer(bench, lambda t, x, f: (followed(x), relaxed(t, f)), known)
    assert set(found.chosen) == {"backlash", "viscoelasticity"}


def put_back(bench, alter, *chosen: str) -> list[str]:
    """What is left of an answer."""
    search = search_on(bench, alter)
    base = search.judge([search.finite_strain])
    alone = {}
    for name in TRIED:
        candidate = search.judge([*base.found.effects, effect(name)], like=base)
        alone[name] = search.score([effect(name)], candidate, base)
    whole = search.judge([*base.found.effects, *(effect(n) for n in chosen)], like=base)
    return drop_redundant(search, chosen, whole, alone, frozenset())[1]


@pytest.mark.slow
def test_two_names_are_put_back_to_the_play_that_does_as_well(bench):
    found = put_back(bench, lambda t, x, f: (followed(x), f), "viscoelasticity", "time_delay")
    assert found == ["backlash"]


@pytest.mark.slow
def test_two_names_that_are_both_there_stay(bench):
    found = put_back(bench, lambda t, x, f: (followed(x), relaxed(t, f)), "backlash", "viscoelasticity")
    assert found == ["backlash", "viscoelasticity"]


def test_the_side_is_surest_where_the_reading_moves():
    t = np.arange(0, 3, 1e-3)
    way = np.interp(t, [0, 1, 2, 3], [0, 8e-3, 8e-3, 0])
    lead, unsure = sides(t, np.column_stack([way, way, 0 * way]))
    moving, still = (t > 0.2) & (t < 0.9), (t > 1.4) & (t < 1.6)
    assert (lead[moving, 0] > 0.95).all() and (unsure[moving, 0] < 0.2).all()
    assert (abs(lead[still, 0]) < 0.05).all() and (unsure[still, 0] > 0.5).all()
    assert (unsure[:, 2] > 0.5).all()  # an axis that never moved


def test_a_tip_that_lags_begins_a_press_on_the_side_that_it_came_from():
    t = np.arange(0, 1, 1e-3)
    reading = np.ascontiguousarray(np.column_stack([5e-3 * t] * 3))
    out = np.empty_like(reading)
    play(np.array([0, len(t)]), reading, leads(t, reading)[[500]], WIDTH, out)
    np.testing.assert_allclose(out, reading - WIDTH / 2, atol=1e-8)


def test_what_a_play_leaves_open_counts_less(bench):
    search = search_on(bench, lambda t, x, f: (followed(x), f))
    forward, fit = search.forward, search.judge([]).found
    own = settings_of(forward, [effect("backlash")], np.array([fit.values[0], -WIDTH]), fit.onset)
    with_play = Whitener(forward, own, NuisanceOptions(leaning=0.0))
    without = Whitener(forward, settings_of(forward, [], fit.values, fit.onset), NuisanceOptions(leaning=0.0))
    still = forward.unsure.mean(axis=1) > 0.4
    assert (with_play.louder >= without.louder * 0.9).all()
    assert with_play.louder[still].mean() > 1.5 * without.louder[still].mean()
    assert (with_play.volume > without.volume).all()
