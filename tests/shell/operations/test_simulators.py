"""Another simulator that is run along a recorded path: its settings, and what mends them."""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import palpate as pp
from palpate.mechanics.errors import OptionError, PalpateWarning, RecordingError
from palpate.mechanics.progress import silent
from palpate.operations import diagnose
from palpate.operations._simulators import Ran, mended_by, run_along, time_words
from palpate.reconstruction.presses_on_model import presses_on
from palpate.render.options import RenderOptions

from ...render import shapes
from .conftest import PLACES_M


def test_what_mends_goes_on_top_of_what_was_asked():
    assert mended_by("documented", "timestep_s=0.002", "best") == ("best", "timestep_s=0.002")
    assert mended_by("documented", "a=1,b=2", "b=3, best") == ("best", "a=1,b=3")
    assert mended_by("best", "", "solref_s=0.004") == ("best", "solref_s=0.004")
    with pytest.raises(OptionError, match="--mended 'better' must be KEY=VALUE"):
        mended_by("best", "", "better")


@pytest.mark.parametrize("name", ["tune", "diagnose", "compare"])
def test_a_simulator_that_is_not_installed_is_said_before_a_model_is_made(monkeypatch, name):
    """It was said after a minute of reconstruction."""
    monkeypatch.setitem(sys.modules, "skfem", None)
    begun: list[str] = []
    with pytest.raises(OptionError, match="needs skfem, which is not installed: pip install"):
        getattr(pp, name)(
            "silicone-1-cylinder", renderer="scikit-fem", progress=lambda step, _: begun.append(step)
        )
    assert not begun


def test_a_modulus_in_kpa_is_doubted_before_the_forces_are_taken_for_mn(tmp_path):
    """--modulus 20 was warned of, --stated young_modulus_pa=20 turned a simulator's newtons into mN."""
    given = {"simulated": tmp_path / "none.csv", "stated": {"young_modulus_pa": 20}, "progress": False}
    with (
        pytest.warns(PalpateWarning, match="Then --stated young_modulus_pa=20000"),
        pytest.raises(RecordingError),
    ):
        pp.diagnose("silicone-1-cylinder", **given)


def test_a_long_run_says_how_long_and_what_fewer_presses_take():
    assert re.findall(r"\d+", time_words(1200.0, 12)) == ["20", "6", "10"]
    assert time_words(30.0, 12) == "about 0.5 min in all" and "--presses" not in time_words(1200.0, 6)


@dataclass(frozen=True)
class _Gap:
    """As much of a SimulatedGap as a run again is set beside."""

    gap_before_n: float
    effects: tuple[str, ...] = ()
    reality: Any = None
    mended: Any = None


def test_the_mended_run_presses_where_the_first_one_did(monkeypatch, recording):
    """The gap that is measured stands beside the one that was said only if both are of the same presses: what
    is cheap as documented and dear at its best is run over as many as the dear one, and what ended without an
    answer in one counts in neither."""
    asked = []

    def simulator(name, settings, numbers, model):
        adapter = SimpleNamespace(
            presses=12 if settings == "best" else None, cannot=(), stated={}, version="1"
        )
        adapter.advice, adapter.poisson_limit = {}, np.inf
        return SimpleNamespace(name=name, adapter=adapter, model=model, settings=settings)

    def run_along(made, recording, progress, *, most):
        asked.append((made.settings, most))
        chosen = np.array([True, made.settings != "best", True])
        return Ran(recording.force_on_tool, chosen, made.adapter, f"settings {made.settings}")

    def judged(recording, model, asked, options, progress, **rules):
        assert asked.forces.chosen.tolist() == [True, False, True]
        return _Gap(0.1 if "documented" in asked.run_as else 0.03, ("mesh_stiffness",))

    monkeypatch.setattr(diagnose, "simulator", simulator)
    monkeypatch.setattr(diagnose, "run_along", run_along)
    monkeypatch.setattr("palpate.diagnosis.other_simulator.pipeline.diagnose_simulated", judged)
    monkeypatch.setattr(
        "palpate.reconstruction.presses_on_model.presses_on", lambda recording, model: model.presses
    )
    block = shapes.model(shapes.block((0.06, 0.06, 0.03), (2, 2, 1)))
    found = pp.diagnose(recording, block, renderer="scikit-fem", mended="best", progress=False)
    assert asked == [("documented", 12), ("best", 12)]
    assert found.gap_before_n == 0.1 and found.mended.gap_n == 0.03
    assert found.mended.settings == "settings best" and found.mended.effects == ("mesh_stiffness",)
    asked.clear()
    pp.diagnose(recording, block, renderer="scikit-fem", mended="best", presses=7, progress=False)
    assert asked == [("documented", 7), ("best", 7)]


def test_a_press_without_an_answer_is_left_out_and_said(recording, folder, monkeypatch):
    """But for too few that are left: then it is the error that it was."""
    model = pp.load(folder)
    presses = presses_on(recording, model)

    class Falls:
        """No answer at the second place."""

        def start(self, radii_m=None, dt_s=1e-3):
            return None

        def follow(self, state, path, steps_s):
            near = np.linalg.norm(path[:, 0, :2] - PLACES_M[1], axis=1).min() < 1e-3
            if near and path[:, 0, 2].min() < 0.034:
                raise OptionError("no balance")
            return np.broadcast_to([0.0, 0.0, 1.0], path.shape)

    made: Any = Falls()
    made.name, made.model, made.adapter, made.options = "falls", model, None, RenderOptions()
    monkeypatch.setattr("palpate.render.replay.scene_of", lambda made: made)
    with pytest.raises(OptionError, match="no balance"):
        run_along(made, recording, silent, most=None)
    monkeypatch.setattr("palpate.operations._simulators.LEAST_PRESSES", 2)
    ran = run_along(made, recording, silent, most=None)
    assert ran.chosen.tolist() == [True, False, True] and len(presses) == 3
    second = presses.touching(recording.t) & presses.of(np.array([False, True, False])).touching(recording.t)
    assert not ran.force[second].any() and ran.force.any()
    assert ran.notes == (
        "settings documented: 1 of 3 presses ended without an answer and are left out: no balance",
    )


@pytest.mark.slow
def test_another_simulator_is_set_beside_the_models_over_every_press(folder, recording):
    """Linear tetrahedra of 15 mm under a tip of 5 are far off where our own law is not, on each press."""
    pytest.importorskip("skfem")
    found = pp.compare(recording, folder, renderer="scikit-fem", progress=False)
    assert found.rmse_n["fem"] < found.rmse_n["scikit-fem"] < 2 * found.constant_n
    errors = found.press_rmse_n["scikit-fem"]
    assert len(errors) == 3 and (errors > 10 * found.press_rmse_n["fem"]).all()
