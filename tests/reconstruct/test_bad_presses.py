"""One bad press never ends a recording: it is left out and said, and the rest tells the same as before."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mechanics.recording import Recording
from reconstruct.geometry.placed import nowhere
from reconstruct.geometry.stated import GeometryOptions
from reconstruct.pipeline import Reconstruction, ReconstructOptions, reconstruct_fully
from reconstruct.steps.s3_contacts.contacts import ContactOptions
from reconstruct.steps.s3_contacts.quasi_static import explore_points

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
    elif how == "offset":
        force[rows, 2] += 0.5
    return dataclasses.replace(recording, force_on_tool=force)


@pytest.fixture(scope="module")
def good() -> Reconstruction:
    return reconstruct_fully(points(rows=ROWS), SLAB)


@pytest.mark.parametrize(
    "how",
    [
        "weak", "weak and rubbing", "pulls at last", "pulls and rubs", "negative, weak at last", "pulls",
        "upside down", "offset",
    ],
)  # fmt: skip
def test_a_bad_place_ends_no_recording_of_points(good, how):
    made = reconstruct_fully(spoilt(how), SLAB)
    assert made.young_modulus_pa == pytest.approx(good.young_modulus_pa, rel=0.02)
    left = len(good.exploration.presses) - len(made.exploration.presses)
    assert left in (0, 1) and len(made.exploration.rejected) == left
    for _, why in made.exploration.rejected:
        assert "the place at (10.0, 10.0, " in why and "rows 73 to 78" in why or "off the surface" in why


def test_what_is_left_out_says_which_press_and_why():
    recording = spoilt("pulls")
    ((t, why),) = explore_points(recording, nowhere(recording), ContactOptions()).rejected
    assert t == recording.t[BAD * ROWS]
    assert "(rows 73 to 78) has a force that does not grow inwards" in why


def test_a_bad_press_ends_no_recording_with_a_time():
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
