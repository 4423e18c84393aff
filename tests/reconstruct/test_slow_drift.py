"""The force of free air, where long contact crowds as well."""

from __future__ import annotations

import numpy as np

from palpate.reconstruction.steps.s1_filter.signals import free_air_force


def test_a_long_tracing_that_is_stated_is_no_free_air():
    """Half of the recording at one force was taken for the drift, and the support turned over."""
    rng = np.random.default_rng(0)
    t = np.arange(0, 80, 0.01)
    force = 0.02 * rng.standard_normal((len(t), 3))
    force[(t > 1) & (t < 36), 2] += 0.67
    force[(t > 40) & (t % 4 < 1), 2] += 1.0
    taken, _ = free_air_force(t, force, 0.02)
    stated, _ = free_air_force(t, force, 0.02, touched=(t > 1) & (t < 36))
    assert np.abs(stated).max() < 0.02 < 0.5 < np.abs(taken).max()
