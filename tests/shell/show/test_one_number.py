"""A page says one number for one quantity: the presses' errors are of the kind of its headline."""

from __future__ import annotations

import dataclasses
import re
from types import SimpleNamespace

import numpy as np
import pytest

import palpate as pp
from palpate.diagnosis.compare.comparison import Comparison
from palpate.render.replay import replay_error
from palpate.show import story as say
from palpate.show.comparison import meaning as meaning_of_models
from palpate.show.comparison.figures import draw
from palpate.show.demo import diagnosis_words, view
from palpate.show.page import new_figure
from palpate.show.reconstruction.story import _how, meaning
from palpate.show.reconstruction.story import view as view_of_made
from palpate.show.view3d import _alike

from ...reconstruct.flat_ground import raster


def test_the_demos_presses_and_its_headline_are_of_one_kind():
    """The table's errors were of low-passed forces: 18 mN below a headline of 28, with the noise in it."""
    recording, model = pp.read_recording("silicone-1-cylinder"), pp.load("demo")
    off = np.random.default_rng(0).normal(0.0, 0.02, recording.force_on_tool.shape)
    rendered = recording.force_on_tool + off
    whole = replay_error(recording, model.presses, rendered)
    found = SimpleNamespace(
        model=model, recording=recording, rendered_n=rendered, diagnosis=None, replay_rmse_n=whole.rmse_n
    )
    (error,) = (c for c in view(found).colourings if "force error" in c.title)
    samples = np.diff(model.presses.window(0.05, 0.05).starts)
    mean = np.sqrt((samples * error.presses**2).sum() / samples.sum())
    assert mean == pytest.approx(whole.rmse_n, rel=0.01)


@pytest.mark.slow
def test_what_one_modulus_leaves_is_the_presses_error_on_the_page():
    """9 mN were told, those of presses each with a modulus of its own, beside a press of 296 mN."""
    recording = raster()
    half = 1 + (recording.position[:, :1] > recording.position[:, 0].mean())
    twice = dataclasses.replace(recording, force_on_tool=recording.force_on_tool * half)
    made = pp.reconstruct(twice, half_space=True, progress=False)
    (error,) = (c for c in view_of_made(made).colourings if "force error" in c.title)
    assert error.title == "force error, first touches as recorded"
    said = float(re.search(r"off by ([\d.]+) mN", meaning(made))[1])
    assert said == pytest.approx(1e3 * np.sqrt((error.presses**2).mean()), rel=0.02)
    felt = np.linalg.norm(twice.force_on_tool, axis=1).max()
    assert said > 50 * felt


def test_a_column_of_presses_has_one_number_of_decimals():
    """'16' stood between '15.9' and '15.8'."""
    assert _alike(np.array([15.9, 16.0, np.nan, 8.25])) == ["15.9", "16.0", "–", "8.2"]
    assert _alike(np.array([364.4, 71.2])) == ["364", "71"] and _alike(np.zeros(1)) == ["0"]


def test_a_report_of_what_was_made_says_one_error():
    """Beside the model's 15 mN a table told 13.3 mN, left of a press with a modulus of its own."""
    fit = SimpleNamespace(
        reason="as they agree", between=0.01, shape_error=0.001,
        by_law={"neo-hookean": (15.9e3, 0.0133, 1.0), "linear": (15.4e3, 0.0179, 0.0)},
    )  # fmt: skip
    surface = SimpleNamespace(method="block", reason="as stated", volume_m3=1e-4, shape=True)
    made = SimpleNamespace(
        surface=surface, placed=None, modulus=fit, exploration=SimpleNamespace(noise_n=0.012),
        model=SimpleNamespace(provenance={"method": "finite-tip"}),
    )  # fmt: skip
    (table,) = (block for block in _how(made) if isinstance(block, say.Rows))
    assert not any("mN" in head for head in table.header)
    assert [len(row) for row in table.rows] == [len(table.header)] * 2


def test_the_demo_tells_one_error_of_the_model_that_is_felt():
    """28 mN of a replay stood beside 34 and 22 mN of held-out places, by another definition each."""
    found = SimpleNamespace(effects=("finite_strain",), candidates=(), gap_closed=0.94,
                            gap_before_n=0.034, gap_after_n=0.022, noise_n=0.021)  # fmt: skip
    made = SimpleNamespace(model=pp.load("demo"), diagnosis=found, recording=SimpleNamespace(path=None))
    words = diagnosis_words(made)
    assert " mN" not in words and "explains 94\u00a0% of" in words.replace("94 %", "94\u00a0%")


def test_what_models_err_by_is_told_by_one_definition():
    """The error along the normal, and its noise, stood beside those of the whole vector."""
    each = {"fem": 0.024, "kelvin-voigt": 0.209, "hunt-crossley": 0.184}
    along = {"fem": 0.016, "kelvin-voigt": 0.110, "hunt-crossley": 0.096}
    found = SimpleNamespace(
        rmse_n=each, normal_rmse_n=along, noise_n=0.021, presses=range(38), wins=lambda _: 38
    )
    words = meaning_of_models(found)
    assert re.findall(r"[\d.]+ mN", words) == ["24 mN", "184 mN", "21 mN"] and "6.0 times" in words


def test_every_press_of_a_chart_has_its_number_the_worst_first():
    """Of 38 every second had one, and the worst, which the page opens on, had none."""
    for count in (3, 38, 130):
        errors = np.random.default_rng(count).uniform(0.01, 0.1, count)
        each = dict.fromkeys(("fem", "kelvin-voigt", "hunt-crossley"), errors)
        found = SimpleNamespace(press_rmse_n=each, rmse_n=dict.fromkeys(each, 0.05), fields=(), noise_n=0.02)
        ax = new_figure(8, 3).subplots()
        draw(found, ax)
        told = [label.get_text() for label in ax.get_xticklabels()]
        assert str(np.argmax(errors) + 1) in told and len(told) == (count if count < 50 else -(-count // 3))


def test_the_error_along_the_normal_leaves_out_what_a_1d_model_cannot_have():
    up, push = np.array([0.0, 0.0, 1.0]), np.linspace(0.0, 1.0, 20)[:, None]
    presses = SimpleNamespace(normal=up[None], press=np.zeros(20, int), force=push * [0.5, 0.0, 1.0])
    spring, stiff = push * [0.0, 0.0, 1.0], push * [0.5, 0.0, 1.2]
    found = SimpleNamespace(presses=presses, predicted={"hunt-crossley": spring, "fem": stiff})
    along = Comparison.normal_rmse_n.fget(found)
    assert along["hunt-crossley"] == pytest.approx(0.0, abs=1e-12)
    assert along["fem"] == pytest.approx(0.2 * np.sqrt((push**2).mean()))
