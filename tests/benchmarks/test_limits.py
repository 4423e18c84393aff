"""The benchmark of limits draws the noise that a comparison expects."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.limits import _noise


def test_noise_is_of_each_sample_and_adds_up_along_a_press_as_the_covariance_says():
    size, presses, adds_up = 60, 400, 6.0
    n = size * presses
    touches = SimpleNamespace(t=np.arange(n), parts=[slice(k * size, (k + 1) * size) for k in range(presses)])
    whitener = SimpleNamespace(
        sample_variance=np.full(n, 4.0), variance=4.0, louder=np.full(n, np.sqrt(adds_up))
    )
    drawn = _noise(touches, whitener, np.random.default_rng(3))
    assert drawn.var() == pytest.approx(4.0, rel=0.05)
    assert drawn.reshape(presses, size, 3).sum(axis=1).var() == pytest.approx(4.0 * adds_up * size, rel=0.1)
