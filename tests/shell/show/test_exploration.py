"""What an exploration came to: its lines, its figures, its page, from the first touch on."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np

import palpate as pp
from palpate.diagnosis.explore.goals import GoalState
from palpate.diagnosis.explore.segments import Instrument, Segment
from palpate.diagnosis.explore.state import ExplorationState
from palpate.diagnosis.explore.suggestion import Step, Suggestion


def test_an_exploration_of_one_sweep_says_what_is_missing_and_how_to_go_on(tmp_path):
    explorer = pp.Explorer(Instrument(0.005, 1000.0, {"object_name": "thing"}))
    asked = explorer.suggest()
    t = np.arange(600) / 1000
    way = np.column_stack([0.03 * np.cos(6 * t), 0.03 * np.sin(6 * t), np.full(600, 0.005)])
    explorer.add(Segment("press", t, way, np.zeros((600, 3))))
    explorer.suggest()
    result = explorer.explored(str(tmp_path / "thing.csv.gz"))
    assert [s.asked for s in result.steps] == [asked]
    assert "unknown" in result.lines()[0] and "not ended" in result.lines()[1]
    figures = json.loads(json.dumps(result.as_json()))
    assert figures["steps"][0]["suggest"]["kind"] == "trace" and figures["young_modulus_pa"] is None
    page = result.report(tmp_path / "page").read_text()
    assert (
        "--continue" in page
        and "not yet" in page
        and "outline is not known: slide once around" in page
        and '<section class="view3d"' not in page
    )
    assert "The exploration has not ended, next:" in page
    assert "palpate reconstruct" not in page, "of too few presses no model can be made"


def test_a_page_says_once_what_was_asked_and_how_to_go_on_where_it_was_not_reached(tmp_path):
    """Headline, two sentences and a table said one thing; what ended too early led to a model alone."""
    explorer = pp.Explorer(Instrument(0.005, 1000.0, {"object_name": "thing"}))
    asked = explorer.suggest()
    state = ExplorationState(
        5, 5, 28.0, 12e3, (11.3e3, 12.7e3), float("nan"), "", (GoalState("modulus", 0.059, 0.05),)
    )
    last = Suggestion("stop", f"5 presses were made, as many as allowed; {state.words}")
    result = explorer.explored(str(tmp_path / "thing.csv.gz"))
    result = replace(result, state=state, last=last, steps=(Step(asked, state),))
    page = result.report(tmp_path / "page.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    shown = re.sub(r"<script.*?</script>", "", page.partition("</h1>")[2], flags=re.DOTALL)
    assert "asked" not in shown.lower() and shown.count("12.0 kPa within 5.9 %") == 2  # and its step's row
    assert "as many as allowed." in shown and "--most 10" in shown
    assert "asked: modulus within 5 %" in result.lines()[0]
    assert "1 press in 28 s" in replace(result, state=replace(state, made=1)).lines()[0]
    met = replace(state, goals=(GoalState("modulus", 0.03, 0.05),))
    assert "--continue" not in replace(result, state=met).report(tmp_path / "p.html").read_text("utf-8")
