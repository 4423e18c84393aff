"""How a registered shape stands, where its touches leave that open."""

from __future__ import annotations

from palpate.diagnosis.options import AttributionOptions, DiagnoseOptions
from palpate.diagnosis.pipeline import measure
from palpate.diagnosis.search.site_stiffness import stands_open
from palpate.mechanics.progress import Clock, silent


def test_a_base_is_not_judged_of_a_shape_whose_pose_is_open(bench):
    """A dome 7 degrees from how it stood had a loose base, 90 % sure."""
    recording, model = bench.record(law="linear")
    for open_m, untried in ((0.0, False), (0.02, True)):
        posed = model.replaced(about={"geometry": {"kind": "shape", "surface_sd_p95_m": open_m}})
        found = measure(recording, posed, DiagnoseOptions(), AttributionOptions(), silent, Clock())
        assert ({"unbonded_base", "compliant_base"} <= set(found.untried)) is untried
        assert ("open by 20 mm" in stands_open(posed)) is untried
