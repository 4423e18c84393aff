"""How a registered shape stands, where its touches leave that open."""

from __future__ import annotations

from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions
from palpate.diagnosis.pipeline import diagnose, measure
from palpate.diagnosis.search.site_stiffness import stands_open
from palpate.mechanics.progress import Clock, silent
from palpate.show import next_lines


def test_a_base_is_not_judged_of_a_shape_whose_pose_is_open(bench):
    """A dome 7 degrees from how it stood had a loose base, 90 % sure."""
    recording, model = bench.record(law="linear")
    for open_m, untried in ((0.0, False), (0.02, True)):
        posed = model.replaced(about={"geometry": {"kind": "shape", "surface_sd_p95_m": open_m}})
        found = measure(recording, posed, DiagnoseOptions(), AttributionOptions(), silent, Clock())
        assert ({"unbonded_base", "compliant_base"} <= set(found.untried)) is untried
        assert ("open by 20 mm" in stands_open(posed)) is untried


def test_how_a_shape_stands_is_the_first_thing_to_find_out(bench):
    """A touch that parts friction from an inclusion was asked for, of a dome that lay 13 degrees off."""
    recording, model = bench.record(law="linear")
    posed = model.replaced(about={"geometry": {"kind": "shape", "surface_sd_p95_m": 0.02}})
    first, *_ = next_lines(diagnose(recording, posed, DiagnoseOptions(fast=True)))
    assert "how the shape stands" in first and "--pose given" in first
