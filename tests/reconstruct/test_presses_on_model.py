"""Presses of a recording on a model that was not made from it."""

from benchmarks.play import Case, recorded
from palpate.reconstruction.presses_on_model import presses_on


def test_slides_of_the_object_are_no_tracing_of_its_base():
    """A recording without a tracing of the base presses 18 places, every second one sliding to and fro: the
    slides lay in a plane, passed for the tracing, and one press was left of the 18."""
    recording, model = recorded(Case(2500, "both", "viscoelasticity", play=False))
    presses = presses_on(recording, model)
    assert len(presses) == 18
