"""Causes after every press: error rates that hold however often one looks (simulated); what parts them."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import logsumexp

from palpate.diagnosis.explore.causes import NONE, SIZES, Causes, _mean_over, judge
from palpate.diagnosis.explore.state import cause_goal
from palpate.diagnosis.explore.weighing import Weighing

CAUSES, FORMS, OWN, READINGS, LOOKS = 6, 2, 3, 30, 20


def _columns(rng):
    """(look, readings, columns): modulus, own errors, forms of six causes, of every press."""
    base = rng.normal(size=(READINGS, 1 + OWN + CAUSES * FORMS))
    return base + 0.5 * rng.normal(size=(LOOKS, *base.shape))


def _explored(rng, columns, cause=None, size=0.0):
    """Causes after each press of one exploration; the true size is in standard deviations of a reading."""
    modulus, own = 50 * rng.normal(), rng.normal(size=OWN)
    gram = np.zeros((columns.shape[2] + 1,) * 2)
    names = tuple(f"cause {k // FORMS}" for k in range(CAUSES * FORMS))
    forward = SimpleNamespace(touches=SimpleNamespace(noise=SimpleNamespace(variance_inflation=1.0)))
    told = []
    for x in columns:
        y = modulus * x[:, 0] + x[:, 1 : 1 + OWN] @ own + rng.normal(size=READINGS)
        if cause is not None:
            y = y + size * x[:, 1 + OWN + cause]
        both = np.column_stack([y, x])
        gram += both.T @ both
        weighing = Weighing(
            forward, None, None, (), names, np.ones(len(names)), gram, OWN, float(READINGS) * (len(told) + 1),
            np.ones(1), np.zeros(len(names)), None,
        )  # fmt: skip
        told.append(judge(weighing, 0.05))
    return told


def test_none_is_ruled_out_in_no_more_than_two_of_a_hundred_explorations_with_a_look_after_every_press():
    rng = np.random.default_rng(1)
    columns = _columns(rng)
    explorations = 100
    false = sum(
        any(NONE not in c.not_ruled_out(0.95) for c in _explored(rng, columns)) for _ in range(explorations)
    )
    assert false <= 2


def test_the_true_cause_stays_and_stands_alone_in_the_end():
    rng = np.random.default_rng(2)
    columns = _columns(rng)
    alone, lost = 0, 0
    for k in range(12):
        told = _explored(rng, columns, cause=(k % CAUSES) * FORMS, size=0.5)
        name = f"cause {k % CAUSES}"
        lost += any(name not in c.not_ruled_out(0.95) for c in told)
        alone += told[-1].not_ruled_out(0.95) == [name]
    assert lost <= 1 and alone >= 11


def test_what_is_ruled_out_follows_from_ratios_to_the_mean_of_all():
    causes = Causes({NONE: 0.0, "time_delay": 3.0, "backlash": -9.0}, 0.01, 1.0)
    ratio = causes.ratio
    mean = 0.5 + 0.25 * np.exp(3.0) + 0.25 * np.exp(-9.0)
    assert ratio["time_delay"] == pytest.approx(np.exp(3.0) / mean)
    assert sum(causes.probability.values()) == pytest.approx(1.0)
    assert causes.not_ruled_out(0.95) == ["time_delay", NONE]
    assert causes.missing("backlash", 0.95) == 0.0 and causes.missing(NONE, 0.95) > 1.0
    goal = cause_goal(causes, 0.95)
    assert not goal.met and goal.missing == pytest.approx(causes.missing(NONE, 0.95))


def test_sizes_that_are_weighed_span_what_can_be_felt():
    assert SIZES[0] == 1.0 and SIZES[-1] >= 100


def test_the_evidence_of_a_size_is_the_mean_over_it_however_plainly_readings_tell():
    edges = np.array([[0.3, 0.5, 2.0, 7.0]])
    for target, curve in ((0.0, 0.0), (1e-9, 1e-12), (3.0, 2.0), (-40.0, 30.0), (900.0, 700.0), (60.0, 1e-3)):
        told = _mean_over(edges, np.array([[target]]), np.array([[curve]]))[0]
        for low, high, found in zip(edges[0, :-1], edges[0, 1:], told, strict=True):
            x = low + (high - low) * (np.arange(100_000) + 0.5) / 100_000
            mean = logsumexp(target * x - 0.5 * curve * x**2) - np.log(len(x))
            assert found == pytest.approx(mean, abs=1e-3), (target, curve, low)


def test_what_explains_as_much_is_as_likely_whatever_its_size_beside_the_grid():
    """A form in several units: its size lies anywhere between two points of the grid."""
    told = []
    for unit in np.geomspace(1.0, SIZES[1], 5):
        gram = np.diag([4e6 + 100.0, 1e3, 1e5 * unit**2])
        gram[0, 2] = gram[2, 0] = 2.0 * 1e5 * unit
        forward = SimpleNamespace(touches=SimpleNamespace(noise=SimpleNamespace(variance_inflation=1.0)))
        weighing = Weighing(
            forward, None, None, (), ("cause",), np.ones(1), gram, 0, 1e4, np.ones(1), np.zeros(1), None
        )
        told.append(judge(weighing, 0.05).log_evidence["cause"])
    assert np.ptp(told) < 2.0, told
