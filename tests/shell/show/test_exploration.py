"""What an exploration came to: its lines, its figures, its page, from the first touch on."""

from __future__ import annotations

import json

import numpy as np

import palpate as pp
from palpate.diagnosis.explore.segments import Instrument, Segment


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
