"""The blind benchmark's cases, the tasks they become, and what counts as an answer."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from benchmarks._diagnosis_blind import tasks_of, unfinished
from benchmarks._diagnosis_cases import ALIKE, FINITE, HIDDEN, SEEDS, WEIGHT, Case, cases
from benchmarks._diagnosis_scores import answer_of, discovered, summarise
from palpate.mechanics.errors import OptionError

KNOWN = {"quick": 8, "medium": 250, "full": 640}


@pytest.mark.parametrize("size", KNOWN)
def test_every_case_is_another_and_the_same_next_time(size: str) -> None:
    found = cases(size, None, 40000)
    assert len(found) == len({case.key for case in found}) == KNOWN[size]
    assert found == cases(size, None, 40000)
    assert len({case.seed for case in found}) == len(found)


def test_no_case_to_develop_on_is_one_to_judge_by() -> None:
    seeds = [{case.seed for case in cases("full", None, first)} for first in SEEDS.values()]
    assert len(set.union(*seeds)) == sum(map(len, seeds))
    assert all(max(a) < min(b) for a, b in zip(seeds, seeds[1:], strict=False))


def test_nuisances_vary_from_case_to_case_and_are_no_second_tool_weight() -> None:
    found = cases("medium", None, 40000)
    drawn = [case.nuisances for case in found]
    assert len({d.rate_hz for d in drawn}) == 4 and len({d.orientation for d in drawn}) == 3
    assert max(d.tool_mass_kg for d in drawn) > 0.09
    for case, d in zip(found, drawn, strict=True):
        asked = any(name in WEIGHT for name in case.tested)
        assert d.number == case.number
        assert not (asked and d.tool_mass_kg) and (FINITE in case.beside) == (FINITE in case.effects)


def test_a_family_that_no_object_has_is_refused() -> None:
    assert {case.family for case in cases("medium", ["dome"], 0)} == {"dome"}
    with pytest.raises(OptionError, match="cylinder"):
        cases("medium", ["torus"], 0)


def test_touches_of_an_object_are_solved_once_for_all_its_cases(tmp_path: Path) -> None:
    linear = [Case("control", 0, seed) for seed in (1, 2)]
    finite = Case("single", 0, 3, ("time_delay",), {FINITE: 1.0, "time_delay": 1.0})
    tasks = [t for case in (*linear, finite) for t in tasks_of(case, tmp_path, solve=True, fast=False)]
    stages = Counter(task.stage for task in {task.name: task for task in tasks}.values())
    assert stages == {"solve": 2, "prepare": 3, "judge": 3}
    assert [len(t.needs) for t in tasks if t.stage == "prepare"] == [1, 1, 2]
    assert all(unfinished(task) for task in tasks)


def test_what_a_drawn_tool_weighs_is_no_false_alarm_and_another_name_is() -> None:
    seed = next(s for s in range(20) if Case("control", 0, s).nuisances.tool_mass_kg > 0)
    case = Case("control", 0, seed).as_json()
    for name, alarm in (("tool_gravity_inertia", False), ("force_bias", False), ("backlash", True)):
        verdict = {"kind": "effect", "effects": [name], "candidates": []}
        assert answer_of({"case": case, "verdict": verdict}).detected == alarm


def test_a_size_counts_against_what_can_be_seen() -> None:
    case = Case("single", 0, 1, ("time_delay",), {"time_delay": 1.0}).as_json()
    verdict = {"kind": "none", "effects": [], "candidates": [], "probability": {}}
    truth = {"noise_rms_n": 0.01, "sizes": {"time_delay": {"rms_after_best_scale_n": 0.1}}}
    for limit, counted in ((0.02, 1), (0.06, 0)):
        seen = {**verdict, "detectable_n": {"time_delay": limit}}
        summary = summarise([{"key": "one", "case": case, "verdict": seen, "truth": truth}])
        (told,) = summary["seen_from"]
        assert told["median"] == pytest.approx(limit / 0.1)
        rates = summary["rates"]
        assert rates["detected, effect at least twice the noise"]["of"] == 1
        name = "first place, effect at least 4 times what can be seen"
        assert rates.get(name, {"of": 0})["of"] == counted


def test_a_control_without_an_answer_is_a_miss_and_no_evidence_of_silence() -> None:
    case = Case("control", 0, 1).as_json()
    verdict = {"kind": "failed", "effects": [], "candidates": []}
    summary = summarise([{"key": "one", "case": case, "verdict": verdict, "truth": {}}])
    assert "false alarms (controls)" not in summary["rates"] and len(summary["misses"]) == 1
    assert summary["rates"]["no answer: the reconstruction or the diagnosis refused"]["hits"] == 1


def test_a_search_with_controlled_false_discovery_names_what_chance_would_not():
    """The second baseline: by gains in log likelihood and numbers of parameters, the most evident first."""
    scores = {
        "time_delay": [300.0, 0.9],
        "backlash": [12.0, 0.1],
        "adhesion": [0.4, 0.0],
        "inclusion": [3.0, 0],
    }
    assert discovered({"scores": scores}) == ["time_delay", "backlash"]
    assert discovered({"scores": {"time_delay": [0.5, 0.9], "inclusion": [2.0, 0.1]}}) == []
    # a lump has five numbers to fit by: what would tell one cause tells no lump
    assert discovered({"scores": {"inclusion": [4.0, 0.5]}}) == []
    assert discovered({"scores": {"time_delay": [4.0, 0.5]}}) == ["time_delay"]
    assert discovered({}) == []


def test_cases_of_the_protocols_differ_in_how_they_are_explored_alone():
    """The same draw, effect and object, both ways, in an order of their own."""
    found = cases("protocol", None, 500)
    pairs = {}
    for case in found:
        pairs.setdefault(case.seed, []).append(case)
    assert all(sorted(c.protocol for c in pair) == ["complete", "ordinary"] for pair in pairs.values())
    assert all(a.nuisances == b.nuisances and a.effects == b.effects for a, b in pairs.values())
    assert len({c.key for c in found}) == len(found) == 72
    assert {c.tested[0] for c in found if c.tested} == {*HIDDEN, *ALIKE}
