"""A gap's size in bins: each sample counts once a kind, empty bins are nothing, chance may be taken off."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.presses.gap_bins import gap_by_bin
from palpate.mechanics.presses.table import HOLDING, LOADING, OUTSIDE, UNLOADING


def test_a_gap_at_the_deepest_while_held_at_the_end_is_in_those_bins_alone() -> None:
    press = np.repeat([0, 1, 2], 4)
    depth = np.tile([-0.1, 1.0, 3.0, 1.0], 3) * np.repeat([0.3, 0.6, 1.0], 4)
    phase = np.tile([OUTSIDE, LOADING, HOLDING, UNLOADING], 3)
    t = 100.0 + np.arange(12.0)
    square = np.where((press == 2) & (phase == HOLDING), 0.09, 0.0)
    bins = gap_by_bin(square, press, 4, depth, phase, t)
    assert bins["press_n"] == pytest.approx([0, 0, 0.15, 0])
    assert bins["depth_n"] == pytest.approx([0, 0, 0.3])
    assert bins["phase_n"] == pytest.approx([0, np.sqrt(0.03), 0], abs=1e-6)
    assert bins["time_n"] == pytest.approx([0, 0, 0.15])


def test_what_chance_adds_is_taken_off_before_the_root() -> None:
    rng = np.random.default_rng(0)
    n, noise = 90_000, 0.02
    gap = noise * rng.normal(size=(n, 3))
    gap[: n // 3, 0] += 0.03
    press, t = np.repeat([0, 1, 2], n // 3), np.arange(n) / 100
    square = (gap**2).sum(axis=1) - 3 * noise**2
    found = gap_by_bin(square, press, 3, np.ones(n), np.full(n, HOLDING), t)["press_n"]
    assert found[0] == pytest.approx(0.03, rel=0.03) and max(found[1:]) < 0.006
