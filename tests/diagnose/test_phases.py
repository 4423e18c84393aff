"""Loading, hold and unloading of a press."""

import numpy as np

from diagnose.touches import HOLDING, LOADING, UNLOADING, _phases


def test_a_press_has_a_deepest_part_even_where_it_never_reaches_the_surface():
    t = np.linspace(0, 1, 101)
    bump = 0.005 * np.sin(np.pi * t)
    inside, outside = _phases(t, bump, 0.0, 1.0), _phases(t, bump - 0.006, 0.0, 1.0)
    for phase in (inside, outside):
        assert phase[50] == HOLDING and phase[0] == LOADING and phase[-1] == UNLOADING
