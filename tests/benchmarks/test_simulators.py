"""The conformance table: the path of a press, and our own renderer against closed forms."""

import numpy as np
import pytest

from benchmarks.simulators import CASES, _pressed


def test_a_press_rests_at_each_depth_and_goes_sideways():
    case = CASES["sliding"]()
    t, centre, rests = case.path()
    radius = case.model.tool.tip_radius_m
    below = case.top[2] + radius - centre[rests, 2]
    assert below == pytest.approx([5e-4, 1e-3, 1e-3]) and centre[rests, 0] == pytest.approx([0, 0, 1e-4])
    assert np.linalg.norm(np.diff(centre, axis=0), axis=1).max() < 1e-4 and np.diff(t).min() > 0
    assert len(case.truth_n) == 2 and case.aside_n > 0


@pytest.mark.slow
def test_our_own_renderer_is_near_hertz_and_mindlin():
    (own,) = _pressed(CASES["sliding"](), [], [])
    assert own["over"] == pytest.approx([1, 1, 1], abs=0.08)
