"""Which two explanations the next touch separates: what is left open, and nothing that was ruled out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from palpate.diagnosis.verdict.next_touch import contenders
from palpate.diagnosis.verdict.result import NOTHING, parted


def scores(**gains: float) -> dict[str, Any]:
    """{name: score} of a step."""
    return {n: SimpleNamespace(name=n, gain=gain, candidate=f"{n} fitted") for n, gain in gains.items()}


def found(*steps: dict[str, Any], picked: tuple[str, ...] = ()) -> Any:
    """What a search came to."""
    return SimpleNamespace(steps=steps, picked=picked, scores=steps[0], final="all that was taken")


FIRST = scores(adhesion=30.0, inclusion=20.0, backlash=10.0, skin_layer=5.0)
LATER = scores(adhesion=3.0, inclusion=9.0, skin_layer=1.0)


@pytest.mark.parametrize(
    ("steps", "picked", "names", "candidates", "asked"),
    [
        # two candidates, neither of which gains most: adhesion was ruled out, and stood in one's place
        ((FIRST,), (), (), ("inclusion", "backlash"), {"inclusion", "backlash"}),
        ((FIRST,), (), (), ("inclusion",), {"inclusion", NOTHING}),
        ((FIRST, LATER), ("backlash",), ("backlash",), ("adhesion",), {"backlash", "adhesion"}),
        # what the first step took was dropped again
        ((FIRST, LATER), ("backlash",), (), ("skin_layer", "inclusion"), {"skin_layer", "inclusion"}),
        # what no press was predicted of (the shape) is nothing to press for: the named one and its nearest
        ((FIRST,), ("adhesion",), ("adhesion",), ("surface_shape",), {"adhesion", "inclusion"}),
        ((FIRST,), (), (), (), {"adhesion", "inclusion"}),
    ],
)
def test_the_next_touch_separates_what_is_left_open(steps, picked, names, candidates, asked):
    pair = contenders(found(*steps, picked=picked), names, candidates)
    assert {name for name, _ in pair} == asked
    for name, fitted in pair:
        assert fitted == ("all that was taken" if name == NOTHING else f"{name} fitted")


def test_a_lone_candidate_is_told_from_nothing():
    assert parted(("skin_layer", NOTHING)) == "skin layer from nothing"


def test_one_effect_that_was_tried_alone_has_no_rival():
    assert contenders(found(scores(adhesion=1.0)), (), ()) is None
