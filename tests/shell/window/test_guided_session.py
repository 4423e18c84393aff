"""A person with only a mouse is guided: traces the base, presses at the ghost, until told to stop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import palpate as pp
from palpate.diagnosis.explore.goals import GoalOptions
from palpate.diagnosis.explore.segments import Instrument
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import read_recording
from palpate.reconstruction.pipeline import reconstruct
from palpate.scenes.scene import Scene
from palpate.window.guide import Guide
from palpate.window.session import TouchSession

from .driven import SIDES, along_the_foot, as_the_ghost_says, driving

MOST = 12


@pytest.mark.slow
def test_a_guided_person_knows_the_object_after_a_dozen_presses(block: Model, tmp_path: Path) -> None:
    def guided(session: TouchSession) -> Guide:
        instrument = Instrument(session.servo.tip_radius_m, session.servo.options.rate_hz, {})
        explorer = pp.Explorer(instrument, GoalOptions(modulus_within=0.1, most=MOST))
        return Guide(explorer, session.servo, block, session.worker, tmp_path / "guided.csv.gz")

    with driving(block, Scene("block", "model", "", title="Block"), guided=guided) as driven:
        guide, session = driven.window.guide, driven.session
        for side in (*SIDES, *SIDES):
            if "traced" in guide.lines()[0]:
                driven.look_from(np.arctan2(side[1], side[0]))
                along_the_foot(driven, side)
        driven.until(lambda frame: guide.suggestion.kind == "press" and not session.worker.busy)
        while guide.suggestion.kind == "press":
            as_the_ghost_says(driven, guide)
    assert guide.suggestion.kind == "stop" and guide.state.made <= MOST
    low, high = guide.state.modulus_ci95_pa
    assert low < block.material.young_modulus_pa < high
    model = reconstruct(read_recording(tmp_path / "guided.csv.gz"))
    assert model.material.young_modulus_pa == pytest.approx(block.material.young_modulus_pa, rel=0.1)
    result = guide.explorer.explored(str(tmp_path / "guided.csv.gz"))
    page = result.report(tmp_path / "page.html").read_text()
    assert "What to do next: make a model of it" in page and '<section class="view3d"' in page
    # the presses' reasons stand in it, and the last step knows what the state says
    assert all(step.asked is not None and step.asked.why.split("'")[0] in page for step in result.steps[-3:])
