"""No verdict names what makes the held-out gap larger."""

from types import SimpleNamespace

import numpy as np
import pytest

from palpate.diagnosis.verdict.answer import Answer
from palpate.diagnosis.verdict.held_out import Gaps, never_worse, without_what_makes_it_worse

COUNTS = np.full(20, 100.0)
BEFORE = np.random.default_rng(0).uniform(8.0, 12.0, 20)
NOISE = 0.02


def said(names: tuple[str, ...], candidates: tuple[str, ...], remainder: bool) -> str:
    return Answer([*names], [*candidates], remainder=remainder).kind


def kept(factors: dict[tuple[str, ...], float], names: tuple[str, ...], **options):
    """The outcome where naming a set multiplies the gap's squares by its factor, with a scatter of sites."""
    scatter = np.random.default_rng(1).uniform(0.8, 1.2, 20)
    asked = []

    def after(some: tuple[str, ...]) -> np.ndarray:
        asked.append(some)
        return BEFORE * (1 + (factors[some] - 1) * scatter)

    return never_worse(names, BEFORE, after, COUNTS, NOISE, **options), asked


def test_an_answer_that_helps_stands_and_is_asked_for_once() -> None:
    result, asked = kept({("drift", "slip"): 0.5}, ("drift", "slip"))
    assert result.names == ("drift", "slip") and not result.dropped and not result.unexplained
    assert asked == [("drift", "slip")]


def test_the_weakest_go_until_the_gap_does_not_grow() -> None:
    factors = {("a", "b", "c"): 4.0, ("a", "b"): 1.5, ("a",): 0.6}
    result, _ = kept(factors, ("a", "b", "c"))
    assert result.names == ("a",) and result.dropped == ("c", "b")
    assert result.after.sum() < BEFORE.sum()
    assert result.unexplained  # 0.6 of 0.1 N^2 a sample is left where 0.02 is explained
    assert said(result.names, (), result.unexplained) == "effect+unknown"


def test_where_all_make_it_worse_nothing_is_named_and_the_gap_stays_unknown() -> None:
    factors = {("bias", "drift"): 3.5, ("bias",): 2.0}
    result, _ = kept(factors, ("bias", "drift"))
    assert result.names == () and result.dropped == ("drift", "bias")
    assert np.array_equal(result.after, BEFORE)
    assert said(result.names, ("slip",), result.unexplained) == "unknown"


def test_nothing_is_unknown_where_noise_explains_what_is_left() -> None:
    result = never_worse(("a",), BEFORE, lambda names: 2 * BEFORE, COUNTS, 0.2)
    assert result.names == () and not result.unexplained
    assert said(result.names, (), result.unexplained) == "none"


def test_growth_within_chance_counts_only_where_it_is_asked_to() -> None:
    change = np.concatenate([[5.0], np.full(19, -0.2)])  # one site speaks against, all others for
    options = {"before": BEFORE, "after": lambda names: BEFORE + change, "counts": COUNTS, "explained": NOISE}
    assert never_worse(("inclusion",), **options).names == ("inclusion",)
    assert never_worse(("inclusion",), **options, beyond_chance=False).names == ()


@pytest.mark.parametrize("seed", range(20))
def test_whatever_the_sites_say_the_gap_of_what_is_kept_is_not_larger(seed: int) -> None:
    rng = np.random.default_rng(seed)
    names = ("a", "b", "c", "d")
    sums = {names[:k]: BEFORE * rng.lognormal(0.2, 0.5, 20) for k in range(1, 5)}
    result = never_worse(names, BEFORE, sums.__getitem__, COUNTS, NOISE, beyond_chance=False)
    assert result.after.sum() <= BEFORE.sum()
    assert result.names + result.dropped[::-1] == names


def test_the_words_are_the_contracts() -> None:
    assert said((), (), False) == "none"
    assert said(("a",), (), False) == "effect"
    assert said(("a",), ("b",), False) == "ambiguous"
    assert said(("a",), ("b",), True) == "effect+unknown"
    assert said((), ("b",), True) == "unknown"


@pytest.mark.parametrize(("explained", "kind", "candidates"), [(0.2, "none", []), (0.05, "unknown", ["a"])])
def test_where_nothing_is_left_to_explain_nothing_is_a_candidate(explained, kind, candidates):
    """0.1 N^2 a sample without the effect, 0.2 with it."""
    nothing = SimpleNamespace(found=SimpleNamespace(effects=(), names=()))
    evidence = SimpleNamespace(
        search=SimpleNamespace(whitener=SimpleNamespace(explained=explained)),
        instrument_offsets=SimpleNamespace(names=()),
        found=SimpleNamespace(final=nothing, base=nothing),
        forward=SimpleNamespace(touches=SimpleNamespace(thinned_away=0.0)),
        refit=False,
        seed=0,
    )
    answer = Answer(["a"], [])
    without_what_makes_it_worse(
        evidence, answer, Gaps(np.full(12, 1.0), np.full(12, 2.0), {}), np.full(12, 10)
    )
    assert (answer.kind, answer.names, answer.candidates) == (kind, [], candidates)
