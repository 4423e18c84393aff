"""The conformance table: the path of a press, and our own renderer against closed forms."""

import argparse
import json

import numpy as np
import pytest

from benchmarks import simulators
from benchmarks.simulators import CASES


def test_a_press_rests_at_each_depth_and_goes_sideways():
    case = CASES["sliding"]()
    t, centre, rests = case.path()
    radius = case.model.tool.tip_radius_m
    below = case.top[2] + radius - centre[rests, 2]
    assert below == pytest.approx([5e-4, 1e-3, 1e-3]) and centre[rests, 0] == pytest.approx([0, 0, 1e-4])
    assert np.linalg.norm(np.diff(centre, axis=0), axis=1).max() < 1e-4 and np.diff(t).min() > 0
    assert len(case.truth_n) == 2 and case.aside_n > 0


def run(tmp_path, *words):
    parser = argparse.ArgumentParser()
    simulators.add_arguments(parser)
    return simulators.run(parser.parse_args([*words, "--work", str(tmp_path / "rows")]))


@pytest.mark.release
def test_runs_at_several_times_make_one_table(tmp_path, monkeypatch):
    """Each press is run once; a later run of other simulators shows the earlier ones too."""
    pytest.importorskip("skfem")
    run(tmp_path, "--cases", "slab", "--only", "scikit-fem", "--settings", "documented")
    monkeypatch.setattr(simulators, "create", None)  # nothing is made anew
    found = run(tmp_path, "--cases", "slab", "--only", "scikit-fem", "--settings", "documented")
    assert [(r["simulator"], r["settings"]) for r in found["rows"]] == [
        ("palpate", ""), ("scikit-fem", "documented"),
    ]  # fmt: skip
    assert any(f.what == "slab, scikit-fem, documented: 1 mm over truth" for f in found["figures"])
    assert next(f for f in found["figures"] if f.what == "all cases that were run, scikit-fem").met


def test_a_run_without_a_force_stands_in_the_figures(tmp_path):
    row = {"case": "slab", "simulator": "drake", "settings": "best", "failed": "an element is degenerate"}
    (tmp_path / "rows").mkdir()
    (tmp_path / "rows" / "slab_drake_best.json").write_text(json.dumps(row))
    found = run(tmp_path, "--kept")
    assert [f.what for f in found["figures"]] == ["slab, drake, best: ended without a force"]


@pytest.mark.slow
def test_our_own_renderer_is_near_hertz_and_mindlin(tmp_path):
    found = run(tmp_path, "--cases", "sliding", "--only", "scikit-fem", "--settings", "documented")
    own = next(r for r in found["rows"] if r["simulator"] == "palpate")
    assert own["over"] == pytest.approx([1, 1, 1], abs=0.08)
