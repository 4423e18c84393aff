"""Loading, hold and unloading of a press."""

import dataclasses

import numpy as np

from palpate.mechanics.presses.making import of_paths
from palpate.mechanics.presses.table import HOLDING, LOADING, UNLOADING


def test_a_press_has_a_deepest_part_even_where_it_never_reaches_the_surface():
    t = np.linspace(0, 1, 101)
    bump = 0.005 * np.sin(np.pi * t)
    up, centre = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, 0.005]])
    for depth in (bump, bump - 0.006):
        path = centre - depth[:, None] * up
        table = of_paths(
            np.array([0, len(t)]), path, 0 * path, centre, up, tip_radius_m=0.005, sample_rate_hz=100.0
        )
        table = dataclasses.replace(table, onset_s=np.array([0.0]), end_s=np.array([1.0]))
        phase = table.phase
        assert phase[50] == HOLDING and phase[0] == LOADING and phase[-1] == UNLOADING
