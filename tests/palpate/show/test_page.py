"""What a page makes of numbers and pictures, before a browser sees it."""

from __future__ import annotations

import re

import numpy as np
import pytest

from palpate.show.page import Page
from palpate.show.quantities import readable


@pytest.mark.parametrize(
    ("label", "values", "told", "shown"),
    [
        ("speed in the air [m/s]", [0.0436, 0.06], "speed in the air [mm/s]", [43.6, 60.0]),
        ("duration [s]", [109.5, 100.0], "duration [s]", [109.5, 100.0]),
        ("modulus by Hertz [Pa]", [20530.0, 5e4], "modulus by Hertz [kPa]", [20.53, 50.0]),
        ("the force reads late [s]", [4e-16, 0.0], "the force reads late [s]", [0.0, 0.0]),
        ("touches after the trace", [38.0, np.nan], "touches after the trace", [38.0, np.nan]),
    ],
)
def test_si_values_are_told_in_units_that_people_read(label, values, told, shown):
    name, found = readable(label, values)
    assert name == told and found == pytest.approx(shown, nan_ok=True)


def test_a_picture_says_how_narrow_it_may_become_before_its_letters_cannot_be_read():
    page = Page("Two pictures")
    page.figure(np.zeros((20, 1400, 3), dtype=np.uint8), "A wide one.")
    page.figure(np.zeros((20, 300, 3), dtype=np.uint8), "A narrow one.")
    assert re.findall(r"--legible:(\d+)px", page.html()) == ["840", "180"]
