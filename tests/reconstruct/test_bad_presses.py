"""One bad press never ends a recording: it is left out and said, and the rest tells the same as before."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.geometry.stated import GeometryOptions, nowhere
from palpate.reconstruction.pipeline import Reconstruction, ReconstructOptions, reconstruct_fully
from palpate.reconstruction.steps.s3_contacts.contacts import ContactOptions
from palpate.reconstruction.steps.s3_contacts.left_out import off_surface
from palpate.reconstruction.steps.s3_contacts.quasi_static import explore_points

from .flat_contact import points
from .flat_ground import MODULUS_PA, raster

ROWS, BAD = 6, 12
SLAB = ReconstructOptions(geometry=GeometryOptions(half_space=True))
PLACE = np.array([0.010, 0.010])


def spoilt(how: str) -> Recording:
    """Points, of which the place in the middle is bad."""
    recording = points(rows=ROWS)
    force = recording.force_on_tool.copy()
    rows = np.arange(BAD * ROWS, (BAD + 1) * ROWS)
    ramp = np.linspace(0.0, 1.0, ROWS)
    if how == "weak":
        force[rows, 2] *= 0.06
    elif how == "weak and rubbing":
        force[rows, 2] *= 0.06
        force[rows, 0] += 0.12 * ramp
    elif how == "pulls at last":
        force[rows[-1], 2] = -0.15
    elif how == "pulls and rubs":
        force[rows, 2] *= -0.2
        force[rows, 0] += 0.3 * ramp
    elif how == "negative, weak at last":
        force[rows, 2] = -0.3 + 0.38 * ramp
    elif how == "pulls":
        force[rows, 2] = -0.3 * ramp
    elif how == "upside down":
        force[rows, 2] = -2.0 + 2.0 * ramp
    elif how.startswith("offset"):
        force[rows, 2] += float(how.split()[1])
    return dataclasses.replace(recording, force_on_tool=force)


WHOLE = ("weak and rubbing", "offset 0.1")
ALIKE = ("pulls and rubs", "negative, weak at last", "weak", "pulls", "pulls at last", "upside down")
"""Ways of being bad that are followed to the modulus, and those that are followed to the presses."""


@pytest.fixture(scope="module")
def good(factorised_once) -> Reconstruction:
    return reconstruct_fully(points(rows=ROWS), SLAB)


@pytest.mark.parametrize("how", [WHOLE[0], pytest.param(WHOLE[1], marks=pytest.mark.slow)])
def test_a_bad_place_ends_no_recording_of_points(good, how):
    made = reconstruct_fully(spoilt(how), SLAB)
    assert made.young_modulus_pa == pytest.approx(good.young_modulus_pa, rel=0.02)
    left = len(good.exploration.presses) - len(made.exploration.presses)
    assert left in (0, 1) and len(made.exploration.rejected) == left
    for _, why in made.exploration.rejected:
        assert "the place at (10.0, 10.0, " in why and "rows 73 to 78" in why or "off the surface" in why
    assert made.exploration.presses.deepest.max() < 1.1 * good.exploration.presses.deepest.max()
    if how.startswith("offset"):
        assert left == 1


@pytest.mark.parametrize("how", ALIKE)
def test_a_bad_place_is_kept_as_a_light_press_or_left_out_and_named(how):
    recording = spoilt(how)
    found = explore_points(recording, nowhere(recording), ContactOptions())
    left = 25 - len(found.presses)
    assert left in (0, 1) and len(found.rejected) == left
    assert all("rows 73 to 78" in why for _, why in found.rejected)
    others = np.linalg.norm(found.presses.point[:, :2] - PLACE, axis=1) > 1e-3
    assert others.sum() == 24 and found.presses.deepest.max() < 1.1 * found.presses.deepest[others].max()


def test_a_place_that_lies_higher_is_kept():
    """A lump that a plane does not know: its force rises from nothing, only earlier."""
    recording = points(rows=ROWS)
    position = recording.position.copy()
    position[BAD * ROWS : (BAD + 1) * ROWS, 2] += 0.002
    lump = dataclasses.replace(recording, position=position)
    for held, left in ((lump, 0), (spoilt("offset 0.3"), 1)):
        found = explore_points(held, nowhere(held), ContactOptions())
        presses, up = found.presses, np.tile([0.0, 0.0, 1.0], (25, 1))
        reasons = off_surface(presses, presses.point * [1.0, 1.0, 0.0], up, found.boundary)
        told = [float(why.split("off by ")[1].split()[0]) for why in reasons if why]
        assert told == pytest.approx([0.3] * left, abs=0.03)


def test_what_is_left_out_says_which_press_and_why():
    recording = spoilt("pulls")
    ((t, why),) = explore_points(recording, nowhere(recording), ContactOptions()).rejected
    assert t == recording.t[BAD * ROWS]
    assert "rows 73 to 78" in why


@pytest.mark.slow
def test_a_bad_press_ends_no_recording_with_a_time(factorised_once):
    recording = raster()
    good = reconstruct_fully(recording, SLAB)
    starts = np.searchsorted(recording.t, good.exploration.presses.onset_s)
    ends = np.searchsorted(recording.t, good.exploration.presses.end_s)
    force = recording.force_on_tool.copy()
    for press, factor in ((3, -0.5), (11, 0.05), (17, -1.0)):
        force[starts[press] - 20 : ends[press] + 20] *= factor
    made = reconstruct_fully(dataclasses.replace(recording, force_on_tool=force), SLAB)
    assert made.young_modulus_pa == pytest.approx(good.young_modulus_pa, rel=0.02)
    assert len(made.exploration.presses) >= 22
    assert len(made.exploration.presses) + len(made.exploration.rejected) >= 24
    assert good.young_modulus_pa == pytest.approx(MODULUS_PA, rel=0.06)


def test_more_rows_than_four_thousand_are_points_too():
    recording = points((11, 10), rows=50)
    found = explore_points(recording, nowhere(recording), ContactOptions()).presses
    assert len(found) == found.sites == 110
