"""F1 of where the gap is: right bins count, claims everywhere do not, files without bins are passed over."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks._diagnosis_cases import Case
from benchmarks._diagnosis_scores import summarise
from benchmarks._diagnosis_where import KINDS, localisation, located

CLOCK_S = 7.0


def _item(true: list[float], stated: list[float], **bins: list[float]) -> dict[str, Any]:
    """Four touches, a second each, at three places: the last one again where the first was."""
    others = {key: [0.1, 0.0, 0.0] for key in KINDS.values() if key}
    start = 10.0 + 3.0 * np.arange(4)
    spans = np.column_stack([start, start + 1.0]).tolist()
    truth = {
        "noise_rms_n": 0.01,
        "nuisances": {"clock_s": CLOCK_S},
        "sizes": {"inclusion": {"rms_after_best_scale_n": 0.1}},
        "where": {"press_s": spans, "press_n": true, **others},
    }
    said = {"press_s": (start + CLOCK_S + 0.02).tolist(), "site": [0, 1, 2, 0], "press_n": stated}
    verdict = {
        "kind": "effect",
        "effects": ["inclusion"],
        "candidates": [],
        "parameters": {},
        "detectable_n": {"inclusion": 0.02},
        "where": {"bins": {**said, **others, **bins}},
    }
    case = Case("single", 0, 1, ("inclusion",), {"inclusion": 1.0}).as_json()
    return {"key": "one", "case": case, "verdict": verdict, "truth": truth}


def _scores(*items: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return localisation([bins for bins in map(located, items) if bins is not None])


def test_a_gap_in_one_place_that_is_found_there_is_all_right() -> None:
    found = _scores(_item([0.0, 0.1, 0.0, 0.0], [0.0, 0.08, 0.004, 0.0]))["places"]["there"]
    assert (found["right"], found["said"], found["true"], found["bins"]) == (1, 1, 1, 3)
    assert found["f1"] == 1.0 and found["f1_of_every_bin"] == 0.5


def test_claiming_every_place_is_worth_what_the_baseline_is() -> None:
    found = _scores(_item([0.0, 0.1, 0.0, 0.0], [0.1, 0.1, 0.1, 0.1]))["places"]["there"]
    assert found["f1"] == found["f1_of_every_bin"] == 0.5


def test_the_neighbouring_place_is_the_wrong_one_whatever_the_clock_says() -> None:
    assert _scores(_item([0.0, 0.1, 0.0, 0.0], [0.0, 0.0, 0.1, 0.0]))["places"]["there"]["f1"] == 0.0


def test_presses_of_one_place_are_one_bin() -> None:
    found = _scores(_item([0.0, 0.0, 0.0, 0.1], [0.1, 0.0, 0.0, 0.0]))["places"]["there"]
    assert found["f1"] == 1.0


def test_most_of_the_gap_is_told_from_a_little_of_it() -> None:
    item = _item([0.02, 0.3, 0.02, 0.02], [0.2, 0.3, 0.2, 0.2])
    found = _scores(item)["places"]
    assert found["there"]["f1"] == 1.0 and found["there"]["f1_of_every_bin"] == 1.0
    assert found["most"]["f1"] == 0.5


def test_saying_nothing_finds_nothing() -> None:
    nothing = {key: [0.0, 0.0, 0.0] for key in KINDS.values() if key}
    found = _scores(_item([0.0, 0.1, 0.0, 0.0], [0.0] * 4, **nothing))
    assert [found[kind]["there"]["f1"] for kind in KINDS] == [0.0] * 4


@pytest.mark.parametrize("older", ["truth", "verdict"])
def test_files_from_before_bins_were_written_count_elsewhere_alone(older: str) -> None:
    new, old = (_item([0.0, 0.1, 0.0, 0.0], [0.0, 0.1, 0.0, 0.0]) for _ in range(2))
    del old[older]["where"]
    summary = summarise([new, old])
    assert summary["localisation"]["places"]["there"]["cases"] == 1
    assert summary["rates"]["first place, all sizes"]["of"] == 2


def test_an_effect_below_what_can_be_seen_is_not_asked_for_its_place() -> None:
    item = _item([0.0, 0.1, 0.0, 0.0], [0.0] * 4)
    item["verdict"]["detectable_n"]["inclusion"] = 0.06
    assert summarise([item])["localisation"]["places"] == {}
