"""A diagnosis: story, pictures, view. Its JSON is the science's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from palpate.diagnosis.verdict.result import Diagnosis
from palpate.show.colours import COLOURS
from palpate.show.diagnosis.figures import draw, view
from palpate.show.diagnosis.gaps import diagnosed, gap_at, sites_of
from palpate.show.diagnosis.story import story
from palpate.show.quantities import ERROR
from palpate.show.scenery import add_arrow, add_dots, add_object, surface_of

if TYPE_CHECKING:
    from pyvista import Plotter

__all__ = ["draw", "place", "story", "view"]


def place(result: Diagnosis, plotter: Plotter) -> None:
    """The object coloured by the gap, with the next touch as an arrow."""
    model = diagnosed(result)[1]
    gap = gap_at(result, surface_of(model)[0]) * 1e3
    add_object(plotter, model, gap, label="gap [mN]", colour_map=ERROR.colour_map)
    add_dots(plotter, sites_of(result), colour=COLOURS["touch"])
    touch = result.next_touch
    if touch is not None and result.candidates:
        along = np.array(touch.direction)
        add_arrow(plotter, np.array([touch.x, touch.y, touch.z]) - 0.03 * along, along, 0.03)
