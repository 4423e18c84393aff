"""How likely each set of causes is, from the log odds of a search's steps."""

import numpy as np
import pytest

from palpate.diagnosis.search.rivals import (
    Choice,
    Explanation,
    joint,
    likeliest,
    names_of,
    posterior,
    without,
)


def test_sets_of_one_and_two_causes_hold_the_whole_posterior():
    """A base at odds of 4 to 1, or a skin at 3 to 1; beside the base a delay at 9 to 1."""
    first = Choice({("base",): np.log(4), ("skin",): np.log(3)}, ("base",))
    second = Choice({("delay",): np.log(9)}, ("delay",))
    found = posterior([first, second], ("base", "delay"))
    each = {e.effects: e.probability for e in found}
    assert each == pytest.approx(
        {("base", "delay"): 4 / 8 * 0.9, ("skin",): 3 / 8, ("base",): 4 / 8 * 0.1, (): 1 / 8}
    )
    assert [e.effects for e in likeliest(found, 0.8)] == [("base", "delay"), ("skin",)]
    assert names_of(likeliest(found, 0.9)) == ("base", "delay", "skin")


def test_what_is_known_from_elsewhere_is_in_every_set():
    found = posterior([Choice({}, ("play",), certain=True), Choice({("base",): 0.0}, ())], ("play",))
    assert {e.effects: e.probability for e in found} == pytest.approx({("play",): 0.5, ("play", "base"): 0.5})


def test_a_set_that_was_put_back_to_another_counts_as_that_one():
    """Play and base were taken, and a delay does as well as both."""
    first = Choice({("play",): 3.0, ("delay",): 2.0}, ("play",))
    found = posterior([first, Choice({("base",): 3.0}, ("base",))], ("delay",))
    share = first.probabilities()
    both = share[("play",)] * np.exp(3.0) / (1 + np.exp(3.0))
    assert found[0].effects == ("delay",)
    assert found[0].probability == pytest.approx(share[("delay",)] + both)
    assert sum(e.probability for e in found) == pytest.approx(1.0)


def test_nothing_is_told_where_nothing_was_weighed():
    assert posterior([Choice({}, ())], ()) == (Explanation((), 1.0),)
    assert posterior([], ()) == (Explanation((), 1.0),)


def test_two_answers_that_do_not_depend_on_each_other_multiply():
    one = (Explanation(("nodes",), 0.8), Explanation((), 0.2))
    two = (Explanation(("skin",), 0.5), Explanation((), 0.5))
    each = {frozenset(e.effects): e.probability for e in joint(one, two)}
    assert each[frozenset({"nodes", "skin"})] == pytest.approx(0.4)
    assert without(one, {"nodes"}) == (Explanation((), 1.0),)
