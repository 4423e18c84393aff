"""A model that a 1D model beats on places held out says so first; a field that cures it is fitted."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.model.one_d_laws import RIVALS
from palpate.reconstruction.geometry.stated import GeometryOptions
from palpate.reconstruction.methods import ReconstructOptions
from palpate.reconstruction.pipeline import reconstruct_fully
from palpate.reconstruction.steps.s7_modulus.held_out import HeldOutErrors, held_out, modulus_by_others
from palpate.reconstruction.steps.s7_modulus.modulus_field import FieldOptions
from palpate.show import next_lines, story_of
from palpate.show.story import Headline

from .flat_contact import points

GROUND = GeometryOptions(half_space=True)
WHERE_BEATEN = ReconstructOptions(geometry=GROUND, modulus_field=FieldOptions(field="where-beaten"))


def firmer_along_x(ratio: float):
    """Points whose modulus at one end of the raster is so many times that at the other."""
    recording = points((6, 5), rows=8)
    share = recording.position[:, 0] / np.ptp(recording.position[:, 0])
    force = recording.force_on_tool * (ratio**share)[:, None]
    return dataclasses.replace(recording, force_on_tool=force)


@pytest.fixture(scope="module")
def varied(factorised_once):
    return reconstruct_fully(firmer_along_x(3.0), WHERE_BEATEN)


def of_one_modulus(made) -> HeldOutErrors:
    told = held_out(made.model.presses, made.sites, made.modulus, modulus_by_others(made.modulus))
    assert told is not None
    return told


@pytest.mark.slow
def test_one_modulus_loses_where_it_differs_from_place_to_place(varied):
    told = of_one_modulus(varied)
    assert told.beaten_by in RIVALS and told.floor_n < 0.5 * told.model_n
    assert told.beaten_by in told.doubt


@pytest.mark.slow
def test_the_first_line_says_who_predicts_better(varied):
    lost = dataclasses.replace(varied, held_out=of_one_modulus(varied))
    first, held = lost.lines()[0], lost.as_json()
    assert first.startswith("not reliable") and held["beaten_by"] in first and not lost.predicts
    headlines = [b.text for b in story_of(lost) if isinstance(b, Headline) and b.on != "text"]
    assert headlines and all(len(text.split()) <= 20 and "--" not in text for text in headlines)
    assert held["held_out_floor_rmse_n"] < held["held_out_rmse_n"]
    assert not any("--field auto" in step for step in next_lines(lost)), "it was asked for here"


@pytest.mark.slow
def test_a_field_is_fitted_where_one_modulus_is_beaten(varied):
    assert varied.model.material.field is not None
    assert varied.held_out.beaten_by == "" and varied.held_out.model_n < 0.5 * of_one_modulus(varied).model_n
    assert "1D" not in varied.lines()[0] and varied.as_json()["beaten_by"] is None


@pytest.mark.slow
def test_the_answer_says_that_the_modulus_differs_from_place_to_place(varied):
    assert "the modulus differs from place to place" in "\n".join(varied.lines())


@pytest.mark.slow
def test_a_field_that_predicts_no_better_is_not_kept(varied, factorised_once, monkeypatch):
    """By the field the places that were held out would be missed as a modulus ten times too high does."""
    wrong = 10 * modulus_by_others(varied.modulus)
    monkeypatch.setattr("palpate.reconstruction.pipeline.with_fitted_field", lambda *_: (varied.model, wrong))
    made = reconstruct_fully(firmer_along_x(3.0), WHERE_BEATEN)
    assert made.model.material.field is None and made.held_out.beaten_by


@pytest.mark.slow
def test_an_even_ground_stays_of_one_modulus(factorised_once):
    made = reconstruct_fully(points((6, 5), rows=8), WHERE_BEATEN)
    assert made.held_out.beaten_by == "" and made.held_out.floor in RIVALS
    assert "modulus field" not in made.seconds
    assert "1D" not in made.lines()[0]
